// Direct light on a white floor, and light between surfaces.
#include <fmt/format.h>

#include <cmath>

#include "cli/cases/case.h"
#include "cli/cases/stages.h"

namespace ls::cases {
namespace {

constexpr double kReflectance = .5;

// The point of the floor at the origin, seen from the side; radiance = reflectance / pi x irradiance.
SceneKit floor() {
  SceneKit kit;
  const BsdfIndex white = kit.diffuse(kReflectance);
  kit.shape(RectangleShape{}, scale(3), white);
  kit.scene.integrator.max_depth = 2;
  kit.look({-2, 1, .6}, {0, 0, 0}, 1e-3);
  return kit;
}

void direct(Table& t) {
  // Directions that the surface chooses meet the smallest light once in 40,000 paths, for as much of its
  // light.
  const auto add = [&](const char* name, SceneKit kit, double irradiance) {
    t.mean(std::string("7.6g-") + name, "7.6g N26", "Direct light on a floor, by the light's closed form.",
           std::move(kit), grey(irradiance * kReflectance / kPi), {.slack = 5e-5});
  };
  const auto area = [](SceneKit& kit, const Geometry& g, const Transform& t) {
    const TextureIndex one = kit.texture(rgb(1));
    const BsdfIndex black = kit.diffuse(0);
    kit.shape(g, t, black).emitter = AreaEmitter{one};
  };
  {
    // Square of half side a at height h above its centre: four corners, each by Lambert's formula with x =
    // a/h, E = x / sqrt(1 + x^2) atan(x / sqrt(1 + x^2)).
    SceneKit kit = floor();
    area(kit, RectangleShape{}, translate({0, 0, 1.25}) * rotate_x(180) * scale(.8));
    const double x = .8 / 1.25, s = std::sqrt(1 + x * x);
    add("direct-square", kit, 4 * x / s * std::atan(x / s));
  }
  {
    SceneKit kit = floor();
    area(kit, DiskShape{}, translate({0, 0, 1.5}) * rotate_x(180) * scale(.7));
    add("direct-disk", kit, kPi * .49 / (.49 + 2.25));
  }
  {
    SceneKit kit = floor();
    area(kit, SphereShape{}, translate({0, 0, 2}) * scale(.5));
    add("direct-sphere", kit, kPi * .25 / 4);
  }
  {
    SceneKit kit = floor();  // 8e-5 sr
    area(kit, SphereShape{}, translate({0, 0, 1000}) * scale(5));
    add("direct-distant-sphere", kit, kPi * 25 / 1e6);
  }
  {
    SceneKit kit = floor();
    kit.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(3)});
    add("direct-point", kit, 3 / std::pow(1.25, 1.5));
  }
  {
    // Halfway between beam (10 degrees) and cutoff (30): half the intensity; aimed along -z, the point is 20
    // degrees off the axis.
    const double tangent = std::tan(20 * kPi / 180), cosine = std::cos(20 * kPi / 180);
    SceneKit kit = floor();
    kit.scene.emitters.push_back(SpotEmitter{translate({tangent, 0, 1}) * rotate_x(180), rgb(2), 30, 10, {}});
    add("direct-spot-falloff", kit, .5 * 2 * cosine * cosine * cosine);
  }
  {
    // Every kind at once: choice among lights.
    SceneKit kit = floor();
    area(kit, SphereShape{}, translate({0, 0, 2}) * scale(.5));
    kit.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(.3)});
    kit.scene.emitters.push_back(DirectionalEmitter{{1, 0, -1}, rgb(.2)});
    add("direct-three-lights", kit, kPi * .25 / 4 + .3 / std::pow(1.25, 1.5) + .2 / std::sqrt(2.));
  }
}

// What a white sky shows through m plates of n = 1.5 at normal incidence is what they don't reflect: each
// face reflects r = .04, T = (1 - r) / (1 + (2 m - 1) r); of 500, a thousand interfaces, 3 / 128: half a per
// cent of R is a fifth of T, and takes paths of a thousand vertices on average.
void plates(Table& table, int m) {
  SceneKit kit;
  const BsdfIndex glass = kit.glass(1.5), black = kit.diffuse(0);
  for (int i = 0; i < m; ++i) kit.shape(CubeShape{}, translate({0, 0, 1. * i}) * scale(9, 9, .25), glass);
  kit.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), black);
  kit.environment();
  kit.look({0, 0, m + 1.}, {0, 0, 0}, 1e-3, {0, 1, 0});
  const double r = .04, t = (1 - r) / (1 + (2 * m - 1) * r);
  table.mean(
      fmt::format("N42-{}-plates-of-glass", m), "N42 7.6g",
      "A thousand interfaces at normal incidence: R = 1 - T, T = (1 - r) / (1 + (2 m - 1) r) = 3 / 128.", kit,
      grey(1 - t), {.band = .005, .why_band = "paths of a thousand interfaces on average", .slow = true});
}

}  // namespace

void add_direct_light(Table& t) {
  direct(t);
  plates(t, 500);
  for (const bool sphere : {false, true}) {
    // A closed room that shines 1 and reflects half: 1 / (1 - .5).
    SceneKit kit;
    const TextureIndex one = kit.texture(rgb(1));
    const BsdfIndex white = kit.diffuse(kReflectance);
    Shape& s = sphere ? kit.shape(SphereShape{}, {}, white) : kit.shape(CubeShape{}, {}, white);
    s.flip_normals = true;
    s.emitter = AreaEmitter{one};
    kit.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    t.mean(sphere ? "7.6c-grey-room-sphere" : "7.6c-grey-room-cube", "7.6c N39",
           "A closed room: Le / (1 - rho).", kit, grey(2));
  }
}

}  // namespace ls::cases
