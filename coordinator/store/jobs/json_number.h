// Numbers in records. JSON has no infinity and no NaN: the library would write null, which could not be read
// back as a number. So finite() replaces them by 0.
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace ls::coordinator {

inline double finite(double value) { return std::isfinite(value) ? value : 0; }
// Older records have null for such a number.
inline double number_of(const nlohmann::json& j) { return j.is_null() ? 0 : j.get<double>(); }
// Throws for any value but an integer from 0 to 2^64 - 1. The library alone would convert 1e20, which does
// not fit.
inline std::uint64_t count_of(const nlohmann::json& j) {
  if (!j.is_number_unsigned()) throw std::invalid_argument("a count is not an integer from 0 to 2^64 - 1");
  return j.get<std::uint64_t>();
}

}  // namespace ls::coordinator
