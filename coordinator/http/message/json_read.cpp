#include "coordinator/http/message/json_read.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"

namespace ls::http {
namespace {
using nlohmann::json;
}

Result<json> parse_json(std::string_view text, std::string_view what) {
  json value;
  bool too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t, const json&) {
    return !(too_deep |= depth > kMaxJsonDepth);
  };
  try {
    value = json::parse(text, watch);
  } catch (const json::exception& e) {
    return bad_argument(fmt::format("{} is not JSON: {}", what, e.what()));
  }
  if (too_deep) return bad_argument(fmt::format("{} is nested deeper than {} levels", what, kMaxJsonDepth));
  return value;
}

Result<json> read_object(std::string_view body, std::initializer_list<std::string_view> known) {
  auto object = parse_json(body, "the body");
  if (!object) return object;
  if (!object->is_object()) return bad_argument("the body must be a JSON object");
  for (const auto& item : object->items())
    if (std::find(known.begin(), known.end(), item.key()) == known.end())
      return bad_argument(fmt::format("unknown key '{}' in the body; known: {}", item.key().substr(0, 100),
                                      fmt::join(known, ", ")));
  return object;
}

Result<Digest> read_digest(std::string_view text, std::string_view what) {
  if (const auto digest = Digest::parse(lower_case(text.substr(0, 65)))) return *digest;
  return bad_argument(fmt::format("{} must be a SHA-256 of 64 hexadecimal digits", what));
}

Result<Digest> read_digest(const json& value, std::string_view what) {
  return read_digest(std::string_view(value.is_string() ? value.get_ref<const std::string&>() : ""), what);
}

std::string write_json(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace ls::http
