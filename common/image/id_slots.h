// Which things a pixel shows, and in how many of its samples: a fixed number of slots (identifier, count),
// and how many samples fell out of them. An identifier is a float as Cryptomatte makes it of a name: normal,
// never 0. A set of slots is written in one way only: by count, the largest first, then by the bits of the
// identifier; unused slots are 0, 0.
//
// Two sets add up to the slots of both, of which the largest stay; the others are counted in `more`. While
// the samples of a pixel show no more than kIdSlots things in all, every count is exact, whatever the order;
// beyond that a count may be too low by no more than `more`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ls {

inline constexpr int kIdSlots = 8;
inline constexpr std::size_t kIdPlanes = 2 * kIdSlots + 1;  // id, n of each slot; more

struct IdSlot {
  float id = 0;
  float n = 0;  // a whole number, at most 2^24
  bool operator==(const IdSlot&) const = default;
};
struct IdSlots {
  std::array<IdSlot, kIdSlots> slots{};
  float more = 0;
  bool operator==(const IdSlots&) const = default;
};

bool is_identifier(float id);

// Of the things that one unit saw in a pixel, in any order, each once.
IdSlots ranked(std::vector<IdSlot> seen);
IdSlots operator+(const IdSlots& a, const IdSlots& b);

// What is wrong with slots that `samples` samples are said to have given; empty if nothing.
std::string wrong_with(const IdSlots& slots, std::uint64_t samples);

// Between slots and kIdPlanes planes of `stride` floats each, at one pixel of them.
IdSlots load_slots(const float* planes, std::size_t stride);
void store_slots(const IdSlots& slots, float* planes, std::size_t stride);

}  // namespace ls
