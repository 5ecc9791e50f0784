// The values that the meters of a job have measured, with intervals, from the job's film.
//
// A meter's block (core/image/frame/meter_blocks.h) has n = 256 pixels, which are independent and have the
// same distribution. Its value is the mean of the pixels' means. Whatever low-discrepancy points gain within
// a pixel, the variance of the pixels' means shows it: the standard error of the value is s / sqrt(n), where
// s^2 is their variance, and Student's t with n - 1 degrees of freedom gives the interval, per colour channel
// and for the luminance.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/film/film.h"
#include "core/job/meter_group.h"

namespace ls::coordinator {

struct MeterValue {
  std::string name;
  MeterKind kind = MeterKind::irradiance;
  std::array<double, 3> value{}, half_width{};  // half the width of the 95 % interval
  double luminance = 0, luminance_half_width = 0;
  std::uint64_t samples = 0;
  bool lit = false;  // false: no sample has found light. The value is then 0, and the interval is unknown
  // False if few pixels carry the variance: rare bright samples may be missing, and the interval may be too
  // narrow.
  bool trusted = false;
};
// `groups` may be empty; then there are no values.
std::vector<MeterValue> meter_values(const Film& film, std::span<const MeterGroup> groups);

std::string_view unit_of(MeterKind kind);  // if lengths of the scene are in metres
// Returns a JSON list, with an object for each value.
std::string meters_json(std::span<const MeterValue> values);

}  // namespace ls::coordinator
