// Where the shared models are: $PORTHOLE_SHARED, or ../shared beside the checkout.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace porthole::test {

/// Empty when there are none; the test then skips itself and says so.
inline std::filesystem::path shared_folder() {
    if (const char* given = std::getenv("PORTHOLE_SHARED"); given && *given) return given;
    const std::filesystem::path beside = std::filesystem::path(PORTHOLE_SOURCE_DIR) / ".." / "shared";
    return std::filesystem::is_directory(beside / "models") ? beside : std::filesystem::path{};
}

} // namespace porthole::test

#define PORTHOLE_NEEDS_SHARED(folder)                                       \
    const std::filesystem::path folder = ::porthole::test::shared_folder(); \
    if (folder.empty()) GTEST_SKIP() << "needs the shared models: set PORTHOLE_SHARED"
