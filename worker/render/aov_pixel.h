// The AOVs of a pixel while its samples are rendered. What each is exactly: docs/reference/aovs.md.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/image/id_slots.h"
#include "worker/render/light_split.h"
#include "worker/render/path.h"
#include "worker/render/sampler.h"
#include "worker/render/world.h"

namespace ls::render {

// uv of a hit, whether or not the surface needs it for its look.
V2 uv_of(const Geometry& geometry, const SurfaceHit& hit);

class AovPixel {
 public:
  explicit AovPixel(const World& world);

  LightSplit* split() { return &split_; }  // of the sample that is rendered now
  void begin_pixel();
  void begin_sample() { split_.fill(C3(0)); }  // C3{} is not initialised
  // After the sample was rendered at the image's pixel (x, y); `usable`: its radiance counts.
  void end_sample(int x, int y, std::uint64_t sample, bool usable);
  // To the planes of planes_of(world.aovs), `pixels` floats each, at index i.
  void store(float* planes, std::size_t pixels, std::size_t i) const;

 private:
  using Sums = std::array<double, 3>;
  void add(Aov aov, double a, double b = 0, double c = 0);
  void add_light();
  void add_surface(const FirstSurface& first, const SampleStream& stream, const CameraRay& ray);
  void add_id(std::vector<IdSlot>& seen, float id);

  const World& world_;
  AovPlanes planes_;
  bool wants_surface_, wants_light_;
  LightSplit split_;
  std::array<Sums, kAovs> sums_{};
  double hits_ = 0;
  std::vector<IdSlot> shapes_, materials_;
};

}  // namespace ls::render
