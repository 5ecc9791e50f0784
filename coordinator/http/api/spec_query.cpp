#include "coordinator/http/api/handlers.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "common/base/parse_number.h"

namespace ls::http {
namespace {

using Json = nlohmann::json;

tl::unexpected<Error> wrong(std::string_view key, std::string_view value, std::string_view expected) {
  return fail(Errc::invalid_argument,
              fmt::format("query parameter '{}' is '{}', expected {}", key, value, expected));
}

Result<Json> parse_size(std::string_view text) {
  const std::size_t x = text.find('x');
  if (x == std::string_view::npos) return wrong("size", text, "WIDTHxHEIGHT");
  const auto width = parse_number<int>(text.substr(0, x)), height = parse_number<int>(text.substr(x + 1));
  if (!width || !height) return wrong("size", text, "WIDTHxHEIGHT");
  return Json::array({*width, *height});
}

Json parse_list(std::string_view text) {
  Json list = Json::array();
  while (!text.empty())
    if (const auto part = take_part(text, ','); !part.empty()) list.push_back(std::string(part));
  return list;
}

template <class T>
Result<Json> json_number(std::string_view key, std::string_view text, std::string_view expected) {
  if (const auto value = parse_number<T>(text)) return Json(*value);
  return wrong(key, text, expected);
}

// Parses the text of one query parameter as the JSON value of the spec's key of that name; nullopt: there is
// no such key.
std::optional<Result<Json>> parse_value(std::string_view key, std::string_view text) {
  if (key == "spp" || key == "seed" || key == "max_workers" || key == "max_units" || key == "memory")
    return json_number<std::uint64_t>(key, text, "a whole number");
  if (key == "target_error" || key == "time") return json_number<double>(key, text, "a number");
  if (key == "priority") return json_number<int>(key, text, "a whole number");
  if (key == "size") return parse_size(text);
  if (key == "integrator" || key == "frames" || key == "reference" || key == "target_layer" ||
      key == "numeric_class")
    return Result<Json>(Json(std::string(text)));
  if (key == "aov" || key == "tags" || key == "after") return Result<Json>(parse_list(text));
  if (key == "float" || key == "denoise") {
    if (text == "true" || text == "1") return Result<Json>(Json(true));
    if (text == "false" || text == "0") return Result<Json>(Json(false));
    return Result<Json>(wrong(key, text, "true or false"));
  }
  return std::nullopt;
}

Result<void> add_define(Json& defines, std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) return wrong("define", text, "NAME=VALUE");
  const std::string name(text.substr(0, equals));
  if (defines.contains(name))
    return fail(Errc::invalid_argument, fmt::format("query: define '{}' is given twice", name));
  defines[name] = std::string(text.substr(equals + 1));
  return {};
}

}  // namespace

Result<JobSpec> spec_from_query(const Fields& query, std::string_view also, const std::string& base) {
  auto whole = parse_spec_object(base);
  if (!whole) return tl::unexpected(whole.error());
  // A wrong value in `base` is an error even if the query replaces this value.
  if (const auto alone = job_spec_of(*whole); !alone) return alone;
  Json spec = Json::object();
  Json defines = Json::object();
  for (const auto& [key, text] : query) {
    if (!also.empty() && key == also) continue;
    if (key == "define") {
      if (auto ok = add_define(defines, text); !ok) return tl::unexpected(ok.error());
      continue;
    }
    if (spec.contains(key))
      return fail(Errc::invalid_argument, fmt::format("query parameter '{}' is given twice", key));
    auto value = parse_value(key, text);
    if (!value)
      return fail(
          Errc::invalid_argument,
          fmt::format("unknown query parameter '{}'; known: {}{}spp, target_error, target_layer, time, seed, "
                      "size, integrator, "
                      "aov, define, priority, float, denoise, tags, frames, max_workers, max_units, memory, "
                      "numeric_class, after, reference",
                      key, also, also.empty() ? "" : ", "));
    if (!*value) return tl::unexpected(value->error());
    spec[key] = std::move(**value);
  }
  if (!defines.empty()) (*whole)["defines"].update(defines);
  whole->update(spec);
  // Invalid UTF-8, on which dump() would throw, is replaced; no valid key or name contains it.
  return parse_job_spec(whole->dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace ls::http
