#include "common/report/job_sections.h"

namespace ls::report {

const Json& member(const Json& j, const char* key) {
  static const Json kNone;
  if (!j.is_object()) return kNone;
  const auto found = j.find(key);
  return found == j.end() ? kNone : *found;
}

double number(const Json& j, const char* key) {
  const Json& value = member(j, key);
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::string text(const Json& j, const char* key) {
  const Json& value = member(j, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}

bool flag(const Json& j, const char* key, bool otherwise) {
  const Json& value = member(j, key);
  return value.is_boolean() ? value.get<bool>() : otherwise;
}

std::optional<std::pair<double, double>> interval(const Json& j, const char* key) {
  const Json& value = member(j, key);
  if (!value.is_array() || value.size() != 2 || !value[0].is_number() || !value[1].is_number())
    return std::nullopt;
  return std::pair(value[0].get<double>(), value[1].get<double>());
}

std::vector<Json> objects(const Json& j, const char* key) {
  std::vector<Json> all;
  if (const Json& list = member(j, key); list.is_array())
    for (const Json& one : list)
      if (one.is_object()) all.push_back(one);
  return all;
}

std::vector<std::string> texts(const Json& j, const char* key) {
  std::vector<std::string> all;
  if (const Json& list = member(j, key); list.is_array())
    for (const Json& one : list)
      if (one.is_string()) all.push_back(one.get<std::string>());
  return all;
}

}  // namespace ls::report
