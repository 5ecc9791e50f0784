// The path tracer with Features::aimed and Features::split. It takes long to compile, so it has its own
// source file.
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
