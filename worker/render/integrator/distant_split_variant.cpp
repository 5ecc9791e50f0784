#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kDistantSplitVariant = variant<kEverything, SegmentNee>("everything, and light in parts");

}  // namespace ls::render
