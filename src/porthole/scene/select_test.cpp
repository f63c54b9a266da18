#include "porthole/scene/select.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace porthole {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// Parts with the given paths; names are what follows the last slash, without "[n]".
Scene scene_of(const std::vector<std::string>& paths) {
    Scene scene;
    scene.materials.resize(2);
    scene.materials[0].name = "Steel";
    scene.materials[1].name = "Rubber 2";
    scene.meshes.resize(2);
    for (std::uint32_t m = 0; m < 2; ++m) scene.meshes[m].submeshes = {{0, 1, m}};
    for (const std::string& path : paths) {
        Part part;
        part.path = path;
        part.name = path.substr(path.rfind('/') + 1);
        if (const auto bracket = part.name.rfind('['); part.name.ends_with(']')) part.name.resize(bracket);
        part.mesh = scene.parts.size() % 2;
        scene.parts.push_back(part);
    }
    return scene;
}

std::vector<std::uint32_t> ids(const Scene& scene, std::vector<std::string> selectors) {
    std::vector<std::uint32_t> out;
    for (const PartId id : select_parts(scene, selectors)) out.push_back(index(id));
    return out;
}

Error error_of(const Scene& scene, const std::string& selector) {
    try {
        (void)select_parts(scene, std::vector<std::string>{selector}, "--keep");
    } catch (const Error& e) {
        return e;
    }
    throw std::runtime_error("selected something: " + selector);
}

const Scene kEngine = scene_of({"engine/block/rod_1[0]", "engine/block/rod_1[1]", "engine/cover", "engine/head/valve",
                                "Rod_1", "engine/block/deep/valve", "#12x", "a*b", "axb"});

TEST(Select, NamesPathsAndGroups) {
    EXPECT_THAT(ids(kEngine, {"rod_1"}), ElementsAre(0, 1)) << "all of that name, case-sensitive";
    EXPECT_THAT(ids(kEngine, {"engine/block/rod_1[1]"}), ElementsAre(1));
    EXPECT_THAT(ids(kEngine, {"engine/block"}), ElementsAre(0, 1, 5)) << "a group is everything below it";
    EXPECT_THAT(ids(kEngine, {"engine/block/"}), ElementsAre(0, 1, 5));
    EXPECT_THAT(ids(kEngine, {"valve", "rod_1", "engine/head/valve"}), ElementsAre(0, 1, 3, 5)) << "they add up";
}

