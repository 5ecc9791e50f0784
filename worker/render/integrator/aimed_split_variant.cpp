// The variant of the path tracer with Features::aimed (light is sampled at several points of camera segments
// in media, or close to lamps) and Features::split (radiance is split into the components of the light AOVs).
#include "worker/render/integrator/segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kAimedSplitVariant =
    variant<kEverything.with(&Features::aimed), CameraSegmentNee>("everything, aimed, and light in parts");

}  // namespace ls::render
