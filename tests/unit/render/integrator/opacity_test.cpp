// Tests of the AOVs of opacity, of the transparent film, and of shapes and lights that the camera does not
// see.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "core/image/film/partial.h"
#include "tests/support/significance.h"
#include "tests/unit/render/integrator/aov_picture.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using test::operator*;

const std::vector<std::string> kOfOpacity = {"alpha", "opacity", "volume_opacity"};

struct Mean {
  double value = 0, error = 0;  // error: the standard error
};

// Returns the mean of a component of an AOV with halves over all pixels, of `samples` samples each.
Mean mean_of(const Picture& p, const std::string& name, char component, std::uint64_t samples = kSamples) {
  const double per_half = static_cast<double>(samples) / 2, pixels = static_cast<double>(p.pixels());
  Mean mean;
  for (std::size_t i = 0; i < p.pixels(); ++i) {
    const double a = p.sum(fmt::format("aov.{}.A.{}", name, component), i) / per_half,
                 b = p.sum(fmt::format("aov.{}.B.{}", name, component), i) / per_half;
    mean.value += (a + b) / 2 / pixels;
    mean.error += (a - b) * (a - b) / 4;
  }
  mean.error = std::sqrt(mean.error) / pixels;
  return mean;
}

// A cube of side 2 in front of the wall, filled with this medium.
void fill(SceneBuilder& builder, MediumIndex medium) {
  builder.container(CubeShape{}, translate({0, 0, 2}), builder.null(), medium);
}
void remove_wall(SceneBuilder& builder) { builder.scene.shapes.erase(builder.scene.shapes.begin()); }

SceneBuilder transparent(SceneBuilder builder) {
  builder.scene.film.transparent = true;
  return builder;
}

// The derivative of 1 - exp(-tau) by log tau is at most 1/e. The length of the ray in the cube is the
// difference of float32 coordinates of a world of unit size, a quarter of that size or more: it is accurate
// to 4 kClose of itself, and so the opacity to 4 kClose / e, plus its own rounding.
constexpr double kSlabClose = 2 * kClose;

TEST(Opacity, OfAHomogeneousSlabIsOneMinusItsTransmittance) {
  const std::array<double, 3> sigma = {.25, .5, 2};
  SceneBuilder builder = transparent(wall());
  fill(builder, builder.homogeneous({sigma[0], sigma[1], sigma[2]}, {.9, .5, .1}));
  const Picture before(builder, kOfOpacity);
  remove_wall(builder);
  const Picture alone(builder, kOfOpacity);

  double alpha = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double opacity = 1 - std::exp(-2 * sigma[c]);
    alpha += opacity / 3;
    EXPECT_NEAR(mean_of(alone, "opacity", "RGB"[c]).value, opacity, kSlabClose);
    EXPECT_NEAR(mean_of(alone, "volume_opacity", "RGB"[c]).value, opacity, kSlabClose);
    EXPECT_NEAR(mean_of(before, "volume_opacity", "RGB"[c]).value, opacity, kSlabClose);
    EXPECT_EQ(mean_of(before, "opacity", "RGB"[c]).value, 1);
  }
  EXPECT_NEAR(mean_of(alone, "alpha", 'A').value, alpha, kSlabClose);
  EXPECT_EQ(mean_of(before, "alpha", 'A').value, 1);
}

TEST(Opacity, OfNothingIsZeroAndOfGlassAndMirrorsOne) {
  SceneBuilder builder = transparent(wall());
  builder.scene.shapes[0].bsdf = builder.glass(1.5);
  EXPECT_EQ(mean_of(Picture(builder, kOfOpacity), "alpha", 'A').value, 1);
  builder.scene.shapes[0].bsdf = builder.mirror();
  EXPECT_EQ(mean_of(Picture(builder, kOfOpacity), "alpha", 'A').value, 1);
  EXPECT_EQ(mean_of(Picture(builder, kOfOpacity), "volume_opacity", 'R').value, 0);
  remove_wall(builder);
  EXPECT_EQ(mean_of(Picture(builder, kOfOpacity), "alpha", 'A').value, 0);
}

