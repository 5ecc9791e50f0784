// The variants of the path tracer: each is the path tracer compiled for one set of features and one
// integrator. A scene is rendered with a variant that has all features that the scene needs.
#pragma once

#include <algorithm>
#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <span>

#include "worker/render/base/features.h"
#include "worker/render/integrator/path_tracer.h"
#include "worker/render/world/world.h"

namespace ls::render {

// Renders one sample. The parameters are the world, the pixel's x and y in the image, the sample's index, the
// light components (used only with Features::split) and the connections (only with Features::connected).
using SampleFn = SampleOutcome (*)(const World&, int, int, std::uint64_t, LightSplit*, Connections);

// Renders sample number `sample` of several pixels, at most kMostTogether. The paths share the light that
// they find, in groups of World::reuse pixels. `splits` has the light components of each pixel, or is empty.
inline constexpr std::size_t kMostTogether = 256;
struct PixelAt {
  int x, y;
};
using GroupFn = void (*)(const World&, std::span<const PixelAt>, std::uint64_t sample,
                         std::span<LightSplit> splits, std::span<SampleOutcome> outcomes);
struct Variant {
  Features covers;
  const char* name;
  SampleFn sample;
  GroupFn group = nullptr;  // with Features::reuse: instead of `sample`
};

inline CameraRay camera_ray(const World& w, const SampleStream& stream, int x, int y) {
  const Group g = stream.group(0, Purpose::camera);
  const double fx = x + .5 + w.filter.offset(g.u(0)), fy = y + .5 + w.filter.offset(g.u(1));
  return w.camera.ray(fx, fy, {g.u(2), g.u(3)});
}
template <Features F, template <Features> class Light>
SampleOutcome sample_with(const World& w, int x, int y, std::uint64_t sample, LightSplit* split,
                          Connections connections) {
  x += w.origin_x;
  y += w.origin_y;
  const SampleStream stream(w.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), sample);
  return PathTracer<F, Light>(w, stream, split, connections).trace(camera_ray(w, stream, x, y));
}

template <Features F, template <Features> class Light = VertexNee>
constexpr Variant variant(const char* name) {
  return {F, name, &sample_with<F, Light>};
}

template <Features F>
void group_with(const World& w, std::span<const PixelAt> pixels, std::uint64_t sample,
                std::span<LightSplit> splits, std::span<SampleOutcome> outcomes) {
  // Not arrays of optionals: the compiler would clear all of their bytes for each group
  boost::container::static_vector<PathTracer<F>, kMostTogether> paths;
  boost::container::static_vector<PathTracer<F>*, kMostTogether> sorted;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const int x = pixels[i].x + w.origin_x, y = pixels[i].y + w.origin_y;
    const SampleStream stream(w.seed, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), sample);
    paths.emplace_back(w, stream, splits.empty() ? nullptr : &splits[i]);
    (void)paths.back().trace(camera_ray(w, stream, x, y));
    sorted.push_back(&paths.back());
  }
  PathTracer<F>::sort_to_share(sorted);
  const auto group = static_cast<std::size_t>(w.reuse);
  for (std::size_t i = 0; i < sorted.size(); i += group)
    PathTracer<F>::share({sorted.data() + i, std::min(group, sorted.size() - i)});
  for (std::size_t i = 0; i < pixels.size(); ++i) outcomes[i] = paths[i].outcome();
}
template <Features F>
constexpr Variant group_variant(const char* name) {
  return {F, name, nullptr, &group_with<F>};
}

// The variants of the integrator `volpath` with Features::aimed, cheapest first; the last one has the
// features of every scene.
std::span<const Variant> aimed_variants();
// The variants of the integrator `volpath` with Features::connected, cheapest first. They support only grey
// media that neither overlap nor emit light.
std::span<const Variant> connected_variants();
// The variants of the integrator `volpath_distant_mis`, cheapest first; the last one has the features of
// every scene.
std::span<const Variant> distant_variants();
// The variants in which paths of several pixels share their tails, cheapest first. They support only
// homogeneous media that neither overlap nor emit light.
std::span<const Variant> reuse_variants();
// The variants of the integrator `whitted`, which ignores media, cheapest first.
std::span<const Variant> whitted_variants();
// The variants that also compute light components: one for each list of variants above, and kSplitVariant for
// `volpath` without the features of these lists. Each has all features that its list supports.
extern const Variant kSplitVariant, kAimedSplitVariant, kDistantSplitVariant, kConnectedSplitVariant,
    kReuseSplitVariant, kWhittedSplitVariant;

}  // namespace ls::render
