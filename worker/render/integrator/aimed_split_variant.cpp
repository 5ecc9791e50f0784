// The path tracer with Features::aimed and Features::split.
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kAimedSplitVariant =
    variant<kEverything.with(&Features::aimed), CameraSegmentNee>("everything, aimed, and light in parts");

}  // namespace ls::render
