// Numeric health of the rendered samples: the problems that occurred, how often, and where first. A Health
// without problems is empty and allocates nothing. It depends only on the samples: merging gives the same
// result in any order.
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

// The causes of bad health. A new cause needs an entry here and a row in health.cpp (without it the build
// fails). Causes are stored and sent by the names in these rows, so their order here may change.
enum class HealthCause : std::uint8_t {
  none,  // used for a good sample; a Health never contains it
  // Causes of rejected samples. A rejected sample is counted, contributes zero to the sums, and is not
  // replaced: it remains one of the pixel's N samples.
  unnamed,  // the sender named no cause, or a cause that is unknown here
  not_a_number,
  infinite,
  too_large,          // larger than float sums of 2^31 samples can represent
  too_many_surfaces,  // the path had more than 2^20 rays, or a shadow ray crossed more than 2^16 surfaces
  no_direction,
  nested_media,  // the path was inside more media at once than it can store
  // Causes of samples that are counted but kept, because rejecting them would bias the result.
  negative,
  // A density exceeded the bound (majorant) of its cell. Each occurrence counts.
  majorant_violation,
  // Values of the scene that were corrected. They are the same for all units (ranges of samples of one tile)
  // of a job, and have no pixel.
  negative_density,
  bright_albedo,
  negative_texel,
  reflectance,
  degenerate_triangle,
  end_,
};
enum class HealthEffect : std::uint8_t { rejected, kept, input };

HealthEffect effect_of(HealthCause cause);
std::string_view to_string(HealthCause cause);  // returns, for example, "too_large"
// Returns one sentence without a full stop: "3 samples were not a number (NaN); they count as zero".
std::string sentence(HealthCause cause, std::uint64_t count);

struct HealthLocation {
  int x = 0, y = 0;  // pixel of the image
  std::uint64_t sample = 0;
  bool operator==(const HealthLocation&) const = default;
  bool operator<(const HealthLocation& o) const {  // order: row by row, then by sample
    return y != o.y ? y < o.y : x != o.x ? x < o.x : sample < o.sample;
  }
};
inline constexpr std::size_t kHealthLocations = 8;  // at most this many locations are kept per cause

struct HealthEntry {
  std::uint64_t count = 0;
  std::vector<HealthLocation> first;  // the first locations in ascending order; empty for inputs
  bool operator==(const HealthEntry&) const = default;
};

struct Health {
  // Totals: `nonfinite` counts all rejected samples, the other two the cause of the same name.
  std::uint64_t nonfinite = 0, negative = 0, majorant_violations = 0;
  std::map<HealthCause, HealthEntry> causes;

  bool clean() const { return causes.empty(); }
  void add(HealthCause cause, std::uint64_t count);
  void add(HealthCause cause, std::uint64_t count, const HealthLocation& location);
  // Adds the health of other samples of the same job. Counts are added, except those of HealthEffect::input,
  // which are the same in both.
  void merge(const Health& other);
  bool operator==(const Health&) const = default;
};

// Returns {"too_large":{"count":3,"first":[[x,y,sample],...]}} with sorted keys and without spaces; {} if
// healthy.
std::string canonical_json(const Health& health);
// Parses a Health. Any text that canonical_json() does not write is an error; an unknown cause becomes
// `unnamed`.
Result<Health> parse_health(std::string_view json);

// Checks the health of a unit with these pixels and samples. invalid_argument: the health refers to pixels or
// samples outside the unit, or has more rejected samples than the unit has samples.
Result<void> check_health(const Health& health, const PixelRect& rect, const SampleRange& samples);

}  // namespace ls
