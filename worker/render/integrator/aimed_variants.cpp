// The path tracers with Features::aimed. They take long to compile, so they have their own source file.
#include "worker/render/integrator/camera_segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

std::span<const Variant> aimed_variants() {
  static constexpr Features kEverything = [] {
    Features all = kEveryScene;
    all.aimed = true;
    return all;
  }();
  static constexpr Variant kVariants[] = {
      variant<Features{.media = true, .passing = true, .aimed = true}, CameraSegmentNee>(
          "homogeneous grey media, aimed"),
      variant<Features{.media = true, .grids = true, .passing = true, .aimed = true}, CameraSegmentNee>(
          "grey grids, aimed"),
      variant<kEverything, CameraSegmentNee>("everything, aimed"),
  };
  static_assert(std::end(kVariants)[-1].covers == kEverything);
  return kVariants;
}

}  // namespace ls::render
