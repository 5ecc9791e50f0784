// Tables by which a random word of 32 bits chooses one of several lights. Light i is chosen by the words from
// last[i - 1] + 1 to last[i], so its probability is exactly their share of the 2^32 words.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace ls::render {

// A light, and the probability with which it was chosen
struct DrawnLight {
  std::uint32_t light = 0;
  float probability = 0;
};

// Adds to `last` a table of lights with these probabilities, whose sum is 1. Each must be at least 2^-31, and
// each light gets at least one word.
inline void append_light_table(std::span<const double> probabilities, std::vector<std::uint32_t>& last) {
  double sum = 0;
  std::uint64_t before = 0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    sum += probabilities[i];
    const bool is_last = i + 1 == probabilities.size();
    const std::uint64_t edge =
        is_last ? std::uint64_t{1} << 32
                : std::max(before + 1, static_cast<std::uint64_t>(std::llround(sum * 0x1p32)));
    last.push_back(static_cast<std::uint32_t>(edge - 1));
    before = edge;
  }
}

inline std::uint32_t light_of_word(std::span<const std::uint32_t> last, std::uint32_t word) {
  return static_cast<std::uint32_t>(std::lower_bound(last.begin(), last.end() - 1, word) - last.begin());
}

inline float probability_of_words(std::uint64_t words) {
  return static_cast<float>(static_cast<double>(words) * 0x1p-32);
}

inline float probability_in_table(std::span<const std::uint32_t> last, std::uint32_t light) {
  const std::uint64_t before = light == 0 ? 0 : std::uint64_t{last[light - 1]} + 1;
  return probability_of_words(std::uint64_t{last[light]} + 1 - before);
}

}  // namespace ls::render