// So an image with alpha can be laid over another one, and written as a PNG, whether or not its film is
// transparent.
TEST(Opacity, OfAnEnvironmentThatTheCameraSeesIsOne) {
  SceneBuilder builder({8, 8});
  builder.environment();
  builder.look({0, 0, 7}, {0, 0, 0}, 1e-3, {0, 1, 0});
  fill(builder, builder.homogeneous({1, 1, 1}, {.9, .9, .9}));

  const Picture seen(builder, kOfOpacity);
  EXPECT_EQ(mean_of(seen, "alpha", 'A').value, 1);
  EXPECT_EQ(mean_of(seen, "opacity", 'G').value, 1);
  EXPECT_NEAR(mean_of(seen, "volume_opacity", 'G').value, 1 - std::exp(-2.), kSlabClose);

  std::get<ConstantEmitter>(builder.scene.emitters[0]).visible_camera = false;
  EXPECT_NEAR(mean_of(Picture(builder, kOfOpacity), "alpha", 'A').value, 1 - std::exp(-2.), kSlabClose);
}

TEST(Opacity, IgnoresMediaThatTheIntegratorIgnores) {
  SceneBuilder builder = transparent(wall());
  remove_wall(builder);
  fill(builder, builder.homogeneous({1, 1, 1}, {.9, .9, .9}));
  builder.scene.integrator.name = "path";

  EXPECT_EQ(mean_of(Picture(builder, kOfOpacity), "alpha", 'A').value, 0);
}

// Two voxels of densities 0 and 3 along the ray, whose interpolation is 1.5 on average.
TEST(Opacity, OfAGridIsUnbiased) {
  const auto opacity = [](const std::vector<float>& values) {
    SceneBuilder builder({16, 16});
    builder.look({0, 0, 7}, {0, 0, 0}, 1e-3, {0, 1, 0});
    fill(builder,
         builder.heterogeneous(builder.grid({1, 1, 2}, values, translate({-1, -1, 1}) * test::scale(2)),
                               {.9, .9, .9}));
    return mean_of(Picture(builder, {"alpha"}, 64), "alpha", 'A', 64);
  };
  const double expected = 1 - std::exp(-2 * 1.5);

  const Mean ramp = opacity({0, 3}), flat = opacity({1.5, 1.5});

  EXPECT_GT(ramp.error, 0);
  EXPECT_LT(ramp.error, .01);
  EXPECT_NEAR(ramp.value, expected, test::kStandardErrors * ramp.error);
  EXPECT_NEAR(flat.value, expected, kSlabClose) << "nothing has to be tracked in a constant density";
}

TEST(Opacity, OfAMaskIsItsOpacity) {
  SceneBuilder builder = transparent(wall());
  builder.scene.shapes[0].bsdf =
      builder.bsdf(MaskBsdf{builder.texture({.25, .25, .25}), builder.scene.shapes[0].bsdf});

  const Picture p(builder, {"alpha", "coverage"}, 256);

  for (std::size_t i = 0; i < p.pixels(); ++i) {
    const double alpha = p.sum("aov.alpha.A.A", i) + p.sum("aov.alpha.B.A", i);
    // Each half has 128 points, the first dimension of a Sobol sequence. At most one of them is on the wrong
    // side.
    EXPECT_NEAR(alpha, 64, 2);
    EXPECT_EQ(alpha, p.sum("aov.coverage.A", i)) << "both decide by the same number";
  }
}

// With the reflectance r = ((n - 1) / (n + 1))^2 of one side, a pane reflects 2 r / (1 + r) of the light at
// normal incidence: the sum over all reflections within.
TEST(Opacity, OfAColouredPaneIsTheLightThatDoesNotPass) {
  SceneBuilder builder({8, 8});
  builder.shape(
      RectangleShape{}, {},
      builder.bsdf(ThinDielectricBsdf{1.5, 1, builder.texture({1, 1, 1}), builder.texture({1, .5, .25})}));
  builder.look({0, 0, 5}, {0, 0, 0}, 1e-3, {0, 1, 0});
  const double r = .04, passes = 1 - 2 * r / (1 + r);
  const std::array tint{1., .5, .25};

  const Picture p(builder, {"opacity"}, 256);

  for (std::size_t c = 0; c < 3; ++c) {
    const Mean mean = mean_of(p, "opacity", "RGB"[c], 256);
    EXPECT_NEAR(mean.value, 1 - passes * tint[c], test::kStandardErrors * mean.error + kClose);
  }
}

// ---- the transparent film

