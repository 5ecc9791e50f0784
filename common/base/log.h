// One line per event, with keys: log_info("job=j-12 tile=4 worker=w-3", "unit accepted").
// info = a state changed, warn = something was retried, error = a person is needed. Never log and return the
// same error.
#pragma once

#include <string_view>

namespace ls {

enum class LogLevel { debug, info, warn, error, off };

void log_level(LogLevel level);
void log_debug(std::string_view keys, std::string_view text);
void log_info(std::string_view keys, std::string_view text);
void log_warn(std::string_view keys, std::string_view text);
void log_error(std::string_view keys, std::string_view text);

}  // namespace ls
