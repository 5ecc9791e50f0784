// The path tracer with Features::split. It takes long to compile, so it has its own source file.
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kSplitVariant = variant<kEverything>("everything, and light in parts");

}  // namespace ls::render
