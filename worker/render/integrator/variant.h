// The variants of the path tracer: the path tracer compiled for one set of features and one integrator each.
// A scene is rendered with a variant that has the features it needs.
#pragma once

#include <cstdint>
#include <span>

#include "worker/render/base/features.h"
#include "worker/render/integrator/path_tracer.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Renders one sample: the parameters are the world, the pixel's x and y in the image, and the sample's index.
// If the variant has Features::split, the last parameter receives the light components; otherwise it is
// ignored.
using SampleFn = SampleOutcome (*)(const World&, int, int, std::uint64_t, LightSplit*);
struct Variant {
  Features covers;
  const char* name;
  SampleFn sample;
};

inline CameraRay camera_ray(const World& w, const SampleStream& stream, int x, int y) {
  const Group g = stream.group(0, Purpose::camera);
  const double fx = x + .5 + w.filter.offset(g.u(0)), fy = y + .5 + w.filter.offset(g.u(1));
  return w.camera.ray(fx, fy, {g.u(2), g.u(3)});
}
template <Features F, template <Features> class Light>
SampleOutcome sample_with(const World& w, int x, int y, std::uint64_t sample, LightSplit* split) {
  if constexpr (!kBuiltFeatures.covers(F))
    return {.cut_off = HealthCause::unnamed};  // build_world refuses such scenes
  x += w.origin_x;
  y += w.origin_y;
  const SampleStream stream(w.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), sample);
  return PathTracer<F, Light>(w, stream, split).trace(camera_ray(w, stream, x, y));
}

template <Features F, template <Features> class Light = VertexNee>
constexpr Variant variant(const char* name) {
  return {F, name, &sample_with<F, Light>};
}

// The variants of the integrator `volpath` with Features::aimed, cheapest first; the last one has the
// features of every scene.
std::span<const Variant> aimed_variants();
// The variants of the integrator `volpath_distant_mis`, cheapest first; the last one has the features of
// every scene.
std::span<const Variant> distant_variants();
// The variants of the integrators `volpath` (without and with Features::aimed) and `volpath_distant_mis` that
// also compute light components. Each has all other features.
extern const Variant kSplitVariant, kAimedSplitVariant, kDistantSplitVariant;

}  // namespace ls::render
