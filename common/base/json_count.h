// Counts in JSON that was not written in this process.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace ls {

// Throws for anything but an integer from 0 to 2^64 - 1: the library would convert 1e20, which no integer can hold.
inline std::uint64_t count_of(const nlohmann::json& j) {
  if (!j.is_number_unsigned()) throw std::invalid_argument("a count is not an integer from 0 to 2^64 - 1");
  return j.get<std::uint64_t>();
}

}  // namespace ls
