// CHECK(cond, fmt, args...): a violated condition is a programming error and ends the process with a message
// that names the values. Active in release builds. Not for bad input, which yields an Error.
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
