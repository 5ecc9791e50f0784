// The numeric health of what was rendered: what went wrong, how often, and where first. All zero and without
// memory of its own on a healthy job. A function of the samples alone: merged in any order it is the same.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame.h"
#include "common/image/rounds.h"

namespace ls {

// To add one: here, and its row in health.cpp (the compiler asks for it). The words of the rows are what is
// stored and sent, so their order here is free.
enum class HealthCause : std::uint8_t {
  none,  // of a sample that is right; never in a Health
  // A sample that is rejected: counted, contributing zero, staying in N, never drawn again.
  unnamed,  // said by a program that did not say which, or knows one that we don't
  not_a_number,
  infinite,
  too_large,          // above what float sums of 2^31 samples hold
  too_many_surfaces,  // cut off
  no_direction,
  nested_media,  // inside of more media at once than a path remembers
  // Counted, but kept: to leave them out would bias.
  negative,
  majorant_violation,  // one for each density met above its bound
  // Inputs of the scene that were changed; the same for all units of a job, and of no pixel.
  negative_density,
  bright_albedo,
  negative_texel,
  reflectance,
  degenerate_triangle,
  end_,
};
enum class HealthEffect : std::uint8_t { rejected, kept, input };

HealthEffect effect_of(HealthCause cause);
std::string_view to_string(HealthCause cause);  // "too_large"
// One sentence without its full stop: "3 samples were not a number (NaN); they count as zero".
std::string sentence(HealthCause cause, std::uint64_t count);

struct HealthSpot {
  int x = 0, y = 0;  // pixel of the image
  std::uint64_t sample = 0;
  bool operator==(const HealthSpot&) const = default;
  bool operator<(const HealthSpot& o) const {  // row by row, then by sample
    return y != o.y ? y < o.y : x != o.x ? x < o.x : sample < o.sample;
  }
};
inline constexpr std::size_t kHealthSpots = 8;  // that are kept of each cause

struct HealthEntry {
  std::uint64_t count = 0;
  std::vector<HealthSpot> first;  // the smallest, ascending; none of an input
  bool operator==(const HealthEntry&) const = default;
};

struct Health {
  // Totals over the causes: of rejected samples, and of the two that are kept.
  std::uint64_t nonfinite = 0, negative = 0, majorant_violations = 0;
  std::map<HealthCause, HealthEntry> causes;

  bool clean() const { return causes.empty(); }
  void add(HealthCause cause, std::uint64_t count);
  void add(HealthCause cause, std::uint64_t count, const HealthSpot& spot);
  // Of other samples of the same job: counts add up, those of inputs are one and the same.
  void merge(const Health& other);
  bool operator==(const Health&) const = default;
};

// {"too_large":{"count":3,"first":[[x,y,sample],...]}}: keys sorted, no spaces; {} if all is well.
std::string canonical_json(const Health& health);
// Refuses what canonical_json does not write; an unknown cause becomes `unnamed`.
Result<Health> parse_health(std::string_view json);

// invalid_argument: it tells of pixels, samples or more rejected samples than such a unit has.
Result<void> check_health(const Health& health, const PixelRect& rect, const SampleRange& samples);

}  // namespace ls
