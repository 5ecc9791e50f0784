// Tests of AOVs on scenes in which their values are known, and of the light AOVs, whose sum must be the whole
// light.
#include "core/image/aov/aov.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/image/aov/identifiers.h"
#include "core/image/film/partial.h"
#include "tests/unit/render/integrator/aov_picture.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

const std::vector<std::string> kOfSurface = {"albedo", "coverage", "depth",    "normal",     "geo_normal",
                                             "uv",     "position", "shape_id", "material_id"};

TEST(Aovs, WallHasItsOwnValues) {
  for (const Vec3& at : {Vec3{0, 0, 0}, Vec3{100, -200, 50}}) {
    const Picture p(wall(.4, .6, at), kOfSurface);
    for (std::size_t pixel = 0; pixel < 4; ++pixel) {
      // The view is 5 tan(.001 deg) = 9e-5 wide; each pixel sees one quarter of it.
      const double view = 5 * 1e-3 * test::kPi / 180;
      EXPECT_EQ(p.sum("aov.hits", pixel), kSamples);
      EXPECT_NEAR(p.of_hits("aov.depth.Z", pixel), 5, 8 * kClose);
      EXPECT_NEAR(p.of_hits("aov.position.X", pixel), at[0] + .4, view + 256 * kClose);
      EXPECT_NEAR(p.of_hits("aov.position.Y", pixel), at[1] + .6, view + 256 * kClose);
      EXPECT_NEAR(p.of_hits("aov.position.Z", pixel), at[2], 256 * kClose);
      EXPECT_NEAR(p.of_hits("aov.uv.U", pixel), .6, view + kClose);
      EXPECT_NEAR(p.of_hits("aov.uv.V", pixel), .65, view + kClose);
      for (const char* normal : {"aov.normal.", "aov.geo_normal."}) {
        EXPECT_NEAR(p.of_all(std::string(normal) + "X", pixel), 0, kClose);
        EXPECT_NEAR(p.of_all(std::string(normal) + "Z", pixel), 1, kClose);
      }
      EXPECT_NEAR(p.of_all("aov.albedo.G", pixel), .3, kClose);
      EXPECT_EQ(p.of_all("aov.coverage.A", pixel), 1);
    }
  }
}

TEST(Aovs, DepthIsMeasuredFromTheCameraNotTheNearClip) {
  SceneBuilder builder = wall();
  builder.scene.sensor.near_clip = 3;
  EXPECT_NEAR(Picture(builder, {"depth"}).of_hits("aov.depth.Z"), 5, 8 * kClose);

  builder = wall();
  builder.look({0, 3, 4}, {0, 0, 0});  // depth is measured along the ray
  EXPECT_NEAR(Picture(builder, {"depth"}).of_hits("aov.depth.Z"), 5, 5e-4);  // the view has an extent

  builder = wall();
  builder.scene.sensor.projection = Projection::orthographic;
  builder.scene.sensor.to_world = builder.scene.sensor.to_world * test::scale(.01, .01, 1);
  EXPECT_NEAR(Picture(builder, {"depth"}).of_hits("aov.depth.Z"), 5, 8 * kClose);
}

TEST(Aovs, SeeThroughMediaAndBoundaries) {
  SceneBuilder builder = wall();
  const MediumIndex fog = builder.homogeneous({2, 2, 2}, {.9, .9, .9});
  builder.container(CubeShape{}, translate({0, 0, 2}), builder.null(), fog);

  const Picture p(builder, {"depth", "coverage", "volume", "normal"}, 64);

  EXPECT_NEAR(p.of_hits("aov.depth.Z"), 5, 8 * kClose);
  EXPECT_EQ(p.of_all("aov.coverage.A"), 1);
  EXPECT_NEAR(p.of_all("aov.normal.Z"), 1, kClose);
  EXPECT_GT(p.of_all("aov.volume.R"), 0);
}

