// CHECK(cond, fmt, args...) is for programming errors: a violated condition ends the process with a message
// that contains the values. It is active in release builds. Bad input must yield an Error instead.
#pragma once

#include <fmt/format.h>

#include <string>

namespace ls {
[[noreturn]] void check_failed(const char* condition, const char* file, int line, const std::string& message);
}  // namespace ls

#define CHECK(cond, ...)                                                            \
  do {                                                                              \
    if (!(cond)) [[unlikely]]                                                       \
      ::ls::check_failed(#cond, __FILE__, __LINE__, ::fmt::format("" __VA_ARGS__)); \
  } while (false)
