// Numeric health of the rendered samples: which problems occurred, how often, and at which pixels and samples
// first. Problems are found in each unit and merged into the health of the job. The result depends only on
// the samples, not on the order of merging. A Health without problems is empty and allocates nothing.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/image/frame/frame.h"
#include "core/image/frame/rounds.h"

namespace ls {

// The causes of bad health. A new cause needs an entry here and a row in health.cpp; if the row is missing,
// the build fails. Causes are stored and sent by their names in health.cpp, so the order here may change.
enum class HealthCause : std::uint8_t {
  none,  // used for a good sample; a Health never contains it
  // Causes of rejected samples. A rejected sample is counted, contributes zero to the sums, and is not
  // replaced: it remains one of the pixel's N samples.
  unnamed,  // the sender gave no cause, or one that this version of the program does not know
  not_a_number,
  infinite,
  // The value exceeds 2^96. Up to this limit the float sum of 2^31 samples cannot overflow.
  too_large,
  too_many_surfaces,  // the path had more than 2^20 rays, or a shadow ray crossed more than 2^16 surfaces
  no_direction,
  nested_media,  // the path was inside more media at once than it can store
  // Causes of samples that are counted but kept, because rejecting them would bias the result.
  negative,
  // The density of a medium exceeded the upper bound (majorant) of its grid cell. Each occurrence is counted,
  // so one sample may count several times.
  majorant_violation,
  // Corrected input values: values in the scene or its files that were invalid and were replaced. Their
  // number is the same for all units of a job, and they belong to no pixel.
  negative_density,
  bright_albedo,
  negative_texel,
  reflectance,
  degenerate_triangle,
  wrong_texture_coordinates,
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
inline constexpr std::size_t kHealthLocations = 8;  // maximum number of locations kept per cause

struct HealthEntry {
  std::uint64_t count = 0;
  // The first kHealthLocations locations, in ascending order; empty for corrected input values.
  std::vector<HealthLocation> first;
  bool operator==(const HealthEntry&) const = default;
};

struct Health {
  // Totals: `nonfinite` is the number of rejected samples of all causes together, `negative` the count of
  // HealthCause::negative, and `majorant_violations` that of HealthCause::majorant_violation.
  std::uint64_t nonfinite = 0, negative = 0, majorant_violations = 0;
  std::map<HealthCause, HealthEntry> causes;

  bool clean() const { return causes.empty(); }
  void add(HealthCause cause, std::uint64_t count);
  void add(HealthCause cause, std::uint64_t count, const HealthLocation& location);
  // Adds the health of other samples of the same job. Counts are added, except the counts of corrected input
  // values (HealthEffect::input): every unit reports the same number of them, so the larger count is kept.
  void merge(const Health& other);
  bool operator==(const Health&) const = default;
};

// Returns {"too_large":{"count":3,"first":[[x,y,sample],...]}} with sorted keys and without spaces; {} if
// healthy.
std::string canonical_json(const Health& health);
// Parses the JSON of a Health. A cause that this version does not know becomes `unnamed`. Errors: a text that
// is not such an object or is longer than 64 KiB; more than 64 causes; more than kHealthLocations locations
// of a cause, or locations that do not ascend.
Result<Health> parse_health(std::string_view json);

// Checks the health of the unit with the pixels `rect` and the samples `samples`. invalid_argument: a
// location is outside the unit, or there are more rejected or more negative samples than the unit has
// samples.
Result<void> check_health(const Health& health, const PixelRect& rect, const SampleRange& samples);

}  // namespace ls
