// Fuzz targets: each takes any bytes that a stranger may send and must come back, without a fault of memory
// or of arithmetic (sanitizers) and with what it promises kept (must()). The same functions run under
// libFuzzer (preset `fuzz`, tests/fuzz/run.sh) and, over seeds and every finding of the past, as a unit test
// of every build (replay_test.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls::fuzz {

using Bytes = std::span<const std::uint8_t>;

struct Target {
  const char* name;
  void (*run)(Bytes input);
  std::vector<std::string> (
      *seeds)();  // inputs that reach far, made by our own writers where they are binary
};
std::span<const Target> targets();

inline std::string_view text_of(Bytes b) { return {reinterpret_cast<const char*>(b.data()), b.size()}; }
inline std::span<const std::byte> bytes_of(Bytes b) { return std::as_bytes(b); }
inline Bytes input_of(std::string_view s) {
  return {reinterpret_cast<const std::uint8_t*>(s.data()), s.size()};
}

// Ends the process with the text if the promise is broken: a finding.
void must(bool kept, std::string_view promise);

// The input cut into parts: each begins with its length, two bytes, little endian; the last takes what is
// left.
std::vector<Bytes> parts_of(Bytes input, std::size_t most);
std::string with_length(std::string_view part);

// Many inputs in one file: the size of all, four bytes, little endian, and then by zlib each after its
// length, likewise. Of a file that is no such there is none.
std::string packed(const std::vector<std::string>& inputs);
std::vector<std::string> unpacked(std::string_view pack);

}  // namespace ls::fuzz
