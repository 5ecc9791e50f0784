// Sources of their own: instantiating the path tracer takes the compiler long.
#include "worker/render/variant.h"

namespace ls::render {

const Variant kSplitVariant = variant<kEverything>("everything, and light in parts");

}  // namespace ls::render
