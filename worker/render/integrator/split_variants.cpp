// The path tracers with Features::split of the integrators `volpath` and `volpath_distant_mis`.
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kSplitVariant = variant<kEverything>("everything, and light in parts");
const Variant kDistantSplitVariant = variant<kEverything, SegmentNee>("everything, and light in parts");

}  // namespace ls::render
