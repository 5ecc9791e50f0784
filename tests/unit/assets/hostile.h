// Calls a decoder with every truncation of a file and with many random mutations of it. The decoder must
// return a value, or an error that names the file.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls::test {

inline std::span<const std::byte> bytes_of(const std::string& s) {
  return std::as_bytes(std::span(s.data(), s.size()));
}
template <class T>
void append(std::string& to, const T& v) {
  to.append(reinterpret_cast<const char*>(&v), sizeof v);
}

// Returns the number of truncations that the decoder accepted.
template <class Decode>
int accepted_truncations(const std::string& file, Decode decode) {
  int accepted = 0;
  for (std::size_t n = 0; n < file.size(); ++n) {
    // A copy, so that AddressSanitizer finds a read past its end.
    const std::string cut = file.substr(0, n);
    const auto result = decode("cut.file", std::span(bytes_of(cut)));
    accepted += result.has_value();
    if (!result) {
      EXPECT_NE(result.error().message.find("cut.file"), std::string::npos) << result.error().message;
    }
  }
  return accepted;
}

// Decodes `rounds` mutations of the file, and calls `check` with each decoded value.
template <class Decode, class Check>
void survive_mutations(const std::string& file, Decode decode, Check check, int rounds = 3000) {
  std::mt19937 rng(7);
  for (int i = 0; i < rounds; ++i) {
    std::string m = file;
    const int edits = 1 + static_cast<int>(rng() % 4);
    for (int e = 0; e < edits; ++e) {
      const std::size_t at = rng() % m.size();
      switch (rng() % 4) {
        case 0:
          m[at] = static_cast<char>(rng());
          break;
        case 1:
          m[at] = static_cast<char>(m[at] ^ (1 << rng() % 8));
          break;
        case 2:
          m.erase(at, 1 + rng() % 4);
          break;
        default:
          m.insert(at, 1 + rng() % 4, static_cast<char>(rng() % 2 ? 0xff : '9'));
      }
      if (m.empty()) m = "x";
    }
    if (const auto result = decode("mutant", std::span(bytes_of(m)))) check(*result);
  }
}

}  // namespace ls::test
