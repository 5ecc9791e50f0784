// Reads fields of a report that another version of this program, or another program, may have written. Each
// function returns the field's value, or a default if the field is missing.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ls::report {

using Json = nlohmann::json;

const Json& member(const Json& j, const char* key);  // null if missing
double number(const Json& j, const char* key);       // NaN if missing
std::string text(const Json& j, const char* key);    // empty if missing
bool flag(const Json& j, const char* key, bool otherwise);
std::optional<std::pair<double, double>> interval(const Json& j, const char* key);  // [lo, hi]
std::vector<Json> objects(const Json& j, const char* key);       // the elements of a list that are objects
std::vector<std::string> texts(const Json& j, const char* key);  // the elements of a list that are strings

}  // namespace ls::report
