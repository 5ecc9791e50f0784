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

ImageError mixed_error(const TileError& mixed, const ImageError& colour) {
  ImageError error = image_error(mixed);
  const auto widen = [](double value, double& low, double& high, double of, double of_low, double of_high) {
    if (!(of > 0) || !(of_high > 0)) return;
    low = std::min(low, value * of_low / of);
    high = std::max(high, value * of_high / of);
  };
  widen(error.relmse, error.relmse_lo, error.relmse_hi, colour.relmse, colour.relmse_lo, colour.relmse_hi);
  widen(error.rmse, error.rmse_lo, error.rmse_hi, colour.rmse, colour.rmse_lo, colour.rmse_hi);
  return error;
}

}  // namespace ls
