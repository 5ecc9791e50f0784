// A separate source file, because instantiating the path tracer takes long to compile.
#include "worker/render/integrator/camera_segment_nee.h"
#include "worker/render/integrator/variant.h"

namespace ls::render {
namespace {

constexpr Features kAimedEverything = [] {
  Features all = kEverything;
  all.aimed = true;
  return all;
}();

}  // namespace

const Variant kAimedSplitVariant =
    variant<kAimedEverything, CameraSegmentNee>("everything, aimed, and light in parts");

}  // namespace ls::render
