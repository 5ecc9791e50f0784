// A separate source file, because instantiating the path tracer takes long to compile.
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kSplitVariant = variant<kEverything>("everything, and light in parts");

}  // namespace ls::render
