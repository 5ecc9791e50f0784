// Access to an untrusted buffer. Every offset is checked; an access beyond the end throws Refused.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "worker/render/vdb/refused.h"

namespace ls::render {

static_assert(std::endian::native == std::endian::little);

class NvdbBytes {
 public:
  NvdbBytes(std::span<const std::byte> data, const char* what) : data_(data), what_(what) {}

  std::uint64_t size() const { return data_.size(); }
  // Returns the n bytes of the buffer from the offset `at` on.
  std::span<const std::byte> part(std::uint64_t at, std::uint64_t n) const {
    if (at > data_.size() || n > data_.size() - at)
      throw Refused{1, "not a readable NanoVDB file: damaged, or cut short: " + std::string(what_) + " of " +
                           std::to_string(data_.size()) + " bytes, of which " + std::to_string(n) +
                           " are wanted from byte " + std::to_string(at) + " on"};
    return data_.subspan(at, n);
  }
  template <class T>
  T get(std::uint64_t at) const {
    T v;
    std::memcpy(&v, part(at, sizeof v).data(), sizeof v);
    return v;
  }
  bool bit(std::uint64_t mask, std::uint32_t i) const {
    return std::to_integer<unsigned>(part(mask + i / 8, 1)[0]) >> i % 8 & 1;
  }

 private:
  std::span<const std::byte> data_;
  const char* what_;
};

}  // namespace ls::render
