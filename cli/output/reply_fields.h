// Reads fields of the JSON in a farm's answers. A field may be missing or have the wrong type.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ls::cli {

inline std::string text_field(const nlohmann::json& object, const char* key,
                              const std::string& otherwise = "") {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

// Returns true if the field is true; false also if it is missing or of another type.
inline bool flag_field(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && *found == nlohmann::json(true);
}

inline std::optional<double> number_field(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

inline int int_field(const nlohmann::json& object, const char* key, int otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_integer() ? found->get<int>() : otherwise;
}

// Returns the two numbers of a field such as [1.5, 2]; nullopt if it is missing or of another form.
inline std::optional<std::pair<double, double>> pair_field(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != 2 || !(*found)[0].is_number() ||
      !(*found)[1].is_number())
    return std::nullopt;
  return std::pair((*found)[0].get<double>(), (*found)[1].get<double>());
}

// Returns the field, or null if it is missing or not an object.
inline const nlohmann::json* object_field(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_object() ? &*found : nullptr;
}

// Returns the field, or an empty list if it is missing or not a list.
inline const nlohmann::json& list_field(const nlohmann::json& object, const char* key) {
  static const nlohmann::json none = nlohmann::json::array();
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? *found : none;
}

// Returns those elements of the list under `key` that are objects.
inline std::vector<nlohmann::json> objects_field(const nlohmann::json& object, const char* key) {
  std::vector<nlohmann::json> objects;
  for (const auto& element : list_field(object, key))
    if (element.is_object()) objects.push_back(element);
  return objects;
}

// Returns those elements of the list under `key` that are strings.
inline std::vector<std::string> texts_field(const nlohmann::json& object, const char* key) {
  std::vector<std::string> texts;
  for (const auto& element : list_field(object, key))
    if (element.is_string()) texts.push_back(element.get<std::string>());
  return texts;
}

// Returns the value as JSON text, indented by `indent` spaces per level; -1: on one line. Invalid UTF-8 is
// replaced.
template <class Json>
std::string dump(const Json& value, int indent = 2) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace ls::cli
