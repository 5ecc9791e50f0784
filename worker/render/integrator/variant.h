// Renders one sample of a pixel with the path tracer variant that fits the scene's features and integrator.
#pragma once

#include <cstdint>
#include <span>

#include "worker/render/base/features.h"
#include "worker/render/integrator/path_tracer.h"
#include "worker/render/world/world.h"

namespace ls::render {

// The last parameter receives the light components if the variant has Features::split; ignored otherwise.
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

// Variants of `volpath_distant_mis`, cheapest first; the last covers every scene.
std::span<const Variant> distant_variants();
// Variants of `volpath` and `volpath_distant_mis` with light components; they cover every scene.
extern const Variant kSplitVariant, kDistantSplitVariant;

}  // namespace ls::render
