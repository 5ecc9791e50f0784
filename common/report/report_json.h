// Reading a report that may be of another version, or not ours at all: each call says what is there, or that
// nothing is.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ls::report {

using Json = nlohmann::json;

const Json& member(const Json& j, const char* key);  // null if there is none
double number(const Json& j, const char* key);       // NaN if there is none
std::string text(const Json& j, const char* key);    // empty if there is none
bool flag(const Json& j, const char* key, bool otherwise);
std::optional<std::pair<double, double>> interval(const Json& j, const char* key);  // [lo, hi]
std::vector<Json> objects(const Json& j, const char* key);       // those of a list that are objects
std::vector<std::string> texts(const Json& j, const char* key);  // those of a list that are texts

}  // namespace ls::report
