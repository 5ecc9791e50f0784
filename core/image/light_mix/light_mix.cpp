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
  if (!mix.groups.empty() && aovs.has(Aov::shadow_catcher) && aovs.has(Aov::alpha))
    return fail(
        Errc::failed_precondition,
        "the image has shadow catchers: the shadows in its alpha are those of all lights as they are. "
        "Render the mix as a job of its own: lightshaft again ID --mix ...");
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

// Makes the interval [low, high] of `value` at least as wide, in proportion, as that of `of`.
void widen(double value, double& low, double& high, double of, double of_low, double of_high) {
  if (!(high > 0) || !(of > 0) || !(of_high > 0)) return;  // one of the intervals is unknown
  low = std::min(low, value * of_low / of);
  high = std::max(high, value * of_high / of);
}

}  // namespace

Film MixedError::mix(const Film& part, std::span<const GroupFactors> factors) {
  colour_.add(part.error());
  for (TileIndex t = 0; t < part.grid().count(); ++t) {
    if (part.spp(t) == 0) continue;
    const auto halves = part.half_means(t);
    const PixelRect rect = part.grid().rect(t);
    halves_.add(estimate_error({rect.width(), rect.height(), halves[0], halves[1]}, part.spp(t)));
  }
  Film mixed = part.mixed(factors);
  mixed_.add(mixed.error());
  return mixed;
}

ImageError MixedError::error() const {
  const ImageError colour = image_error(colour_), halves = image_error(halves_);
  ImageError error = image_error(mixed_);
  if (colour.trusted && halves.relmse > 0) {
    const double skew = colour.relmse / halves.relmse;
    for (double* figure : {&error.relmse, &error.relmse_lo, &error.relmse_hi}) *figure *= skew;
  }
  widen(error.relmse, error.relmse_lo, error.relmse_hi, colour.relmse, colour.relmse_lo, colour.relmse_hi);
  widen(error.rmse, error.rmse_lo, error.rmse_hi, colour.rmse, colour.rmse_lo, colour.rmse_hi);
  return error;
}

}  // namespace ls
