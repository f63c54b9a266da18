// Errors and warnings: one line each, with a code, a place, what was found and a hint.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace porthole {

/// What kind of failure; the command line maps it to an exit code.
enum class ErrorKind {
    usage,  ///< exit 2: arguments that cannot be meant
    input,  ///< exit 3: a file that cannot be read as what it claims to be
    output, ///< exit 4: a result that cannot be written
    limit,  ///< exit 5: memory, time or size
    bug     ///< exit 1
};

/// Thrown at public entry points, never in pixel loops.
///
/// `code` is stable ("E0301"); `where` is a file with an offset, line, JSON pointer or an
/// option name; what() is the reason with a hint. None of the three is escaped: names in
/// them may be hostile, and whoever prints them escapes.
/// Codes: E01xx usage, E02xx files and system, E03xx glTF, E04xx OBJ/MTL, E05xx PLY,
/// E06xx STL, E07xx images, E08xx output, E09xx limits, E10xx scene files; Wxxxx alike.
class Error : public std::runtime_error {
public:
    Error(ErrorKind error_kind, std::string error_code, std::string place, const std::string& reason)
        : std::runtime_error(reason), kind(error_kind), code(std::move(error_code)), where(std::move(place)) {}

    ErrorKind kind;
    std::string code;
    std::string where;
};

/// Something was left out or repaired; the result stands.
struct Warning {
    std::string code; ///< "W0102"
    std::string where;
    std::string reason;
};
using Warnings = std::vector<Warning>;

} // namespace porthole
