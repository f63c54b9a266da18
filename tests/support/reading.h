// What the tests of readers ask of every file: how it is refused, what it is warned of.
#pragma once

#include <string>
#include <vector>

#include "porthole/base/error.h"
#include "porthole/scene/scene.h"

namespace porthole::test {

/// Code and position of the error that `read` ends in, or "none".
template <typename Read> std::string code_of(const Read& read) {
    try {
        read();
    } catch (const Error& error) {
        return error.code + " " + error.where;
    }
    return "none";
}

inline std::vector<std::string> codes(const Scene& scene) {
    std::vector<std::string> out;
    for (const Warning& w : scene.warnings) out.push_back(w.code);
    return out;
}

} // namespace porthole::test
