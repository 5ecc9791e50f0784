// Direct light on a grey floor, and light reflected between surfaces.
#include <fmt/format.h>

#include <cmath>

#include "validation/fixtures/case.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

void direct(Table& t) {
  // BSDF sampling hits the smallest of these lights with one path in 40,000, so it contributes only a small
  // share of the light.
  const auto add = [&](const char* name, SceneBuilder builder, double irradiance) {
    t.mean(std::string("7.6g-") + name, "7.6g N26", "Direct light on a floor, by the light's closed form.",
           std::move(builder), reflected(irradiance), {.slack = 5e-5});
  };
  {
    SceneBuilder builder = floor_point();
    builder.lamp(RectangleShape{}, translate({0, 0, 1.25}) * rotate_x(180) * scale(.8));
    add("direct-square", builder, below_a_square(.8 / 1.25));
  }
  {
    SceneBuilder builder = floor_point();
    builder.lamp(DiskShape{}, translate({0, 0, 1.5}) * rotate_x(180) * scale(.7));
    add("direct-disk", builder, kPi * .49 / (.49 + 2.25));
  }
  {
    SceneBuilder builder = floor_point();
    builder.lamp(SphereShape{}, translate({0, 0, 2}) * scale(.5));
    add("direct-sphere", builder, kPi * .25 / 4);
  }
  {
    SceneBuilder builder = floor_point();  // solid angle 8e-5 sr
    builder.lamp(SphereShape{}, translate({0, 0, 1000}) * scale(5));
    add("direct-distant-sphere", builder, kPi * 25 / 1e6);
  }
  {
    SceneBuilder builder = floor_point();
    builder.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(3)});
    add("direct-point", builder, 3 / std::pow(1.25, 1.5));
  }
  {
    // The direction to the floor's point is 20 degrees off the light's axis, halfway between beam (10
    // degrees) and cutoff (30), so the intensity is a half. The light is aimed along -z.
    const double tangent = std::tan(20 * kPi / 180), cosine = std::cos(20 * kPi / 180);
    SceneBuilder builder = floor_point();
    builder.scene.emitters.push_back(
        SpotEmitter{translate({tangent, 0, 1}) * rotate_x(180), rgb(2), 30, 10, {}});
    add("direct-spot-falloff", builder, .5 * 2 * cosine * cosine * cosine);
  }
  {
    // A checkerboard of two colours divides the sphere into quarters; from below, equal parts of both are
    // seen.
    SceneBuilder builder = floor_point();
    const TextureIndex dark = builder.texture(rgb(.25)), bright = builder.texture(rgb(1.5));
    builder.lamp(SphereShape{}, translate({0, 0, 2}) * scale(.5)).emitter = AreaEmitter{
        SceneBuilder::push<TextureTag>(builder.scene.textures, CheckerboardTexture{dark, bright, {}})};
    add("direct-checkered-sphere", builder, kPi * .25 / 4 * (.25 + 1.5) / 2);
  }
  {
    // Lights of all kinds in one scene, to test the choice among lights.
    SceneBuilder builder = floor_point();
    builder.lamp(SphereShape{}, translate({0, 0, 2}) * scale(.5));
    builder.scene.emitters.push_back(PointEmitter{{.5, 0, 1}, rgb(.3)});
    builder.scene.emitters.push_back(DirectionalEmitter{{1, 0, -1}, rgb(.2)});
    add("direct-three-lights", builder, kPi * .25 / 4 + .3 / std::pow(1.25, 1.5) + .2 / std::sqrt(2.));
  }
}

// The reflectance of m plates of n = 1.5 at normal incidence, in front of black, is 1 - T with
// T = (1 - r) / (1 + (2 m - 1) r), since each face reflects r = 0.04. For 500 plates, a thousand interfaces,
// T = 3 / 128, and paths have a thousand vertices on average. The band, half a per cent of the reflectance,
// is a fifth of T, so the case also tests T.
void plates(Table& table, int m) {
  SceneBuilder builder;
  const BsdfIndex glass = builder.glass(1.5), black = builder.diffuse(0);
  for (int i = 0; i < m; ++i) builder.shape(CubeShape{}, translate({0, 0, 1. * i}) * scale(9, 9, .25), glass);
  builder.shape(RectangleShape{}, translate({0, 0, -2}) * scale(20), black);
  builder.environment();
  builder.look({0, 0, m + 1.}, {0, 0, 0}, 1e-3, {0, 1, 0});
  const double r = .04, t = (1 - r) / (1 + (2 * m - 1) * r);
  table.mean(
      fmt::format("N42-{}-plates-of-glass", m), "N42 7.6g",
      "A thousand interfaces at normal incidence: R = 1 - T, T = (1 - r) / (1 + (2 m - 1) r) = 3 / 128.",
      builder, grey(1 - t),
      {.band = .005, .why_band = "paths of a thousand interfaces on average", .slow = true});
}

}  // namespace

void add_direct_light(Table& t) {
  direct(t);
  plates(t, 500);
  for (const bool sphere : {false, true}) {
    // The walls of a closed room emit radiance 1 and reflect half, so the radiance is 1 / (1 - .5)
    // everywhere.
    SceneBuilder builder;
    const TextureIndex one = builder.texture(rgb(1));
    const BsdfIndex white = builder.diffuse(.5);
    Shape& s = sphere ? builder.shape(SphereShape{}, {}, white) : builder.shape(CubeShape{}, {}, white);
    s.flip_normals = true;
    s.emitter = AreaEmitter{one};
    builder.look({.2, -.3, .1}, {.5, .9, 0}, 60);
    t.mean(sphere ? "7.6c-grey-room-sphere" : "7.6c-grey-room-cube", "7.6c N39",
           "A closed room: Le / (1 - rho).", builder, grey(2));
  }
}

}  // namespace ls::cases
