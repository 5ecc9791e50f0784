// The variants of the path tracer for the integrator `volpath_distant_mis` (segment_nee.h).
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

std::span<const Variant> distant_variants() {
  static const Variant kVariants[] = {
      variant<Features{}>("surfaces"),
      variant<Features{.passing = true}>("surfaces that light passes"),
      variant<Features{.media = true, .passing = true}, SegmentNee>("homogeneous grey media"),
      variant<Features{.media = true, .grids = true, .passing = true}, SegmentNee>("grey grids"),
      variant<kEveryScene, SegmentNee>("everything"),
      variant<kEveryScene.with(&Features::phases), SegmentNee>("everything, any phase function"),
      variant<kAnyMedia, SegmentNee>("everything, fog that falls with height"),
      kDistantSplitVariant,
  };
  return kVariants;
}

}  // namespace ls::render
