#include "config.h"

#include <nlohmann/json.hpp>

#include "porthole/base/error.h"

namespace porthole::cli {

namespace {

std::string text_of(const nlohmann::ordered_json& value, const std::string& where, const std::string& key) {
    if (value.is_string()) return value.get<std::string>();
    if (value.is_boolean() || value.is_number()) return value.dump();
    throw Error(ErrorKind::usage, "E0104", where + ":/" + key,
                std::string("a value must be a string, number, boolean or a list of them, not ") + value.type_name());
}

} // namespace

std::vector<ConfigEntry> parse_config(const std::string& text, const std::string& where) {
    // The callback bounds the nesting: the parser itself recurses nowhere, but freeing does.
    const auto shallow = [](int depth, nlohmann::ordered_json::parse_event_t, const nlohmann::ordered_json&) {
        return depth < 8;
    };
    nlohmann::ordered_json config;
    try {
        config = nlohmann::ordered_json::parse(text, shallow, true, true);
    } catch (const nlohmann::ordered_json::exception& e) {
        throw Error(ErrorKind::usage, "E0104", where, std::string("not a JSON file: ") + e.what());
    }
    if (!config.is_object()) throw Error(ErrorKind::usage, "E0104", where, "must hold one JSON object");
    std::vector<ConfigEntry> entries;
    for (const auto& [key, value] : config.items()) {
        std::vector<std::string> values;
        if (value.is_array())
            for (const auto& element : value) values.push_back(text_of(element, where, key));
        else
            values.push_back(text_of(value, where, key));
        entries.emplace_back(key, std::move(values));
    }
    return entries;
}

} // namespace porthole::cli
