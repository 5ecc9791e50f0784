// A source of its own: instantiating the path tracer takes the compiler long.
#include "worker/render/distant_mis.h"
#include "worker/render/variant.h"

namespace ls::render {

std::span<const Variant> distant_variants() {
  static constexpr Variant kVariants[] = {
      variant<Features{}>("surfaces"),
      variant<Features{.passing = true}>("surfaces that light passes"),
      variant<Features{.media = true, .passing = true}, SegmentLight>("homogeneous grey media"),
      variant<Features{.media = true, .grids = true, .passing = true}, SegmentLight>("grey grids"),
      variant<kEveryScene, SegmentLight>("everything"),
  };
  static_assert(std::end(kVariants)[-1].covers == kEveryScene);
  return kVariants;
}

}  // namespace ls::render
