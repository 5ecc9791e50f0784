#include "util/trace/otlp.h"

#include <nlohmann/json.hpp>

#include "core/base/overloaded.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"

namespace ls::trace {
namespace {

using nlohmann::json;

constexpr std::size_t kMostMessage = 200;
constexpr int kStatusError = 2;  // OTLP's STATUS_CODE_ERROR

// OTLP writes 64-bit integers as JSON strings, since many programs read JSON numbers as doubles of 53 bits.
std::string int64_text(std::int64_t value) { return std::to_string(value); }

json typed(const char* type, json value) { return json{{type, std::move(value)}}; }

json any_value(const Value& value) {
  return std::visit(overloaded{[](const std::string& v) { return typed("stringValue", v); },
                               [](std::int64_t v) { return typed("intValue", int64_text(v)); },
                               [](double v) { return typed("doubleValue", v); },
                               [](bool v) { return typed("boolValue", v); }},
                    value);
}

json key_values(const auto& pairs) {
  json out = json::array();
  for (const auto& [key, value] : pairs) out.push_back({{"key", key}, {"value", any_value(value)}});
  return out;
}

json span_json(const Span& span) {
  json out{{"traceId", hex(span.context.trace)},
           {"spanId", hex(span.context.span)},
           {"name", span.name},
           {"kind", static_cast<int>(span.kind)},
           {"startTimeUnixNano", int64_text(span.start_ns)},
           {"endTimeUnixNano", int64_text(span.end_ns)},
           {"attributes", key_values(span.attributes)}};
  if (span.parent) out["parentSpanId"] = hex(*span.parent);
  for (const SpanEvent& event : span.events)
    out["events"].push_back({{"timeUnixNano", int64_text(event.at_ns)}, {"name", event.name}});
  if (span.events_left_out > 0) out["droppedEventsCount"] = span.events_left_out;
  if (span.failed) out["status"] = {{"code", kStatusError}};
  return out;
}

}  // namespace

std::string otlp_request(const Resource& resource, std::span<const Span> spans) {
  json all = json::array();
  for (const Span& span : spans) all.push_back(span_json(span));
  const json scope{{"scope", {{"name", "lightshaft"}}}, {"spans", std::move(all)}};
  const json of_this_program{{"resource", {{"attributes", key_values(resource.attributes)}}},
                             {"scopeSpans", json::array({scope})}};
  return json{{"resourceSpans", json::array({of_this_program})}}.dump(-1, ' ', false,
                                                                      json::error_handler_t::replace);
}

PartialSuccess otlp_partial_success(std::string_view answer) {
  PartialSuccess out;
  const json body = json::parse(answer, nullptr, false);
  if (!body.is_object() || !body.contains("partialSuccess") || !body["partialSuccess"].is_object())
    return out;
  const json& partial = body["partialSuccess"];
  if (const auto count = partial.find("rejectedSpans"); count != partial.end()) {
    if (count->is_number_unsigned()) out.rejected = count->get<std::uint64_t>();
    if (count->is_string())
      out.rejected = parse_number<std::uint64_t>(count->get_ref<const std::string&>()).value_or(0);
  }
  if (const auto text = partial.find("errorMessage"); text != partial.end() && text->is_string())
    out.message = plain_text(text->get_ref<const std::string&>().substr(0, kMostMessage));
  return out;
}

}  // namespace ls::trace