// Over a backdrop of the environment's radiance B, the image with a transparent film is the image with the
// environment in it: C + (1 - O) B. Both renders trace the same paths. In a medium a path that escapes sees B
// where the film has (1 - O) B on average. Without media all samples are equal, up to the rounding of
// float32: see LightLayersAddUpToTheColour.
TEST(TransparentFilm, OverABackdropIsTheImageWithIt) {
  constexpr double kBackdrop = .1;
  constexpr std::uint64_t kMany = 64;
  for (const char* integrator : {"volpath", "volpath_distant_mis", "path", "whitted"})
    for (const int media : {0, 1, 2}) {
      SceneBuilder builder = hall(media > 0, media > 1);
      builder.scene.integrator.name = integrator;
      const Picture whole(builder, {}, kMany), film(transparent(builder), {"opacity"}, kMany);
      const double half = static_cast<double>(kMany) / 2, pixels = static_cast<double>(whole.pixels());
      for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0, squares = 0, largest = 0, opacity = 0;
        for (std::size_t i = 0; i < whole.pixels(); ++i) {
          std::array<double, 2> d{};
          for (std::size_t h = 0; h < 2; ++h) {
            const double o = film.sum(fmt::format("aov.opacity.{}.{}", "AB"[h], "RGB"[c]), i) / half;
            d[h] = (whole.half(h, c, i) - film.half(h, c, i)) / half - (1 - o) * kBackdrop;
            opacity += o / 2 / pixels;
          }
          sum += (d[0] + d[1]) / 2;
          squares += (d[0] - d[1]) * (d[0] - d[1]) / 4;
          largest = std::max(largest, std::abs(d[0] + d[1]) / 2 / (whole.whole(c, i) / kMany));
        }
        const std::string where = fmt::format("{} {} {}", integrator, media, c);
        EXPECT_LE(std::abs(sum), test::kStandardErrors * std::sqrt(squares) + 0x1p-16 * pixels) << where;
        if (media == 0) {
          EXPECT_LE(largest, 0x1p-16) << where;
        }
        EXPECT_GT(opacity, .1) << where;
        EXPECT_LT(opacity, .9) << where;
      }
    }
}

TEST(TransparentFilm, KeepsLampsFiresAndReflectionsOfTheEnvironment) {
  SceneBuilder lamp = wall();
  lamp.scene.shapes[0].emitter = AreaEmitter{lamp.texture({3, 2, 1})};
  EXPECT_NEAR(Picture(transparent(lamp), {}).whole(0, 0), 3.3 * kSamples, 64 * kClose);

  SceneBuilder mirror = wall();
  mirror.scene.shapes[0].bsdf = mirror.mirror();
  EXPECT_EQ(Picture(transparent(mirror), {}).whole(0, 0), kSamples);

  SceneBuilder fire = wall();
  remove_wall(fire);
  const MediumIndex flame = fire.homogeneous({0, 0, 0}, {0, 0, 0});
  fire.set_emission(flame, {1, 2, 3});
  fill(fire, flame);
  EXPECT_NEAR(Picture(transparent(fire), {}).whole(1, 0), 4 * kSamples, 16 * kSlabClose * kSamples);
}

// ---- what the camera does not see

TEST(Visibility, CameraSeesPastAHiddenShapeAndMirrorsDoNot) {
  SceneBuilder builder = wall();
  builder.scene.emitters.clear();
  Shape& lamp = builder.lamp(DiskShape{}, translate({.4, .6, 2}) * test::scale(.01), {7, 7, 7});
  const std::vector<std::string> layers = {"alpha", "depth", "shape_id"};
  EXPECT_EQ(Picture(builder, layers).whole(0, 0), 7 * kSamples);
  lamp.emitter->two_sided = true;
  lamp.visible_camera = false;

  const Picture past(builder, layers);
  EXPECT_GT(past.whole(0, 0), 0) << "it still lights the wall";
  EXPECT_LT(past.whole(0, 0), .1 * kSamples);
  EXPECT_NEAR(past.of_hits("aov.depth.Z"), 5, 8 * kClose);
  EXPECT_EQ(past.ids(0).slots[0].id, cryptomatte_id("shape_0"));

  // A mirror turns the view from -y to -z, down to the lamp.
  builder.scene.shapes[1].to_world = translate({0, 0, 1}) * test::scale(.5);
  builder.shape(RectangleShape{}, translate({0, 0, 3}) * test::rotate_x(-135), builder.mirror());
  builder.look({0, 3, 3}, {0, 0, 3}, 1e-3);
  EXPECT_EQ(Picture(builder, layers).whole(0, 0), 7 * kSamples);
}