TEST(Select, Globs) {
    EXPECT_THAT(ids(kEngine, {"rod*"}), ElementsAre(0, 1));
    EXPECT_THAT(ids(kEngine, {"*_1"}), ElementsAre(0, 1, 4));
    EXPECT_THAT(ids(kEngine, {"engine/*"}), ElementsAre(2)) << "one segment";
    EXPECT_THAT(ids(kEngine, {"engine/**/valve"}), ElementsAre(3, 5));
    EXPECT_THAT(ids(kEngine, {"**/valve"}), ElementsAre(3, 5));
    EXPECT_THAT(ids(kEngine, {"engine/block/**"}), ElementsAre(0, 1, 5));
    EXPECT_THAT(ids(kEngine, {"*"}), ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
}

TEST(Select, Prefixes) {
    EXPECT_THAT(ids(kEngine, {"#4"}), ElementsAre(4));
    EXPECT_THAT(ids(kEngine, {"#12x"}), ElementsAre(6)) << "not an id, so a name";
    EXPECT_THAT(ids(kEngine, {"re:^[Rr]od_\\d$"}), ElementsAre(0, 1, 4));
    EXPECT_THAT(ids(kEngine, {"re:block/.*valve"}), ElementsAre(5));
    EXPECT_THAT(ids(kEngine, {"mat:Rubber*"}), ElementsAre(1, 3, 5, 7));
    EXPECT_THAT(ids(kEngine, {"mat:Steel"}), ElementsAre(0, 2, 4, 6, 8));
    EXPECT_THAT(ids(kEngine, {"a*b"}), ElementsAre(7)) << "the exact name comes first";
    EXPECT_THAT(ids(kEngine, {"name:a*b"}), ElementsAre(7));
    EXPECT_THAT(ids(scene_of({"re:x", "x"}), {"name:re:x"}), ElementsAre(0));
}

TEST(Select, CountsPerSelector) {
    const std::vector<SelectorMatch> matches = match_selectors(kEngine, std::vector<std::string>{"rod_1", "**/valve"});
    ASSERT_EQ(matches.size(), 2u);
    EXPECT_EQ(matches[0].selector, "rod_1");
    EXPECT_EQ(matches[0].parts.size(), 2u);
    EXPECT_EQ(matches[1].parts.size(), 2u);
}

TEST(Select, MissNamesTheNearest) {
    const Error typo = error_of(kEngine, "rod_2");
    EXPECT_EQ(typo.kind, ErrorKind::usage);
    EXPECT_EQ(typo.code, "E0110");
    EXPECT_EQ(typo.where, "--keep rod_2");
    EXPECT_THAT(typo.what(), HasSubstr("did you mean \"rod_1\""));
    EXPECT_THAT(error_of(kEngine, "ROD_1").what(), HasSubstr("\"rod_1\""));
    EXPECT_THAT(error_of(kEngine, "lve").what(), HasSubstr("\"valve\""));
    EXPECT_THAT(error_of(kEngine, "engine/blok/valve").what(), HasSubstr("engine/"));
    EXPECT_THAT(error_of(kEngine, "mat:Stel").what(), HasSubstr("\"Steel\""));
    EXPECT_THAT(error_of(kEngine, "#9").what(), HasSubstr("0 to 8"));
    EXPECT_THAT(error_of(kEngine, "nothing_like_it_at_all").what(), Not(HasSubstr("did you mean")));
    EXPECT_THAT(error_of(Scene{}, "x").what(), HasSubstr("no parts"));
}

TEST(Select, RefusesWhatCannotBeRead) {
    for (const std::string& selector : {std::string(), std::string(5000, 'a'), std::string("re:("),
                                        std::string("re:(a)\\1"), std::string("re:(a{1000}){1000}{1000}")})
        EXPECT_EQ(error_of(kEngine, selector).code, "E0111") << selector.substr(0, 20);
    EXPECT_EQ(error_of(kEngine, "#99999999999999999999999").code, "E0110");
}

TEST(Select, HostilePatternsAndNamesStayLinear) {
    const Scene scene = scene_of({std::string(16384, 'a'), std::string(16384, 'a') + "b"});
    EXPECT_EQ(ids(scene, {"*a*a*a*a*a*a*a*a*a*a*b"}), std::vector<std::uint32_t>{1});
    EXPECT_EQ(ids(scene, {"re:^(a+)+b$"}), std::vector<std::uint32_t>{1});
    EXPECT_EQ(ids(scene, {"re:^(.|a)*b$"}), std::vector<std::uint32_t>{1});
    EXPECT_EQ(error_of(scene, "re:^(a+)+c$").code, "E0110");
    EXPECT_EQ(error_of(scene, "re:" + std::string(2000, '(') + std::string(2000, ')') + "x").code, "E0110");
}

TEST(Select, GlobAgreesWithPlainRecursion) {
    // Oracle: the definition, by recursion, for short texts.
    struct Oracle {
        bool segments;
        [[nodiscard]] bool matches(std::string_view p, std::string_view t, bool at_segment) const {
            if (p.empty()) return t.empty();
            if (p[0] != '*') return !t.empty() && t[0] == p[0] && matches(p.substr(1), t.substr(1), p[0] == '/');
            const std::size_t stars = std::min(p.find_first_not_of('*'), p.size());
            const std::string_view rest = p.substr(stars);
            if (segments && stars > 1 && at_segment && rest.starts_with('/')) {
                if (matches(rest.substr(1), t, true)) return true;
                for (std::size_t i = 0; i < t.size(); ++i)
                    if (t[i] == '/' && matches(rest.substr(1), t.substr(i + 1), true)) return true;
                return false;
            }
            for (std::size_t i = 0; i <= t.size(); ++i) {
                if (matches(rest, t.substr(i), false)) return true;
                if (segments && stars == 1 && i < t.size() && t[i] == '/') return false;
            }
            return false;
        }
    };
    std::uint32_t state = 7;
    const auto random_text = [&](std::size_t most, std::string_view letters) {
        std::string out;
        state = state * 1664525u + 1013904223u;
        for (std::size_t n = (state >> 16) % (most + 1); n > 0; --n) {
            state = state * 1664525u + 1013904223u;
            out += letters[(state >> 16) % letters.size()];
        }
        return out;
    };
    int matched = 0;
    for (int i = 0; i < 200000; ++i) {
        const std::string pattern = random_text(7, "ab/**"), text = random_text(8, "ab/");
        const bool segments = i % 2 == 0;
        const bool expected = Oracle{segments}.matches(pattern, text, true);
        ASSERT_EQ(Glob(pattern, segments).matches(text), expected) << pattern << " on " << text << ' ' << segments;
        matched += expected;
    }
    EXPECT_GT(matched, 10000);
}

} // namespace
} // namespace porthole
