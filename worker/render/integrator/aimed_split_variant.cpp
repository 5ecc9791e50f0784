// A separate source file, because instantiating the path tracer takes long to compile.
#include "worker/render/integrator/camera_segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {

const Variant kAimedSplitVariant = variant<
    [] {
      Features all = kEverything;
      all.aimed = true;
      return all;
    }(),
    CameraSegmentNee>("everything, aimed, and light in parts");

}  // namespace ls::render
