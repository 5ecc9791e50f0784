// The path tracers of `volpath_distant_mis`. They take long to compile, so they have their own source file.
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

std::span<const Variant> distant_variants() {
  static constexpr Variant kVariants[] = {
      variant<Features{}>("surfaces"),
      variant<Features{.passing = true}>("surfaces that light passes"),
      variant<Features{.media = true, .passing = true}, SegmentNee>("homogeneous grey media"),
      variant<Features{.media = true, .grids = true, .passing = true}, SegmentNee>("grey grids"),
      variant<kEveryScene, SegmentNee>("everything"),
  };
  static_assert(std::end(kVariants)[-1].covers == kEveryScene);
  return kVariants;
}

}  // namespace ls::render
