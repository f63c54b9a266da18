// Which parts a user means: selectors by name, path, glob, expression, id and material.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "porthole/scene/scene.h"

namespace porthole {

/// What one selector matched.
struct SelectorMatch {
    std::string selector;      ///< as given
    std::vector<PartId> parts; ///< ascending, at least one
};

/// The parts that each selector names, in the order of the selectors.
///
/// A selector is the first of these that matches anything (case-sensitive):
///   NAME        every part of exactly this name
///   A/B/NAME    the part of exactly this path; or all parts below the group of this path
///   glob        with `*` and `**`. Without a slash it is held against names and `*` is any
///               text; with one against paths, where `*` stays within a segment, `**` is any
///               text and `**` before a slash also stands for no segment at all
/// or it carries a prefix that decides:
///   re:EXPR     ECMAScript expression found anywhere in the name or the path (no back
///               references)
///   #7          the part with this id
///   mat:NAME    parts with a material of this name or glob
///   name:NAME   exactly this name, whatever it looks like
///
/// @param option  the option that errors name, such as "--target".
/// @throws Error usage E0110 when a selector matches nothing: the reason names the nearest
///         names, unescaped; E0111 when it cannot be read (empty, over 4096 bytes, a bad
///         expression or id).
/// Cost: per selector linear in the total length of the names times the pattern's; no
/// pattern makes it exponential or recurse with the length of a name.
[[nodiscard]] std::vector<SelectorMatch> match_selectors(const Scene& scene, std::span<const std::string> selectors,
                                                         const std::string& option = "--target");

/// All parts that any of the selectors names, ascending, each once. Errors as match_selectors.
///
///   const std::vector<PartId> rods = select_parts(scene, std::vector<std::string>{"rod_123-699*"});
[[nodiscard]] std::vector<PartId> select_parts(const Scene& scene, std::span<const std::string> selectors,
                                               const std::string& option = "--target");

/// A glob made ready. `*` and `**` are the only wildcards; everything else is literal.
class Glob {
public:
    /// @param segments  true: `*` stops at slashes, as for paths.
    Glob(std::string_view pattern, bool segments);
    /// Whether the whole of `text` matches. Cost: length of text times length of pattern at
    /// worst.
    [[nodiscard]] bool matches(std::string_view text) const;

private:
    enum class Kind : unsigned char { literal, segment_text, any_text, any_segments };
    struct Token {
        Kind kind;
        char byte;
    };
    std::vector<Token> tokens_;
};

/// Up to `count` of `names` that look most like `wanted`, best first: the same but for case,
/// containing it, or within a few edits. Equal names once. Empty when nothing is near.
/// Cost: bounded by 40 000 comparisons of 64 bytes.
[[nodiscard]] std::vector<std::string> nearest_names(std::string_view wanted, std::span<const std::string> names,
                                                     std::size_t count = 3);

} // namespace porthole
