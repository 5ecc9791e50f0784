#include "util/trace/otel_settings.h"

#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/base/log.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "util/http/post.h"

namespace ls::trace {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

constexpr const char* kTracesPath = "/v1/traces";
constexpr std::string_view kServiceName = "service.name";

// A setting of the exporter: the value of the environment variable that is for traces alone
// (OTEL_EXPORTER_OTLP_TRACES_...) or, if that is not set or empty, of the one for all signals, which are
// traces, metrics and logs (OTEL_EXPORTER_OTLP_...). `name` is the variable that was used, for messages.
struct Setting {
  std::string name, value;
};

Setting setting(const Environment& environment, const std::string& ending) {
  for (const std::string& name : {"OTEL_EXPORTER_OTLP_TRACES_" + ending, "OTEL_EXPORTER_OTLP_" + ending})
    if (const char* value = environment(name.c_str()); value && *value) return {name, value};
  return {"OTEL_EXPORTER_OTLP_" + ending, ""};
}

std::string plain(const Environment& environment, const char* name) {
  const char* value = environment(name);
  return value ? value : "";
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t"), end = text.find_last_not_of(" \t");
  return begin == std::string_view::npos ? "" : text.substr(begin, end + 1 - begin);
}

// Decodes %XX, as in W3C Baggage. nullopt: a digit is wrong, or the result has a control character; a line
// end would let the text add another HTTP header.
std::optional<std::string> decoded(std::string_view text) {
  auto out = percent_decode(text);
  if (out && std::any_of(out->begin(), out->end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    return std::nullopt;
  return out;
}

bool is_header_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '-' || c == '_' || c == '.';
  });
}

// Reads a list "name=value,name=value". Error messages do not contain the text, since it may contain secrets.
Result<Pairs> read_pairs(const std::string& variable, std::string_view text) {
  Pairs pairs;
  while (!text.empty()) {
    const std::string_view item = trimmed(text.substr(0, text.find(',')));
    text.remove_prefix(
        std::min(text.size(), text.find(',') == std::string_view::npos ? text.size() : text.find(',') + 1));
    if (item.empty()) continue;
    const auto equals = item.find('=');
    const std::string_view name = trimmed(item.substr(0, equals));
    const auto value =
        equals == std::string_view::npos ? std::nullopt : decoded(trimmed(item.substr(equals + 1)));
    if (!is_header_name(name) || !value)
      return bad_argument(fmt::format("{}: part {} is no NAME=VALUE; special characters are written as %XX",
                                      variable, pairs.size() + 1));
    pairs.emplace_back(name, *value);
  }
  return pairs;
}

Result<Sampler> read_sampler(std::string name, const std::string& argument) {
  Sampler sampler;
  constexpr std::string_view kParentBased = "parentbased_";
  if (name.empty()) name = "parentbased_always_on";
  sampler.parent_decides = name.starts_with(kParentBased);
  const std::string kind = sampler.parent_decides ? name.substr(kParentBased.size()) : name;
  if (kind == "always_on") return sampler;
  if (kind == "always_off") return Sampler{0, sampler.parent_decides};
  if (kind != "traceidratio")
    return bad_argument(fmt::format(
        "OTEL_TRACES_SAMPLER '{}' is unknown; use always_on, always_off or traceidratio, or one of "
        "these with parentbased_ before it",
        name));
  const auto ratio = argument.empty() ? 1. : parse_number<double>(argument);
  if (!ratio || !(*ratio >= 0 && *ratio <= 1))
    return bad_argument(fmt::format(
        "OTEL_TRACES_SAMPLER_ARG '{}' must be the fraction of the traces to record, 0 to 1", argument));
  sampler.ratio = *ratio;
  return sampler;
}

Result<void> check_protocol(const Setting& protocol) {
  if (protocol.value.empty() || protocol.value == "http/json") return {};
  // This is only a warning, since http/protobuf is often set for all programs of a machine, and collectors
  // accept both encodings on one port.
  if (protocol.value == "http/protobuf") {
    log_warn("", fmt::format("{} is http/protobuf, but spans are sent as http/json: the collector must take "
                             "that, too",
                             protocol.name));
    return {};
  }
  return bad_argument(
      fmt::format("{} is '{}', but spans are sent as JSON by HTTP: set it to http/json, and the endpoint to "
                  "the collector's port for HTTP (usually 4318)",
                  protocol.name, protocol.value));
}

Result<std::string> read_url(const Environment& environment) {
  auto [name, url] = setting(environment, "ENDPOINT");
  if (url.empty()) return url;
  if (auto fine = check_http_url(url, name); !fine) return tl::unexpected(fine.error());
  if (name == "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT") return url;
  while (url.ends_with('/')) url.pop_back();
  return url + kTracesPath;
}

}  // namespace

bool Sampler::takes(const TraceId& trace, std::optional<bool> parent_sampled) const {
  if (parent_decides && parent_sampled) return *parent_sampled;
  std::uint64_t low = 0;
  for (std::size_t i = 8; i < 16; ++i) low = low << 8 | trace.bytes[i];
  return std::ldexp(static_cast<double>(low >> 11), -53) < ratio;
}

Result<std::optional<Settings>> settings_from(const Environment& environment, const std::string& program) {
  const std::string exporter = plain(environment, "OTEL_TRACES_EXPORTER");
  // OpenTelemetry's specification says that "true" is recognised in any letter case.
  const bool off = ::strcasecmp(plain(environment, "OTEL_SDK_DISABLED").c_str(), "true") == 0;
  if (off || exporter == "none") return std::nullopt;
  auto url = read_url(environment);
  if (!url) return tl::unexpected(url.error());
  if (url->empty()) return std::nullopt;
  if (!exporter.empty() && exporter != "otlp")
    return bad_argument(fmt::format("OTEL_TRACES_EXPORTER '{}' is unknown; use otlp or none", exporter));
  if (const auto fine = check_protocol(setting(environment, "PROTOCOL")); !fine)
    return tl::unexpected(fine.error());

  Settings settings;
  settings.url = std::move(*url);
  const auto headers = setting(environment, "HEADERS");
  auto pairs = read_pairs(headers.name, headers.value);
  if (!pairs) return tl::unexpected(pairs.error());
  settings.headers = std::move(*pairs);
  settings.ca_file = setting(environment, "CERTIFICATE").value;
  if (const auto limit = setting(environment, "TIMEOUT"); !limit.value.empty()) {
    const auto ms = parse_number<std::uint32_t>(limit.value);
    if (!ms || *ms == 0 || *ms > 600'000)
      return bad_argument(fmt::format("{} '{}' must be 1 to 600000 milliseconds", limit.name, limit.value));
    settings.seconds = *ms * 1e-3;
  }
  auto resource = read_pairs("OTEL_RESOURCE_ATTRIBUTES", plain(environment, "OTEL_RESOURCE_ATTRIBUTES"));
  if (!resource) return tl::unexpected(resource.error());
  settings.resource = std::move(*resource);
  settings.service = plain(environment, "OTEL_SERVICE_NAME");
  for (const auto& [key, value] : settings.resource)
    if (settings.service.empty() && key == kServiceName) settings.service = value;
  if (settings.service.empty()) settings.service = program;
  std::erase_if(settings.resource, [](const auto& pair) { return pair.first == kServiceName; });
  auto sampler =
      read_sampler(plain(environment, "OTEL_TRACES_SAMPLER"), plain(environment, "OTEL_TRACES_SAMPLER_ARG"));
  if (!sampler) return tl::unexpected(sampler.error());
  settings.sampler = *sampler;
  return settings;
}

}  // namespace ls::trace
