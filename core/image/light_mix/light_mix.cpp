#include "core/image/light_mix/light_mix.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace ls {

Result<std::vector<GroupFactors>> factors_of(const LightMix& mix, AovSet aovs,
                                             std::span<const std::string> groups) {
  if (!aovs.has(Aov::light_groups))
    return fail(Errc::failed_precondition,
                "the image has no light groups: render it with --aov light_groups to mix them");
  std::vector<GroupFactors> out(groups.size());
  for (const auto& [group, of] : mix.groups) {
    const auto at = std::ranges::find(groups, group);
    if (at == groups.end())
      return bad_argument(
          fmt::format("the image has no light group \"{}\"; it has {}", group, fmt::join(groups, ", ")));
    if (of.surface != of.volume && !aovs.has(Aov::volume_light_groups))
      return fail(Errc::failed_precondition,
                  "the image does not have the light of media apart: render it with --aov "
                  "volume_light_groups to mix them");
    out[static_cast<std::size_t>(at - groups.begin())] = of;
  }
  return out;
}

namespace {

// The error of the film's colour, estimated from its halves alone.
ImageError error_of_halves(const Film& film) {
  TileError sums;
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (film.spp(t) == 0) continue;
    const auto halves = film.half_means(t);
    const PixelRect rect = film.grid().rect(t);
    sums.add(estimate_error({rect.width(), rect.height(), halves[0], halves[1]}, film.spp(t)));
  }
  return image_error(sums);
}

// Makes the interval [low, high] of `value` at least as wide, in proportion, as that of `of`.
void widen(double value, double& low, double& high, double of, double of_low, double of_high) {
  if (!(of > 0) || !(of_high > 0)) return;
  low = std::min(low, value * of_low / of);
  high = std::max(high, value * of_high / of);
}

}  // namespace

ImageError mixed_error(const Film& film, const TileError& mixed) {
  const ImageError colour = image_error(film.error()), halves = error_of_halves(film);
  ImageError error = image_error(mixed);
  if (colour.relmse > 0 && halves.relmse > 0) {
    const double skew = colour.relmse / halves.relmse;
    for (double* figure : {&error.relmse, &error.relmse_lo, &error.relmse_hi}) *figure *= skew;
  }
  widen(error.relmse, error.relmse_lo, error.relmse_hi, colour.relmse, colour.relmse_lo, colour.relmse_hi);
  widen(error.rmse, error.rmse_lo, error.rmse_hi, colour.rmse, colour.rmse_lo, colour.rmse_hi);
  return error;
}

}  // namespace ls
