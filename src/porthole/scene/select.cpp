#include "porthole/scene/select.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <numeric>
#include <optional>
#include <regex>
#include <tuple>
#include <unordered_set>

namespace porthole {

namespace {

constexpr std::size_t kMaxSelector = 4096; ///< bytes
constexpr std::size_t kShownName = 80;     ///< bytes of a name that a hint shows

std::string_view without_prefix(std::string_view text, std::string_view prefix) { return text.substr(prefix.size()); }

/// At most `limit` bytes of `text`, not ending inside a UTF-8 sequence.
std::string shortened(std::string_view text, std::size_t limit) {
    if (text.size() <= limit) return std::string(text);
    std::size_t n = limit;
    while (n > 0 && (static_cast<unsigned char>(text[n]) & 0xC0u) == 0x80u) --n;
    return std::string(text.substr(0, n)) + "...";
}

/// Parts, ascending, for which `test` holds.
template <typename Test> std::vector<PartId> parts_where(const Scene& scene, Test&& test) {
    std::vector<PartId> out;
    for (std::size_t i = 0; i < scene.parts.size(); ++i)
        if (test(scene.parts[i])) out.push_back(PartId{std::uint32_t(i)});
    return out;
}

std::vector<PartId> by_name(const Scene& scene, std::string_view name) {
    return parts_where(scene, [&](const Part& p) { return p.name == name; });
}

std::vector<PartId> by_path(const Scene& scene, std::string_view path) {
    std::vector<PartId> exact = parts_where(scene, [&](const Part& p) { return p.path == path; });
    if (!exact.empty()) return exact;
    while (path.ends_with('/')) path.remove_suffix(1);
    if (path.empty()) return {};
    return parts_where(scene, [&](const Part& p) {
        return p.path.size() > path.size() && p.path[path.size()] == '/' && p.path.starts_with(path);
    });
}

std::vector<PartId> by_glob(const Scene& scene, std::string_view pattern) {
    const bool on_path = pattern.find('/') != std::string_view::npos;
    const Glob glob(pattern, on_path);
    return parts_where(scene, [&](const Part& p) { return glob.matches(on_path ? p.path : p.name); });
}

std::vector<PartId> by_material(const Scene& scene, std::string_view name) {
    const auto with = [&](auto&& wanted) {
        std::vector<std::uint8_t> material(scene.materials.size());
        for (std::size_t m = 0; m < material.size(); ++m) material[m] = wanted(scene.materials[m].name);
        return parts_where(scene, [&](const Part& p) {
            return std::ranges::any_of(scene.meshes[p.mesh].submeshes, [&](const Submesh& s) {
                return s.triangle_count > 0 && s.material < material.size() && material[s.material];
            });
        });
    };
    std::vector<PartId> exact = with([&](const std::string& m) { return m == name; });
    if (!exact.empty() || name.find('*') == std::string_view::npos) return exact;
    const Glob glob(name, false);
    return with([&](const std::string& m) { return glob.matches(m); });
}

std::vector<PartId> by_expression(const Scene& scene, const std::string& expression, const std::string& where) {
    // libstdc++'s default matcher recurses once per character and can take exponential time;
    // its breadth-first one does neither, and refuses back references.
    auto flags = std::regex::ECMAScript | std::regex::nosubs;
#ifdef __GLIBCXX__
    flags |= std::regex_constants::__polynomial;
#endif
    try {
        const std::regex regex(expression, flags);
        return parts_where(
            scene, [&](const Part& p) { return std::regex_search(p.name, regex) || std::regex_search(p.path, regex); });
    } catch (const std::regex_error& e) {
        throw Error(ErrorKind::usage, "E0111", where, std::string("the expression cannot be used: ") + e.what());
    }
}

/// The id of "#7"; empty when the rest is not a whole number (then it is a name).
std::optional<std::uint64_t> id_of(std::string_view selector) {
    if (!selector.starts_with('#') || selector.size() < 2) return std::nullopt;
    std::uint64_t id = 0;
    const char* const end = selector.data() + selector.size();
    const auto [stop, code] = std::from_chars(selector.data() + 1, end, id);
    if (code == std::errc::invalid_argument || stop != end) return std::nullopt;
    return code == std::errc{} ? id : ~std::uint64_t(0);
}

std::string quoted(std::string_view name) { return '"' + shortened(name, kShownName) + '"'; }

/// "; did you mean "a" or "b"?" or nothing.
std::string hint(std::string_view wanted, std::span<const std::string> names) {
    const std::vector<std::string> near = nearest_names(wanted, names);
    std::string out;
    for (std::size_t i = 0; i < near.size(); ++i)
        out += (i == 0 ? "; did you mean " : i + 1 == near.size() ? " or " : ", ") + quoted(near[i]);
    return near.empty() ? out : out + "?";
}

[[noreturn]] void throw_miss(const Scene& scene, const std::string& selector, const std::string& where) {
    const auto miss = [&](const std::string& reason) -> Error { return {ErrorKind::usage, "E0110", where, reason}; };
    if (scene.parts.empty()) throw miss("the model has no parts");
    std::vector<std::string> names;
    if (selector.starts_with("mat:")) {
        for (const Material& m : scene.materials) names.push_back(m.name);
        throw miss("no part has such a material" + hint(without_prefix(selector, "mat:"), names));
    }
    if (id_of(selector)) throw miss("no such part; ids go from 0 to " + std::to_string(scene.parts.size() - 1));
    if (selector.starts_with("re:"))
        throw miss("no name or path of the " + std::to_string(scene.parts.size()) + " parts matches");
    std::string_view wanted = selector;
    if (wanted.starts_with("name:")) wanted = without_prefix(wanted, "name:");
    for (const Part& p : scene.parts) names.push_back(wanted.find('/') == std::string_view::npos ? p.name : p.path);
    const std::string near = hint(wanted, names);
    throw miss("no part matches" + (near.empty() ? std::string("; `porthole parts` lists them") : near));
}

std::vector<PartId> matches_of(const Scene& scene, const std::string& selector, const std::string& where) {
    if (selector.empty()) throw Error(ErrorKind::usage, "E0111", where, "the selector is empty");
    if (selector.size() > kMaxSelector)
        throw Error(ErrorKind::usage, "E0111", where,
                    "the selector has " + std::to_string(selector.size()) + " bytes, at most " +
                        std::to_string(kMaxSelector) + " are taken");
    if (selector.starts_with("name:")) return by_name(scene, without_prefix(selector, "name:"));
    if (selector.starts_with("re:")) return by_expression(scene, selector.substr(3), where);
    if (selector.starts_with("mat:")) return by_material(scene, without_prefix(selector, "mat:"));
    if (const std::optional<std::uint64_t> id = id_of(selector)) {
        if (*id >= scene.parts.size()) return {};
        return {PartId{std::uint32_t(*id)}};
    }
    if (std::vector<PartId> parts = by_name(scene, selector); !parts.empty()) return parts;
    if (std::vector<PartId> parts = by_path(scene, selector); !parts.empty()) return parts;
    if (selector.find('*') != std::string::npos) return by_glob(scene, selector);
    return {};
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; }

std::string lowered(std::string_view text) {
    std::string out(text);
    for (char& c : out) c = lower(c);
    return out;
}

/// Levenshtein distance; anything above `limit` may be returned as limit + 1.
int edit_distance(std::string_view a, std::string_view b, int limit) {
    const int difference = int(a.size()) - int(b.size());
    if (difference > limit || -difference > limit) return limit + 1;
    std::vector<int> row(b.size() + 1);
    std::iota(row.begin(), row.end(), 0);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        int diagonal = row[0], best = row[0] = int(i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const int above = row[j];
            row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
            diagonal = above;
            best = std::min(best, row[j]);
        }
        if (best > limit) return limit + 1;
    }
    return row.back();
}

} // namespace