TEST(Aovs, SphereGivesNormalAndUv) {
  SceneBuilder builder({1, 1});
  builder.shape(SphereShape{}, translate({1, 2, 3}), builder.diffuse(.5));
  builder.shape(SphereShape{}, translate({1, 2, 9}), builder.diffuse(.5)).flip_normals = true;
  builder.look({5, 2, 3}, {1, 2, 3});
  const Picture p(builder, {"normal", "uv", "depth"});
  // The ray hits the sphere at +x: the azimuth is 0 (or 1), the polar angle a quarter turn.
  EXPECT_NEAR(p.of_all("aov.normal.X"), 1, 1e-8 + kClose);
  EXPECT_NEAR(p.of_hits("aov.uv.V"), .5, 1e-4);
  EXPECT_NEAR(p.of_hits("aov.depth.Z"), 3, 16 * kClose);

  builder.look({1, 6, 9}, {1, 2, 9});
  const Picture flipped(builder, {"normal", "uv"});
  EXPECT_NEAR(flipped.of_all("aov.normal.Y"), -1, kClose);
  EXPECT_NEAR(flipped.of_hits("aov.uv.U"), .25, 1e-4);
}

TEST(Aovs, AlbedoIsTheReflectedOrTransmittedShareOfLight) {
  const auto albedo = [](BsdfIndex (*make)(SceneBuilder&)) {
    SceneBuilder builder = wall();
    builder.scene.shapes[0].bsdf = make(builder);
    return Picture(builder, {"albedo"}).of_all("aov.albedo.R");
  };
  EXPECT_NEAR(albedo([](SceneBuilder& k) { return k.mirror(); }), 1, kClose);
  EXPECT_NEAR(albedo([](SceneBuilder& k) { return k.glass(1.5); }), 1,
              kClose);  // without the factor 1.5^-2 of refraction
  EXPECT_NEAR(albedo([](SceneBuilder& k) { return k.diffuse(0); }), 0, 0);
}

// Returns the mean of a denoising guide. Also checks that the two halves of the samples have the same sum.
double guide(const Picture& p, const std::string& name, char component) {
  const double a = p.sum(fmt::format("aov.{}.A.{}", name, component), 0),
               b = p.sum(fmt::format("aov.{}.B.{}", name, component), 0);
  EXPECT_NEAR(a, b, kClose * std::abs(a)) << "nothing here differs between samples";
  return (a + b) / static_cast<double>(kSamples);
}
const std::vector<std::string> kGuides = {"denoising_albedo", "denoising_normal"};

TEST(Aovs, GuidesOfADenoiserSeeThroughMirrorsGlassAndBoundaries) {
  const Picture bare(wall(), kGuides);
  EXPECT_NEAR(guide(bare, "denoising_albedo", 'R'), .3, kClose);
  EXPECT_NEAR(guide(bare, "denoising_normal", 'Z'), 1, kClose);

  // A mirror at 45 degrees turns the view from -y to -z, down to the wall.
  SceneBuilder mirrored = wall();
  mirrored.shape(RectangleShape{}, translate({0, 0, 3}) * test::rotate_x(-135), mirrored.mirror());
  mirrored.look({0, 3, 3}, {0, 0, 3}, 1e-3);
  const Picture mirror(mirrored, kGuides);
  EXPECT_NEAR(guide(mirror, "denoising_albedo", 'R'), .3, 8 * kClose);
  EXPECT_NEAR(guide(mirror, "denoising_normal", 'Z'), 1, 8 * kClose);

  SceneBuilder empty = wall();
  empty.container(CubeShape{}, translate({0, 0, 2}), empty.null(), empty.homogeneous({0, 0, 0}, {1, 1, 1}));
  EXPECT_NEAR(guide(Picture(empty, kGuides), "denoising_albedo", 'R'), .3, kClose);
}

// The cube has side 2 and sigma_t 0.5: it transmits e^-1 of the light without scattering.
TEST(Aovs, GuidesOfADenoiserMixInMediaByTheirTransmittance) {
  SceneBuilder builder = wall();
  builder.container(CubeShape{}, translate({0, 0, 2}), builder.null(),
                    builder.homogeneous({.5, .5, .5}, {.9, .9, .9}));

  const Picture p(builder, kGuides);

  const double through = std::exp(-1.);
  EXPECT_NEAR(guide(p, "denoising_albedo", 'G'), .3 * through + .9 * (1 - through), 16 * kClose);
  EXPECT_NEAR(guide(p, "denoising_normal", 'Z'), through, 16 * kClose);
}

