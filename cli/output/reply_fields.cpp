#include "cli/output/reply_fields.h"

namespace ls::cli {

using nlohmann::json;

std::string text_field(const json& object, const char* key, const std::string& otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

bool flag_field(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && *found == json(true);
}

std::optional<double> number_field(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

int int_field(const json& object, const char* key, int otherwise) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number_integer() ? found->get<int>() : otherwise;
}

std::optional<std::pair<double, double>> pair_field(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != 2 || !(*found)[0].is_number() ||
      !(*found)[1].is_number())
    return std::nullopt;
  return std::pair((*found)[0].get<double>(), (*found)[1].get<double>());
}

std::string dump(const nlohmann::json& value) {
  return value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace ls::cli