std::vector<SelectorMatch> match_selectors(const Scene& scene, std::span<const std::string> selectors,
                                           const std::string& option) {
    std::vector<SelectorMatch> out;
    for (const std::string& selector : selectors) {
        const std::string where = option + ' ' + shortened(selector, kShownName);
        std::vector<PartId> parts = matches_of(scene, selector, where);
        if (parts.empty()) throw_miss(scene, selector, where);
        out.push_back({selector, std::move(parts)});
    }
    return out;
}

std::vector<PartId> select_parts(const Scene& scene, std::span<const std::string> selectors,
                                 const std::string& option) {
    std::vector<PartId> out;
    for (const SelectorMatch& match : match_selectors(scene, selectors, option))
        out.insert(out.end(), match.parts.begin(), match.parts.end());
    std::ranges::sort(out);
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
}

Glob::Glob(std::string_view pattern, bool segments) {
    for (std::size_t i = 0; i < pattern.size();) {
        if (pattern[i] != '*') {
            tokens_.push_back({Kind::literal, pattern[i++]});
            continue;
        }
        const std::size_t first = i;
        while (i < pattern.size() && pattern[i] == '*') ++i;
        const bool single = i - first == 1;
        if (segments && single) {
            tokens_.push_back({Kind::segment_text, 0});
        } else if (segments && i < pattern.size() && pattern[i] == '/' && (first == 0 || pattern[first - 1] == '/')) {
            tokens_.push_back({Kind::any_segments, 0}); // takes the slash along: "a/**/b" is "a/b" too
            ++i;
        } else {
            tokens_.push_back({Kind::any_text, 0});
        }
    }
}