TEST(Aovs, MissesAreZeroAndMeansAreOverHits) {
  SceneBuilder builder({1, 1});
  builder.shape(RectangleShape{}, translate({-2, 0, 0}) * test::scale(2),
                builder.diffuse(.5));  // covers x in [-4, 0]
  builder.look({0, 0, 1}, {0, 0, 0}, 60, {0, 1, 0});
  const Picture half(builder, kOfSurface, 64);
  EXPECT_NEAR(half.of_all("aov.coverage.A"), .5, 3. / 64);  // a Sobol sequence errs by few samples
  EXPECT_NEAR(half.of_all("aov.normal.Z"), half.of_all("aov.coverage.A"), kClose);
  EXPECT_GE(half.of_hits("aov.depth.Z"), 1);
  EXPECT_LT(half.of_hits("aov.position.X"), 0);
  EXPECT_EQ(half.ids(0).slots[1], IdSlot{});

  builder.look({0, 0, -5}, {0, 0, -9}, 1, {0, 1, 0});
  const Picture none(builder, kOfSurface);
  for (const char* plane : {"aov.hits", "aov.depth.Z", "aov.normal.Z", "aov.coverage.A", "aov.albedo.R"})
    EXPECT_EQ(none.sum(plane, 0), 0) << plane;
  EXPECT_EQ(none.ids(0), IdSlots{});
}

TEST(Aovs, CryptomattesCountTheSamplesOfEachObject) {
  SceneBuilder builder = wall();
  const BsdfIndex inner = builder.diffuse(.5), both = builder.bsdf(TwoSidedBsdf{inner, inner});
  const BsdfIndex mask = builder.bsdf(MaskBsdf{builder.texture({.25, .25, .25}), both});
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * test::scale(2), mask);
  builder.scene.shape_labels = {{"wall", "plaster"}, {"veil", "lace"}};

  const Picture p(builder, {"shape_id", "material_id"}, 256);

  const IdSlots material = p.ids(0), shape = p.ids(1);
  EXPECT_EQ(shape.slots[0].id, cryptomatte_id("wall"));
  EXPECT_EQ(shape.slots[1].id, cryptomatte_id("veil"));
  EXPECT_EQ(shape.slots[0].n + shape.slots[1].n, 256);
  // A quarter of 2 x 128 points, which are the first dimension of two Sobol sequences. Each sequence errs by
  // one point at most.
  EXPECT_NEAR(shape.slots[1].n, 64, 2);
  EXPECT_EQ(material.slots[0], (IdSlot{cryptomatte_id("plaster"), shape.slots[0].n}));
  EXPECT_EQ(material.slots[1].id, cryptomatte_id("lace"));
  EXPECT_EQ(shape.more + material.more, 0);
}

TEST(Aovs, InstancesAreSeparateObjectsInCryptomattes) {
  SceneBuilder builder({1, 1});
  builder.shape(SphereShape{}, translate({0, 0, 0}), builder.diffuse(.5)).group = GroupIndex{0};
  builder.scene.groups.emplace_back();
  builder.scene.instances = {{GroupIndex{0}, translate({5, 0, 0})}, {GroupIndex{0}, translate({0, 5, 0})}};
  builder.scene.shape_labels = {{"ball", "clay"}};
  builder.scene.instance_labels = {{"left", ""}, {"right", ""}};
  builder.look({0, 5, 9}, {0, 5, 0}, 1e-3, {0, 1, 0});

  const Picture p(builder, {"shape_id", "material_id", "uv"});

  EXPECT_EQ(p.ids(1).slots[0], (IdSlot{cryptomatte_id("right"), kSamples}));
  EXPECT_EQ(p.ids(0).slots[0], (IdSlot{cryptomatte_id("clay"), kSamples}));
  EXPECT_NEAR(p.of_hits("aov.uv.V"), 0, 1e-4);  // the ball's pole
}

