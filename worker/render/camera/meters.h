// Meters: what a scene has instead of a camera if it measures numbers. Each meter has a block of pixels
// (core/image/frame/meter_blocks.h).
//
// The irradiance at a point is pi times the radiance of a white diffuse plate there, since such a plate has
// the radiance E / pi. So the paths of meters begin at a plate, of which no other path knows: at its point
// they are scattered by the plate's BSDF, and next-event estimation, multiple importance sampling and
// roulette act as on any surface; lights without extent are found, too. The flux of a shape of area A is A
// times its mean irradiance. Let c be the cosine of a direction to the normal of a plate, 0 behind the plate.
// The mean of c over all normals is 1/4, so the integral of the radiance over all directions is 4 times the
// mean irradiance of plates with uniform normals, that is, 4 pi times their mean radiance.
#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "core/image/frame/meter_blocks.h"
#include "worker/render/lights/area.h"
#include "worker/render/media/medium_stack.h"

namespace ls::render {

// A shape whose surface is sampled uniformly by area.
class MeteredShape {
 public:
  // `plate`: any texture of the world; it has no effect.
  MeteredShape(const Scene& scene, std::uint32_t shape, TextureIndex plate,
               const SurfacePrimitives& primitives, const LightWorld& world);
  double area() const { return area_; }               // in world units
  std::uint32_t surface() const { return surface_; }  // index into Geometry::surfaces
  float reach() const { return reach_; }              // as SurfaceHit::reach, for all points
  // Returns a point and the normal there, for uniform random numbers.
  AreaPoint point(const LightWorld& world, const LightNumbers& numbers) const;

 private:
  std::variant<ParallelogramLight, MeshLight, SphereLight, DiskLight, CylinderLight> sampler_;
  double area_ = 0;
  std::uint32_t surface_ = 0;
  float reach_ = 1;
};

// One meter: what the paths of its block have in common.
struct MeterStart {
  MeterKind kind = MeterKind::radiance;
  V3 p{0, 0, 0}, d{0, 0, 1};  // of a meter at a point: its place and MeterPoint::direction, in the world
  // As SurfaceHit::reach: paths begin so far before p that p may be on any surface
  float reach = 1;
  double weight = 1;               // the value is this times the radiance of paths
  std::uint32_t shape = kNone;     // index into the metered shapes; kNone: it is at a point
  std::uint32_t ambience = kNone;  // Meter::medium
  // The media in which paths begin; nullopt: they are not the same for all paths.
  std::optional<MediaState> media = {};
  bool has_plate() const { return kind != MeterKind::radiance; }
};

class Meters {
 public:
  Meters() = default;
  // `center` and `scale` are those of the geometry, to which `world` refers. The media of the meters are not
  // set. Fails if a shape has no area or a point is out of the range of float32.
  static Result<Meters> build(const Scene& scene, TextureIndex plate, const LightWorld& world);

  bool any() const { return !starts_.empty(); }
  const MeterStart& at(int x, int y) const { return starts_[blocks_.at(x, y)]; }
  std::vector<MeterStart>& starts() { return starts_; }
  const std::vector<MeterStart>& starts() const { return starts_; }
  const MeteredShape& shape(const MeterStart& start) const { return shapes_[start.shape]; }

  // A path's first point, and its direction: that of the ray or, with a plate, the plate's normal.
  struct Point {
    V3 p, d;
  };
  // `u`, in [0, 1)^2, chooses the point on a shape, or the normal of a meter of fluence; `v` gives further
  // digits of u.
  Point point(const MeterStart& start, const LightWorld& world, V2 u, V2 v) const;

 private:
  MeterBlocks blocks_{1};
  std::vector<MeterStart> starts_;
  std::vector<MeteredShape> shapes_;
};

}  // namespace ls::render
