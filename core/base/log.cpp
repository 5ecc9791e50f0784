#include "core/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>

#include "core/base/safe_text.h"

namespace ls {
namespace {

std::atomic<LogFormat> g_format{LogFormat::text};

constexpr const char* kTextPattern = "%Y-%m-%dT%H:%M:%S.%e %l %v";
constexpr const char* kJsonPattern = R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v)";

spdlog::logger& logger() {
  static const auto instance = [] {
    auto l = spdlog::stderr_logger_mt("lightshaft");
    l->set_pattern(kTextPattern);
    l->flush_on(spdlog::level::info);
    return l;
  }();
  return *instance;
}

// Adds the pairs in `keys`, such as "a=1 b=two words c=3", to `line`. A word without '=' belongs to the value
// before it. If a key occurs twice, its first value is kept.
void add_keys(nlohmann::ordered_json& line, std::string_view keys) {
  std::string key, value;
  const auto flush = [&] {
    if (!key.empty() && !line.contains(key)) line[key] = value;
  };
  while (!keys.empty()) {
    const std::string_view word = keys.substr(0, keys.find(' '));
    keys.remove_prefix(std::min(keys.size(), word.size() + 1));
    if (const auto equals = word.find('='); equals != std::string_view::npos && equals > 0) {
      flush();
      key = word.substr(0, equals), value = word.substr(equals + 1);
    } else if (!word.empty()) {
      (value += ' ') += word;
    }
  }
  flush();
}

void write(spdlog::level::level_enum level, std::string_view keys, std::string_view text) {
  if (logger().should_log(level)) logger().log(level, "{}", log_line(g_format, keys, text));
}

}  // namespace

void log_level(LogLevel level) {
  static constexpr spdlog::level::level_enum kLevels[] = {
      spdlog::level::debug, spdlog::level::info, spdlog::level::warn, spdlog::level::err, spdlog::level::off};
  logger().set_level(kLevels[static_cast<int>(level)]);
}

void log_format(LogFormat format) {
  g_format = format;
  const bool json = format == LogFormat::json;
  logger().set_pattern(json ? kJsonPattern : kTextPattern,
                       json ? spdlog::pattern_time_type::utc : spdlog::pattern_time_type::local);
}

std::optional<LogFormat> log_format_of(std::string_view name) {
  if (name == "text") return LogFormat::text;
  if (name == "json") return LogFormat::json;
  return std::nullopt;
}

void log_debug(std::string_view keys, std::string_view text) { write(spdlog::level::debug, keys, text); }
void log_info(std::string_view keys, std::string_view text) { write(spdlog::level::info, keys, text); }
void log_warn(std::string_view keys, std::string_view text) { write(spdlog::level::warn, keys, text); }
void log_error(std::string_view keys, std::string_view text) { write(spdlog::level::err, keys, text); }

std::string log_value(std::string_view text) {
  std::string value = plain_text(text);
  std::replace_if(
      value.begin(), value.end(), [](char c) { return c == ' ' || c == '='; }, '_');
  return value;
}

std::string log_line(LogFormat format, std::string_view keys, std::string_view text) {
  // Names and file contents in a message must not forge lines, nor control the terminal that shows them
  if (format == LogFormat::text)
    return keys.empty() ? plain_text(text) : fmt::format("{} {}", plain_text(keys), plain_text(text));
  nlohmann::ordered_json line;
  line["text"] = plain_lines(text);
  add_keys(line, plain_text(keys));
  // With error_handler_t::replace, dump() gives valid JSON whatever bytes a name contains. The opening brace
  // is removed, since kJsonPattern already writes one.
  return line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(1);
}

}  // namespace ls
