// The opacity of shadows on shadow catchers (Shape::shadow_catcher), which adds to that of the AOVs alpha and
// opacity.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/image/aov/aov.h"
#include "core/image/film/film.h"

namespace ls {

// A shadow takes the share 1 - L/U of the light of a plate that reaches the camera, T. The AOV shadow_catcher
// has sums of T and, both times T, of the direct light on the catcher (L) and of what it would be without
// other shapes and media (U). The quotient is that of the sums, not a mean of quotients, which would be
// biased.
class CaughtShadows {
 public:
  // `tile` must outlive this.
  CaughtShadows(const TileAovs& tile, const AovPlanes& planes) : sums_(tile.sums.data()), count_(tile.spp) {
    n_ = static_cast<std::size_t>(tile.rect.pixels());
    while (first_ < planes.sums.size() && planes.sums[first_].aov != Aov::shadow_catcher) ++first_;
    any_ = first_ < planes.sums.size() && tile.spp > 0;
  }
  // True if shadows add to this AOV.
  bool add_to(Aov aov) const { return any_ && (aov == Aov::alpha || aov == Aov::opacity); }
  // The opacity of the shadows in a pixel.
  double opacity(std::size_t pixel) const {
    return share(sum(0, pixel) + sum(3, pixel), sum(1, pixel) + sum(4, pixel), sum(2, pixel) + sum(5, pixel),
                 static_cast<double>(count_));
  }
  // Half the difference between the opacities by each half of the samples.
  double difference(std::size_t pixel) const {
    const double half = static_cast<double>(count_) / 2;
    return (share(sum(0, pixel), sum(1, pixel), sum(2, pixel), half) -
            share(sum(3, pixel), sum(4, pixel), sum(5, pixel), half)) /
           2;
  }

 private:
  // Planes 0 to 2 are L, T and U of half A of the samples, 3 to 5 those of half B.
  double sum(std::size_t plane, std::size_t pixel) const { return sums_[(first_ + plane) * n_ + pixel]; }
  // In [0, 1], but for sums that no worker sends if it works as it should. Those give a number that is finite
  // as a float, also when it is added to another finite one.
  static double share(double light, double through, double unshadowed, double count) {
    constexpr double kMost = 0x1p64;
    const double opacity = through / count * (1 - light / unshadowed);
    // Not a number without light
    return unshadowed > 0 && !std::isnan(opacity) ? std::clamp(opacity, -kMost, kMost) : 0;
  }

  const double* sums_;
  std::uint64_t count_;
  std::size_t n_ = 0, first_ = 0;
  bool any_ = false;
};

}  // namespace ls
