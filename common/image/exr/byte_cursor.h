// Reads little-endian values from bytes in order, never past the end.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>

namespace ls {

static_assert(std::endian::native == std::endian::little);

class ByteCursor {
 public:
  explicit ByteCursor(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::size_t position() const { return position_; }
  std::size_t left() const { return bytes_.size() - position_; }

  std::optional<std::span<const std::byte>> take(std::size_t n) {
    if (n > left()) return std::nullopt;
    position_ += n;
    return bytes_.subspan(position_ - n, n);
  }
  template <class T>
  std::optional<T> value() {
    const auto raw = take(sizeof(T));
    if (!raw) return std::nullopt;
    T v;
    std::memcpy(&v, raw->data(), sizeof(T));
    return v;
  }
  // Reads a zero-terminated text of at most `longest` characters.
  std::optional<std::string_view> name(std::size_t longest) {
    if (left() == 0) return std::nullopt;
    const auto* begin = reinterpret_cast<const char*>(bytes_.data() + position_);
    const void* end = std::memchr(begin, 0, std::min(left(), longest + 1));
    if (!end) return std::nullopt;
    const auto length = static_cast<std::size_t>(static_cast<const char*>(end) - begin);
    position_ += length + 1;
    return std::string_view(begin, length);
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
};

}  // namespace ls
