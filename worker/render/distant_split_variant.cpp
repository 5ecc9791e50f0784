#include "worker/render/distant_mis.h"
#include "worker/render/variant.h"

namespace ls::render {

const Variant kDistantSplitVariant = variant<kEverything, SegmentLight>("everything, and light in parts");

}  // namespace ls::render