// Hidden shapes cast the shadows that they cast when they are visible: next to them the image keeps its bits.
TEST(Visibility, HiddenShapesKeepTheirShadows) {
  const auto shaded = [](bool visible, const char* integrator) {
    SceneBuilder builder = hall(false, false);
    builder.scene.integrator.name = integrator;
    builder.shape(SphereShape{}, translate({-1, 0, -.4}) * test::scale(.5), builder.diffuse(.5))
        .visible_camera = visible;
    return Picture(builder, {"coverage", "shape_id"}, 4);
  };
  for (const char* integrator : {"volpath", "path", "whitted", "volpath_distant_mis"}) {
    const Picture visible = shaded(true, integrator), hidden = shaded(false, integrator);
    int beside = 0;
    for (std::size_t i = 0; i < visible.pixels(); ++i) {
      const auto slots = visible.ids(0, i).slots;
      if (std::ranges::any_of(slots, [](const IdSlot& s) { return s.id == cryptomatte_id("shape_3"); }))
        continue;
      ++beside;
      for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(hidden.whole(c, i), visible.whole(c, i)) << integrator;
    }
    EXPECT_GT(beside, 24);
  }
}

// A camera ray that passes a hidden body is in the medium that fills it, until it leaves on the other side.
TEST(Visibility, MediumInAHiddenBodyIsSeen) {
  SceneBuilder builder = wall();
  remove_wall(builder);
  Shape& body = builder.container(CubeShape{}, translate({0, 0, 2}), builder.diffuse(.5),
                                  builder.homogeneous({1, 1, 1}, {0, 0, 0}));
  EXPECT_EQ(mean_of(Picture(transparent(builder), kOfOpacity), "alpha", 'A').value, 1);
  body.visible_camera = false;
  EXPECT_NEAR(mean_of(Picture(transparent(builder), kOfOpacity), "alpha", 'A').value, 1 - std::exp(-2.),
              kSlabClose);
  // The medium absorbs: each sample is 1 or 0.
  EXPECT_NEAR(Picture(builder, {}, 256).whole(0, 0) / 256, std::exp(-2.), 5 * std::sqrt(.12 / 256));
}

TEST(Visibility, CameraSeesOnlyTheLightsThatAreFlaggedSo) {
  const auto seen = [](bool sky, bool sun) {
    SceneBuilder builder({2, 2});
    builder.environment(.25);
    std::get<ConstantEmitter>(builder.scene.emitters[0]).visible_camera = sky;
    // pi sin^2(30 degrees) of irradiance: radiance 1
    DirectionalEmitter disk{{0, 0, -1}, {test::kPi / 4, test::kPi / 4, test::kPi / 4}, 30};
    disk.visible_camera = sun;
    builder.scene.emitters.emplace_back(disk);
    builder.look({0, 0, 0}, {0, 0, 1}, 1e-3, {0, 1, 0});
    return Picture(builder, {"alpha"}).whole(0, 0) / kSamples;
  };
  EXPECT_NEAR(seen(true, true), 1.25, kClose);
  EXPECT_NEAR(seen(false, true), 1, kClose);
  EXPECT_EQ(seen(true, false), .25);
  EXPECT_EQ(seen(false, false), 0);
}

TEST(Holdout, IsAHoleThatHidesWhatIsBehind) {
  SceneBuilder builder = wall();
  builder.lamp(RectangleShape{}, translate({0, 0, -1}) * test::scale(3));
  builder.scene.shapes[0].holdout = true;
  builder.scene.shapes[0].emitter = AreaEmitter{builder.texture({3, 2, 1})};

  const Picture bare(builder, {"alpha", "opacity", "coverage"});

  EXPECT_EQ(bare.whole(0, 0), 0);
  EXPECT_EQ(mean_of(bare, "alpha", 'A').value, 0);
  EXPECT_EQ(bare.of_all("aov.coverage.A"), 1) << "AOVs of surfaces show it";

  fill(builder, builder.homogeneous({.5, .5, .5}, {.9, .9, .9}));
  const Picture fogged(builder, kOfOpacity, 64);
  EXPECT_GT(fogged.whole(0, 0), 0) << "light that the fog in front scatters";
  EXPECT_NEAR(mean_of(fogged, "alpha", 'A', 64).value, 1 - std::exp(-1.), kSlabClose);
}

TEST(Holdout, BehindAMaskIsSeenThroughIt) {
  SceneBuilder builder = wall();
  builder.scene.shapes[0].holdout = true;
  const BsdfIndex paper = builder.diffuse(.5);
  builder.shape(RectangleShape{}, translate({0, 0, 1}) * test::scale(2),
                builder.bsdf(MaskBsdf{builder.texture({.25, .25, .25}), paper}));

  const Picture p(builder, {"alpha"}, 256);

  EXPECT_NEAR(p.sum("aov.alpha.A.A", 0) + p.sum("aov.alpha.B.A", 0), 64, 2);  // as in OfAMaskIsItsOpacity
}

}  // namespace
}  // namespace ls::render
