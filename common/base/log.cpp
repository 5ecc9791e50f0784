#include "common/base/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace ls {
namespace {

spdlog::logger& logger() {
  static const auto instance = [] {
    auto l = spdlog::stderr_logger_mt("lightshaft");
    l->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %v");
    l->flush_on(spdlog::level::info);
    return l;
  }();
  return *instance;
}

void write(spdlog::level::level_enum level, std::string_view keys, std::string_view text) {
  if (keys.empty()) {
    logger().log(level, "{}", text);
  } else {
    logger().log(level, "{} {}", keys, text);
  }
}

}  // namespace

void log_level(LogLevel level) {
  static constexpr spdlog::level::level_enum kLevels[] = {
      spdlog::level::debug, spdlog::level::info, spdlog::level::warn, spdlog::level::err, spdlog::level::off};
  logger().set_level(kLevels[static_cast<int>(level)]);
}
void log_debug(std::string_view keys, std::string_view text) { write(spdlog::level::debug, keys, text); }
void log_info(std::string_view keys, std::string_view text) { write(spdlog::level::info, keys, text); }
void log_warn(std::string_view keys, std::string_view text) { write(spdlog::level::warn, keys, text); }
void log_error(std::string_view keys, std::string_view text) { write(spdlog::level::err, keys, text); }

}  // namespace ls
