// Fields of a farm's answers, which may be missing or of the wrong type.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

namespace ls::cli {

std::string text_field(const nlohmann::json& object, const char* key, const std::string& otherwise = "");
std::optional<double> number_field(const nlohmann::json& object, const char* key);
bool flag_field(const nlohmann::json& object, const char* key);  // false if missing or of another type
int int_field(const nlohmann::json& object, const char* key, int otherwise);
std::optional<std::pair<double, double>> pair_field(const nlohmann::json& object,
                                                    const char* key);  // [1.5, 2]
std::string dump(const nlohmann::json& value);  // indented, for --json; invalid UTF-8 is replaced

}  // namespace ls::cli
