// The variants of the path tracer for the integrators `volpath` and `volpath_distant_mis` that also split the
// radiance of each sample into light components (Features::split).
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kSplitVariant = variant<kEverything>("everything, and light in parts");
const Variant kDistantSplitVariant = variant<kEverything, SegmentNee>("everything, and light in parts");

}  // namespace ls::render
