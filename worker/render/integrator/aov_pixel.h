// Accumulates the AOVs (auxiliary images, such as depth or albedo) of a pixel while its samples are rendered.
// docs/reference/aovs.md defines them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image/aov/deep_planes.h"
#include "core/image/aov/identifiers.h"
#include "worker/render/integrator/deep_edges.h"
#include "worker/render/integrator/path_tracer.h"
#include "worker/render/math/sampler.h"
#include "worker/render/world/world.h"

namespace ls::render {

class AovPixel {
 public:
  explicit AovPixel(const World& world);

  LightSplit* split() { return &split_; }  // light components of the current sample
  void begin_pixel(int x, int y);
  void begin_sample() { split_.clear(world_.aovs.groups()); }
  // Call after sample number `sample` of the image's pixel (x, y) has been rendered. `usable` is true if the
  // radiance of the sample counts.
  void end_sample(int x, int y, std::uint64_t sample, bool usable);
  // Writes the pixel's values to index i of each plane in `planes`. The planes of `pixels` floats each follow
  // one another in the order of planes_of(world.aovs).
  void store(float* planes, std::size_t pixels, std::size_t i) const;

 private:
  using Sums = std::array<double, 3>;
  void add(Aov aov, const V3d& v, std::size_t half = 0);
  void add_light(std::size_t half);
  void add_surface(const FirstSurface& first, const SampleStream& stream, const CameraRay& ray);
  void add_guide(const CameraRay& ray, const SampleStream& stream, std::size_t half);
  void add_opacity(const CameraRay& ray, const SampleStream& stream, std::size_t half);
  void add_slices();
  void add_id(std::vector<IdSlot>& seen, float id);

  const World& world_;
  AovPlanes planes_;
  bool wants_surface_, wants_light_, wants_guide_, wants_opacity_;
  LightSplit split_;
  // Sums over the samples. For AOVs with halves, [0] is the sum over the even samples and [1] that over the
  // odd ones; for other AOVs, [0] is the sum over all samples.
  std::array<std::array<Sums, kAovs>, 2> sums_{};
  // Sums of light_groups [0] and volume_light_groups [1], by half and group
  std::array<std::array<std::vector<Sums>, 2>, 2> group_sums_;
  double hits_ = 0;
  // With a deep image: the edges of the pixel's slices, and by record (DeepPlanes) the sums of light and
  // transmittance. `through_` is that of the current sample.
  DeepPlanes slices_;
  DeepEdges edges_;
  std::vector<Sums> slice_light_;
  std::vector<double> slice_through_, through_;
  std::vector<IdSlot> shapes_, materials_;
};

}  // namespace ls::render
