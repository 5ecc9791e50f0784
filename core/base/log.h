// Logs one line per event, with keys (pairs KEY=VALUE) and a text: log_info("job=j-12 tile=4 worker=w-3",
// "unit accepted"). Levels: info = a state changed, warn = something was retried, error = a person must act.
// An error is either logged or returned, never both.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace ls {

enum class LogLevel { debug, info, warn, error, off };
// The form of a logged line. text: "TIME LEVEL KEYS TEXT". json: one object per line, with "time" (UTC),
// "level", "text" and the keys; all values are strings.
enum class LogFormat { text, json };

void log_level(LogLevel level);
void log_format(LogFormat format);
std::optional<LogFormat> log_format_of(std::string_view name);  // parses "text" or "json"

void log_debug(std::string_view keys, std::string_view text);
void log_info(std::string_view keys, std::string_view text);
void log_warn(std::string_view keys, std::string_view text);
void log_error(std::string_view keys, std::string_view text);

// Escapes external text for use as the value of a key, so that it cannot end the value or begin another key
// or line.
std::string log_value(std::string_view text);

// Returns the line that is logged, without its time and level; for tests.
std::string log_line(LogFormat format, std::string_view keys, std::string_view text);

}  // namespace ls
