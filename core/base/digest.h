// SHA-256 digests. They identify blobs (files that jobs use), scenes, settings, units and pixels.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/error.h"

namespace ls {

std::string to_hex(std::span<const std::uint8_t> bytes);  // returns lower-case hexadecimal digits
// Fills `bytes` from `text`, which must have exactly two lower-case hexadecimal digits per byte. Returns
// false if it is anything else.
bool read_hex(std::string_view text, std::span<std::uint8_t> bytes);

struct Digest {
  std::array<std::uint8_t, 32> bytes{};

  std::string hex() const { return to_hex(bytes); }
  // Returns nullopt unless `hex` is exactly 64 lower-case digits.
  static std::optional<Digest> parse(std::string_view hex);
  auto operator<=>(const Digest&) const = default;
};

// Incremental SHA-256. finish() may be called only once.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void update(std::span<const std::byte> data);
  void update(std::string_view text);
  Digest finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Digest sha256(std::string_view text);
Digest sha256(std::span<const std::byte> data);
Result<Digest> sha256_file(const std::filesystem::path& path);

}  // namespace ls

template <>
struct std::hash<ls::Digest> {
  std::size_t operator()(const ls::Digest& d) const noexcept {
    std::size_t h = 0;
    std::memcpy(&h, d.bytes.data(), sizeof h);
    return h;
  }
};
