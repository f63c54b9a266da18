// The file behind --config.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace porthole::cli {

/// One key with its values: of a list one each, of true and false "true" and "false".
using ConfigEntry = std::pair<std::string, std::vector<std::string>>;

/// Reads a configuration: a JSON object whose keys are long option names without dashes and
/// whose values are strings, numbers, booleans or lists of them. Comments are allowed.
///   { "size": "1280x720", "target": ["rod*", "#12"], "no-shadows": true }
/// @param where  the file, for errors.
/// @throws Error usage E0104 when it is something else.
[[nodiscard]] std::vector<ConfigEntry> parse_config(const std::string& text, const std::string& where);

} // namespace porthole::cli
