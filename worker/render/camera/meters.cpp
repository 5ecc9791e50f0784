#include "worker/render/camera/meters.h"

#include <fmt/format.h>

#include <cmath>
#include <type_traits>

#include "core/scene/schema/validate.h"

namespace ls::render {
namespace {

V3 on_unit_sphere(V2 u) {
  const float z = 1 - 2 * u.x;
  const V2 around = unit_circle(u.y) * safe_sqrt(1 - z * z);
  return {around.x, around.y, z};
}

double factor_of(MeterKind kind) {
  switch (kind) {
    case MeterKind::radiance:
      return 1;
    case MeterKind::irradiance:
    case MeterKind::flux:
      return kPiD;
    case MeterKind::fluence:
      break;
  }
  return 4 * kPiD;
}

}  // namespace

MeteredShape::MeteredShape(const Scene& scene, std::uint32_t shape, TextureIndex plate,
                           const SurfacePrimitives& primitives, const LightWorld& world)
    : surface_(shape) {
  Shape lamp = scene.shapes[shape];  // points are sampled as those of a lamp of this shape
  lamp.emitter = AreaEmitter{.radiance = plate};
  sampler_ = make_area_light(lamp, shape, primitives, world);
  std::visit(
      [&](const auto& s) {
        area_ = s.area;
        if (!(area_ > 0)) return;
        const LightBounds box = s.bounds(world);
        reach_ =
            std::max({largest(box.low), largest(box.high), world.geometry.surfaces[shape].coincident_reach});
      },
      sampler_);
}

AreaPoint MeteredShape::point(const LightWorld& world, const LightNumbers& numbers) const {
  return std::visit(
      [&]<class Sampler>(const Sampler& s) {
        if constexpr (std::is_same_v<Sampler, SphereLight>) {
          const Sphere& sphere = world.geometry.spheres[s.primitive];
          const V3 n = on_unit_sphere(numbers.unit());
          return AreaPoint{V3(sphere.center + V3d(n) * sphere.radius), n * s.sign, {}, {}};
        } else {
          return s.point(world, numbers);
        }
      },
      sampler_);
}

Result<Meters> Meters::build(const Scene& scene, TextureIndex plate, const LightWorld& world) {
  Meters out;
  std::vector<std::uint32_t> shape_of(scene.meters.size(), kNone);
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i)
    if (const auto& meter = scene.shapes[i].meter) shape_of[meter->value] = i;
  std::optional<SurfacePrimitives> primitives;
  for (std::size_t m = 0; m < scene.meters.size(); ++m) {
    const Meter& meter = scene.meters[m];
    MeterStart start{.kind = meter.kind, .weight = factor_of(meter.kind)};
    if (meter.medium) start.ambience = meter.medium->value;
    for (std::size_t i = 0; i < meter.points.size(); ++i) {
      const MeterPoint& point = meter.points[i];
      const auto vector = [](const Vec3& v) { return V3d(v[0], v[1], v[2]); };
      start.p = world.place(vector(point.position));
      start.d = V3(vector(point.direction));
      if (!is_finite(start.p))
        return fail(Errc::invalid_argument,
                    fmt::format("point {} of the meter '{}' leaves the range of single precision", i + 1,
                                meter.name));
      start.reach = std::max(largest(start.p), world.geometry.radius);
      out.starts_.push_back(start);
    }
    if (!meter.points.empty()) continue;
    if (!primitives) primitives.emplace(world.geometry);
    out.shapes_.emplace_back(scene, shape_of[m], plate, *primitives, world);
    const double area = out.shapes_.back().area() / world.scale2();
    if (!(area > 0))
      return fail(Errc::invalid_argument,
                  fmt::format("the meter '{}' is on a shape without area: nothing to measure", meter.name));
    if (meter.kind == MeterKind::flux) start.weight *= area;
    start.reach = out.shapes_.back().reach();
    start.shape = static_cast<std::uint32_t>(out.shapes_.size() - 1);
    out.starts_.push_back(start);
  }
  if (out.any()) out.blocks_ = MeterBlocks(out.starts_.size());
  return out;
}

Meters::Point Meters::point(const MeterStart& start, const LightWorld& world, V2 u, V2 v) const {
  if (start.kind == MeterKind::fluence) return {start.p, on_unit_sphere(u)};
  if (start.shape == kNone) return {start.p, start.d};
  // Random numbers are multiples of 2^-24. With many triangles further digits matter.
  const auto word = [](float first, float then) {
    return (static_cast<std::uint32_t>(first * 0x1p24f) << 8) | static_cast<std::uint32_t>(then * 0x1p8f);
  };
  const AreaPoint y = shapes_[start.shape].point(world, {.x = word(u.x, v.x), .y = word(u.y, v.y)});
  return {y.p, y.n};
}

}  // namespace ls::render