// ---- light AOVs
const std::vector<std::string> kOfLight = {"direct", "indirect", "surface", "volume",
                                           "single", "multiple", "emission"};

// Each AOV sums the same float32 numbers in another order, in double, and is rounded once. The radiance of a
// sample is summed in float32: with n contributions of one sign its error is n 2^-24 of the sum. These paths
// have fewer than 256 contributions.
TEST(Aovs, LightLayersAddUpToTheColour) {
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const int media : {0, 1, 2}) {
      SceneBuilder builder = hall(media > 0, media > 1);
      builder.scene.integrator.name = integrator;
      const Picture p(builder, kOfLight, 32);
      double volume = 0;
      for (std::size_t i = 0; i < p.pixels(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
          const auto part = [&](const char* name) {
            return p.sum(std::string("aov.") + name + "." + "RGB"[c], i);
          };
          const double whole = p.whole(c, i), close = 0x1p-16 * whole;
          EXPECT_NEAR(part("direct") + part("indirect"), whole, close) << integrator << media;
          EXPECT_NEAR(part("surface") + part("volume") + part("emission"), whole, close)
              << integrator << media;
          EXPECT_NEAR(part("single") + part("multiple"), part("volume"), close);
          EXPECT_GE(part("indirect"), 0);
          volume += part("volume");
        }
      EXPECT_EQ(volume > 0, media > 0);
    }
}

TEST(Aovs, BeautyHasTheSameBitsWithAndWithoutThem) {
  std::vector<std::string> all;
  for (const AovRow& row : aov_rows()) all.emplace_back(row.name);
  for (const char* integrator : {"volpath", "volpath_distant_mis"})
    for (const int media : {0, 1, 2}) {
      SceneBuilder builder = hall(media > 0, media > 1);
      builder.scene.integrator.name = integrator;
      const std::vector<float> plain = Picture(builder, {}).beauty();
      EXPECT_EQ(Picture(builder, all).beauty(), plain) << integrator << media;
      EXPECT_EQ(Picture(builder, {"uv"}).beauty(), plain) << integrator << media;
      EXPECT_EQ(Picture(builder, {"direct"}).beauty(), plain) << integrator << media;
    }
}

TEST(Aovs, DirectlyVisibleLightIsEmission) {
  SceneBuilder builder = wall();
  builder.scene.shapes[0].emitter = AreaEmitter{builder.texture({3, 2, 1})};
  builder.scene.shapes[0].bsdf = builder.diffuse(0);
  const Picture p(builder, kOfLight);
  EXPECT_EQ(p.of_all("aov.emission.R"), 3);
  EXPECT_EQ(p.of_all("aov.direct.B"), 1);
  EXPECT_EQ(p.of_all("aov.surface.R") + p.of_all("aov.indirect.R"), 0);
}

TEST(Aovs, SingleScatteringHasNoIndirectAndNoMultipleLight) {
  SceneBuilder builder = hall(true, false);
  builder.scene.integrator.max_depth = 2;
  const Picture p(builder, kOfLight);
  double single = 0;
  for (std::size_t i = 0; i < p.pixels(); ++i) {
    EXPECT_EQ(p.sum("aov.indirect.G", i), 0);
    EXPECT_EQ(p.sum("aov.multiple.G", i), 0);
    single += p.sum("aov.single.G", i);
  }
  EXPECT_GT(single, 0);
}

// A wall of albedo a in a white furnace: its direct light is a, and it has no indirect light.
TEST(Aovs, DirectLightOfAWallIsItsAlbedo) {
  const Picture p(wall(), {"surface", "indirect", "direct"}, 64);
  EXPECT_NEAR(p.of_all("aov.surface.R"), .3, 64 * kClose);
  EXPECT_NEAR(p.of_all("aov.direct.R"), .3, 64 * kClose);
  EXPECT_EQ(p.of_all("aov.indirect.R"), 0);
}

}  // namespace
}  // namespace ls::render