bool Glob::matches(std::string_view text) const {
    // All positions in the pattern at once, one byte of text after the other: no backtracking.
    // A position is 2k before token k, 2k+1 inside an any_segments token k that has begun.
    const std::size_t end = 2 * tokens_.size();
    std::vector<std::size_t> now, next;
    std::vector<std::size_t> seen(end + 1, 0); ///< step at which a position was last added
    std::size_t step = 1;
    const auto add = [&](std::vector<std::size_t>& set, std::size_t position) {
        while (true) {
            if (seen[position] == step) return;
            seen[position] = step;
            set.push_back(position);
            if (position == end || position % 2 == 1 || tokens_[position / 2].kind == Kind::literal) return;
            position += 2; // every wildcard also stands for nothing
        }
    };
    add(now, 0);
    for (const char c : text) {
        ++step;
        next.clear();
        for (const std::size_t position : now) {
            if (position == end) continue;
            const Token token = tokens_[position / 2];
            switch (token.kind) {
            case Kind::literal:
                if (token.byte == c) add(next, position + 2);
                break;
            case Kind::segment_text:
                if (c != '/') add(next, position);
                break;
            case Kind::any_text: add(next, position); break;
            case Kind::any_segments:
                add(next, position | 1u);
                if (c == '/') add(next, (position | 1u) + 1);
                break;
            }
        }
        if (next.empty()) return false;
        std::swap(now, next);
    }
    return seen[end] == step;
}

std::vector<std::string> nearest_names(std::string_view wanted, std::span<const std::string> names, std::size_t count) {
    constexpr std::size_t kCompared = 64, kMostNames = 40000;
    std::string plain;
    std::ranges::copy_if(lowered(wanted), std::back_inserter(plain), [](char c) { return c != '*'; });
    plain.resize(std::min(plain.size(), kCompared));
    if (plain.empty()) return {};
    const int limit = plain.size() <= 3 ? 1 : std::max(2, int(plain.size()) / 3);

    struct Candidate {
        int rank; ///< 0: equal but for case; 1: contains it; then the number of edits
        std::size_t length, place;
    };
    std::vector<Candidate> candidates;
    std::unordered_set<std::string_view> seen;
    for (std::size_t i = 0; i < names.size() && seen.size() < kMostNames; ++i) {
        if (names[i].empty() || !seen.insert(names[i]).second) continue;
        const std::string name = lowered(std::string_view(names[i]).substr(0, 4 * kCompared));
        if (name == plain)
            candidates.push_back({0, 0, i});
        else if (name.find(plain) != std::string::npos)
            candidates.push_back({1, name.size(), i});
        else if (const int d = edit_distance(plain, std::string_view(name).substr(0, kCompared), limit); d <= limit)
            candidates.push_back({1 + d, name.size(), i});
    }
    std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
        return std::tie(a.rank, a.length, a.place) < std::tie(b.rank, b.length, b.place);
    });
    std::vector<std::string> out;
    for (std::size_t i = 0; i < candidates.size() && i < count; ++i) out.push_back(names[candidates[i].place]);
    return out;
}

} // namespace porthole
