// One line per event, with keys: log_info("job=j-12 tile=4 worker=w-3", "unit accepted").
// info = a state changed, warn = something was retried, error = a person is needed. Never log and return the
// same error.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace ls {

enum class LogLevel { debug, info, warn, error, off };
// text: "TIME LEVEL KEYS TEXT". json: an object a line, {"time", "level", "text"} and the keys, all texts;
// the time is UTC.
enum class LogFormat { text, json };

void log_level(LogLevel level);
void log_format(LogFormat format);
std::optional<LogFormat> log_format_of(std::string_view name);  // "text" or "json"

void log_debug(std::string_view keys, std::string_view text);
void log_info(std::string_view keys, std::string_view text);
void log_warn(std::string_view keys, std::string_view text);
void log_error(std::string_view keys, std::string_view text);

// A text from outside as one value of a key: nothing in it can end the value, begin another key or a line.
std::string log_value(std::string_view text);

// A line as it is written after time and level; for tests.
std::string log_line(LogFormat format, std::string_view keys, std::string_view text);

}  // namespace ls
