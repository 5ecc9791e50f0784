// Numeric health of the rendered samples: which faults occurred, how often, and where first. Empty, without
// allocations, for a healthy job. Depends on the samples only: the result of merging does not depend on the
// order.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame/frame.h"
#include "common/image/frame/rounds.h"

namespace ls {

// To add a cause, add it here and a row in health.cpp (the compiler reports a missing one). Causes are stored
// and sent by the rows' names, so their order here is free.
enum class HealthCause : std::uint8_t {
  none,  // for a good sample; never in a Health
  // A rejected sample: counted, contributes zero, stays in N, is never drawn again.
  unnamed,  // the sender did not name the cause, or names one that is unknown here
  not_a_number,
  infinite,
  too_large,          // exceeds what float sums of 2^31 samples hold
  too_many_surfaces,  // path cut off
  no_direction,
  nested_media,  // inside more media at once than a path can store
  // Counted but kept, because rejecting them would bias the result.
  negative,
  majorant_violation,  // one per density above its bound
  // Scene inputs that were corrected; the same for all units of a job, and without a pixel.
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
// One sentence without a full stop: "3 samples were not a number (NaN); they count as zero".
std::string sentence(HealthCause cause, std::uint64_t count);

struct HealthLocation {
  int x = 0, y = 0;  // pixel of the image
  std::uint64_t sample = 0;
  bool operator==(const HealthLocation&) const = default;
  bool operator<(const HealthLocation& o) const {  // row by row, then by sample
    return y != o.y ? y < o.y : x != o.x ? x < o.x : sample < o.sample;
  }
};
inline constexpr std::size_t kHealthLocations = 8;  // kept per cause

struct HealthEntry {
  std::uint64_t count = 0;
  std::vector<HealthLocation> first;  // the smallest, in ascending order; empty for inputs
  bool operator==(const HealthEntry&) const = default;
};

struct Health {
  // Totals over the causes: of rejected samples, and of the two kinds that are kept.
  std::uint64_t nonfinite = 0, negative = 0, majorant_violations = 0;
  std::map<HealthCause, HealthEntry> causes;

  bool clean() const { return causes.empty(); }
  void add(HealthCause cause, std::uint64_t count);
  void add(HealthCause cause, std::uint64_t count, const HealthLocation& location);
  // Merges the health of other samples of the same job: counts add up, except those of inputs, which are the
  // same in both.
  void merge(const Health& other);
  bool operator==(const Health&) const = default;
};

// {"too_large":{"count":3,"first":[[x,y,sample],...]}}: keys sorted, no spaces; {} if healthy.
std::string canonical_json(const Health& health);
// Rejects anything that canonical_json does not write; an unknown cause becomes `unnamed`.
Result<Health> parse_health(std::string_view json);

// invalid_argument: it contains pixels, samples or more rejected samples than such a unit has.
Result<void> check_health(const Health& health, const PixelRect& rect, const SampleRange& samples);

}  // namespace ls
