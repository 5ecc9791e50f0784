// Converts scene emitters to the light table in world units: lengths are multiplied by the world's scale, so
// intensities (power per solid angle) by its square; radiance and irradiance do not change.
#include <cmath>

#include "common/base/overloaded.h"
#include "worker/render/camera/fov.h"
#include "worker/render/lights/lights.h"
#include "worker/render/math/color.h"
#include "worker/render/math/transform.h"

namespace ls::render {
namespace {

constexpr double kPiD = 3.14159265358979323846;
// The smallest sun [degrees]. Directions in float32 are accurate to 4e-6 degrees; a disk smaller than
// kSmallestSun becomes a point.
constexpr double kSmallestSun = 1e-3;

}  // namespace

Lights::Primitives Lights::primitives_of(const Geometry& g) {
  Primitives p;
  for (auto* ranges : {&p.triangles, &p.spheres, &p.disks, &p.cylinders}) ranges->resize(g.surfaces.size());
  const auto add = [](Range& r, std::size_t i) {
    if (r.count++ == 0) r.first = static_cast<std::uint32_t>(i);
  };
  for (std::size_t i = 0; i < g.triangle_surface.size(); ++i) add(p.triangles[g.triangle_surface[i]], i);
  for (std::size_t i = 0; i < g.spheres.size(); ++i) add(p.spheres[g.spheres[i].surface], i);
  for (std::size_t i = 0; i < g.disks.size(); ++i) add(p.disks[g.disks[i].surface], i);
  for (std::size_t i = 0; i < g.cylinders.size(); ++i) add(p.cylinders[g.cylinders[i].surface], i);
  return p;
}

void Lights::add_area(const Scene& scene, std::uint32_t shape, const Primitives& primitives, Geometry& g) {
  const Shape& s = scene.shapes[shape];
  Light l;
  l.radiance = s.emitter->radiance;
  l.textured = !textures_->is_constant(l.radiance);
  l.sign = g.surfaces[shape].orientation;
  set_beam(l, *s.emitter);
  l.uniform = !l.textured && !l.beam;
  if (l.uniform) l.value = textures_->constant(l.radiance);
  const Range triangles = primitives.triangles[shape], spheres = primitives.spheres[shape],
              disks = primitives.disks[shape], cylinders = primitives.cylinders[shape];
  if (spheres.count > 0) {
    l.kind = Kind::sphere;
    l.primitive = spheres.first;
    l.area = 4 * 3.14159265358979323846 * sqr(g.spheres[l.primitive].radius);
  } else if (cylinders.count > 0) {
    l.kind = Kind::cylinder;
    l.primitive = cylinders.first;
    const Cylinder& c = g.cylinders[l.primitive];
    l.area = 2 * 3.14159265358979323846 * c.radius * c.length;
  } else if (disks.count > 0) {
    const Disk& d = g.disks[disks.first];
    l.kind = Kind::disk;
    l.position = V3(d.center);
    l.axis_u = V3(d.u);
    l.axis_v = V3(d.v);
    l.normal = V3(d.n) * l.sign;
    l.area = 3.14159265358979323846 * d.u.cross(d.v).length();
  } else if (std::holds_alternative<RectangleShape>(s.geometry) && triangles.count == 2) {
    l.kind = Kind::parallelogram;
    const std::uint32_t* idx =
        &g.indices[std::size_t{3} * triangles.first];  // corners 0, 1, 2 of the rectangle
    const V3 a = g.positions[idx[0]], b = g.positions[idx[1]], c = g.positions[idx[2]];
    l.position = a;
    l.axis_u = b - a;
    l.axis_v = c - b;
    const V3d n = V3d(l.axis_u).cross(V3d(l.axis_v));
    l.area = n.length();
    l.normal = V3(n / l.area) * l.sign;
    l.uv0 = {0, 0};
    l.uv_u = {1, 0};
    l.uv_v = {0, 1};
  } else {
    l.kind = Kind::mesh;
    l.primitive = triangles.first;
    for (std::uint32_t n = 0; n < triangles.count; ++n) {
      const std::uint32_t i = triangles.first + n;
      const V3d e1 = V3d(g.vertex(i, 1)) - V3d(g.vertex(i, 0)),
                e2 = V3d(g.vertex(i, 2)) - V3d(g.vertex(i, 0));
      l.area += e1.cross(e2).length() / 2;
      l.cdf.push_back(l.area);
    }
  }
  if (!(l.area > 0) || is_black(textures_->mean(l.radiance))) {
    ++left_out_;
    return;
  }
  const LightBounds box = shape_bounds(l);
  l.reach = std::max(largest(box.low), largest(box.high));
  // If a null surface lies on a wall, shadow rays must end in front of both.
  if (g.surfaces[shape].null) l.reach = std::max(l.reach, g.surfaces[shape].coincident_reach);
  g.surfaces[shape].light = static_cast<std::uint32_t>(lights_.size());
  lights_.push_back(std::move(l));
}

Result<void> Lights::add_map(const Scene& scene, const EnvmapEmitter& emitter, const ImageLoader& images) {
  if (map_) return fail(Errc::invalid_argument, "a scene has one environment map at most");
  if (emitter.file.value >= scene.assets.size() || !images)
    return fail(Errc::invalid_argument, "an environment map names a file that the scene does not have");
  const Asset& asset = scene.assets[emitter.file.value];
  auto image = images(asset);
  if (!image) return tl::unexpected(image.error());
  auto map = EnvironmentMap::build(asset.name, std::move(*image), emitter.scale, emitter.to_world);
  if (!map) return tl::unexpected(map.error());
  clamped_ += map->clamped();
  if (map->black()) {
    ++left_out_;
    return {};
  }
  map_ = std::move(*map);
  Light l;
  l.kind = Kind::map;
  lights_.push_back(std::move(l));
  return {};
}

Result<void> Lights::add_emitter(const Scene& scene, const Emitter& emitter, const ImageLoader& images) {
  if (const auto* map = std::get_if<EnvmapEmitter>(&emitter)) return add_map(scene, *map, images);
  const double s = geometry_->scale;
  const auto place = [&](const V3d& p) { return V3((p - geometry_->center) * s); };
  Light l;
  std::visit(overloaded{[&](const ConstantEmitter& e) {
                          environment_ += color(e.radiance);
                          l.probability = -1;  // not a light to sample
                        },
                        [&](const EnvmapEmitter&) {},
                        [&](const DirectionalEmitter& e) {
                          l.kind = Kind::directional;
                          l.normal = V3(V3d(e.direction[0], e.direction[1], e.direction[2]).normalized());
                          l.value = color(e.irradiance);
                          if (e.angular_radius >= kSmallestSun) set_sun(l, e.angular_radius);
                        },
                        [&](const ProjectorEmitter& e) { set_projector(l, e); },
                        [&](const PointEmitter& e) {
                          l.kind = Kind::point;
                          l.position = place({e.position[0], e.position[1], e.position[2]});
                          l.value = color(e.intensity) * static_cast<float>(s * s);
                        },
                        [&](const SpotEmitter& e) {
                          l.kind = Kind::spot;
                          const Affine m(e.to_world);
                          l.position = place(m.b);
                          l.normal = V3(m.vector({0, 0, 1}).normalized());
                          l.axis_u = V3(m.vector({1, 0, 0}).normalized());
                          l.axis_v = V3(m.vector({0, 1, 0}).normalized());
                          l.value = color(e.intensity) * static_cast<float>(s * s);
                          const double rad = 3.14159265358979323846 / 180, cutoff = e.cutoff_angle * rad,
                                       beam = e.beam_width * rad;
                          l.cutoff = static_cast<float>(cutoff);
                          l.cos_cutoff = static_cast<float>(std::cos(cutoff));
                          l.cos_beam = static_cast<float>(std::cos(beam));
                          l.inv_transition = cutoff > beam ? static_cast<float>(1 / (cutoff - beam)) : 0.f;
                          l.tan_cutoff = static_cast<float>(std::tan(cutoff));
                          if (e.texture) {
                            l.textured = true;
                            l.radiance = *e.texture;
                          }
                        }},
             emitter);
  if (l.probability < 0) return {};
  if (is_black(l.value) || (l.kind == Kind::projector && is_black(textures_->mean(l.radiance)))) {
    ++left_out_;
    return {};
  }
  if (l.kind == Kind::sun) suns_.push_back(static_cast<std::uint32_t>(lights_.size()));
  lights_.push_back(std::move(l));
  return {};
}

// A disk of uniform radiance L and angular radius a gives a plane facing its centre the irradiance integral
// of L cos = L 2 pi integral_0^a cos sin = L pi sin^2 a.
void Lights::set_sun(Light& l, double degrees) {
  const double a = degrees * (kPiD / 180), half = std::sin(a / 2), sine = std::sin(a);
  l.kind = Kind::sun;
  l.value *= static_cast<float>(1 / (kPiD * sine * sine));
  l.cone = static_cast<float>(2 * half * half);
  l.sun_density = static_cast<float>(1 / (4 * kPiD * half * half));
}

void Lights::set_projector(Light& l, const ProjectorEmitter& e) {
  const double s = geometry_->scale;
  const Affine m(e.to_world);
  l.kind = Kind::projector;
  l.position = V3((m.b - geometry_->center) * s);
  l.axis_u = V3(m.vector({1, 0, 0}).normalized());
  l.axis_v = V3(m.vector({0, 1, 0}).normalized());
  l.normal = V3(m.vector({0, 0, 1}).normalized());
  l.radiance = e.irradiance;
  l.textured = true;
  l.value = C3(static_cast<float>(kPiD * e.scale * s * s));
  const double aspect = textures_->aspect(e.irradiance), tan_x = tan_half_fov_x(e.fov, e.fov_axis, aspect);
  l.tan_x = static_cast<float>(tan_x);
  l.tan_y = static_cast<float>(tan_x / aspect);
}

void Lights::set_beam(Light& l, const AreaEmitter& e) {
  l.beam = e.beam_width < 90;
  if (!l.beam) return;
  const double cutoff = std::cos(e.cutoff_angle * (kPiD / 180)), beam = std::cos(e.beam_width * (kPiD / 180));
  l.cos_cutoff = static_cast<float>(e.cutoff_angle < 90 ? cutoff : 0);
  l.cos_beam = static_cast<float>(beam);
  l.inv_transition = l.cos_beam > l.cos_cutoff ? 1 / (l.cos_beam - l.cos_cutoff) : 0.f;
  l.falloff = static_cast<float>(e.falloff);
}

// The flux of a beam per unit radiance and area: 2 pi integral of share(c) c dc, where beam and cutoff are
// cosines. With w = beam - cutoff and c = cutoff + w s between the two cosines, the integral is w
// integral_0^1 s^p (cutoff + w s) ds + (1 - beam^2) / 2.
double Lights::beam_flux(const Light& l) {
  if (!l.beam) return kPiD;
  const double cutoff = l.cos_cutoff, beam = l.cos_beam, w = beam - cutoff, p = l.falloff;
  return 2 * kPiD * (w * (cutoff / (p + 1) + w / (p + 2)) + (1 - beam * beam) / 2);
}

double Lights::power(const Light& l, float radius) const {
  const double pi = kPiD;
  switch (l.kind) {
    case Kind::directional:
      return luminance(l.value) * pi * radius * radius;
    case Kind::sun:  // irradiance times area, as for directional lights
      return luminance(l.value) * pi * double{l.cone} * (2 - double{l.cone}) * pi * radius * radius;
    case Kind::projector:
      return luminance(l.value * textures_->mean(l.radiance)) * 4 * l.tan_x * l.tan_y;
    case Kind::point:
      return luminance(l.value) * 4 * pi;
    case Kind::spot:
      return luminance(l.value) * 2 * pi * (1 - .5 * (l.cos_cutoff + l.cos_beam));
    case Kind::map:
      return map_->flux() * pi * radius * radius;
    case Kind::parallelogram:
    case Kind::mesh:
    case Kind::sphere:
    case Kind::disk:
    case Kind::cylinder:
      break;
  }
  return luminance(textures_->mean(l.radiance)) * beam_flux(l) * l.area;
}

// The probability of each of the n lights is half its share of the power plus half of 1/n, so none is below
// 1/(2n). Probabilities are exact shares of the 2^32 random words.
void Lights::set_probabilities(float radius) {
  std::vector<double> p;
  double sum = 0;
  for (const Light& l : lights_) sum += p.emplace_back(std::max(0., power(l, radius)));
  alone_ = p.size() == 1;
  const double uniform = .5 / static_cast<double>(p.size());
  double acc = 0;
  std::uint64_t before = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    acc += (sum > 0 && std::isfinite(sum) ? .5 * p[i] / sum : uniform) + uniform;
    const bool is_last = i + 1 == p.size();
    // Each light gets at least one word, so that last_ is strictly increasing.
    const std::uint64_t edge =
        is_last ? std::uint64_t{1} << 32
                : std::max(before + 1, static_cast<std::uint64_t>(std::llround(acc * 0x1p32)));
    lights_[i].probability = static_cast<float>(static_cast<double>(edge - before) * 0x1p-32);
    last_.push_back(static_cast<std::uint32_t>(edge - 1));
    before = edge;
    any_with_place_ = any_with_place_ || has_place(lights_[i].kind);
    if (lights_[i].kind == Kind::map) map_probability_ = lights_[i].probability;
  }
}

Result<Lights> Lights::build(const Scene& scene, Geometry& geometry, const TextureTable& textures,
                             const ImageLoader& images) {
  Lights l;
  l.geometry_ = &geometry;
  l.textures_ = &textures;
  const Primitives primitives = primitives_of(geometry);
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i) {
    if (scene.shapes[i].emitter) l.add_area(scene, i, primitives, geometry);
  }
  for (const Emitter& e : scene.emitters) {
    if (auto ok = l.add_emitter(scene, e, images); !ok) return tl::unexpected(ok.error());
  }
  l.sort_places_first();
  l.set_probabilities(geometry.radius);
  l.build_tree();
  return l;
}

}  // namespace ls::render
