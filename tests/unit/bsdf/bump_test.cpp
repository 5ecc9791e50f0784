// Bump maps: slopes of images, and the normals that follow from them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/bsdf/materials.h"

namespace ls::render::test {
namespace {

ImageData random_image(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  ImageData d;
  d.width = width;
  d.height = height;
  d.channels = channels;
  std::mt19937 rng(7);
  for (std::uint32_t i = 0; i < width * height * channels; ++i)
    d.f32.push_back(static_cast<float>(rng() >> 8) * 0x1p-24f);
  return d;
}
// An image of the heights 1 + a x + b y at the centres of the texels, with x and y from 0 to 1.
ImageData ramp(std::uint32_t width, std::uint32_t height, float a, float b) {
  ImageData d;
  d.width = width;
  d.height = height;
  d.channels = 1;
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x)
      d.f32.push_back(1 + a * (x + .5f) / width + b * (y + .5f) / height);
  return d;
}

struct Bumped {
  Scene scene;
  TextureTable textures;
  BsdfTable bsdfs;
  TextureIndex image;

  Bumped(Scene inner, const ImageData& heights, const BitmapTexture& how = {}, double scale = 1)
      : scene(std::move(inner)) {
    scene.assets.push_back({"heights.exr", {}, 0});
    BitmapTexture t = how;
    t.file = {0};
    scene.textures.emplace_back(t);
    image = {static_cast<std::uint32_t>(scene.textures.size() - 1)};
    if (!scene.bsdfs.empty()) {
      BumpMapBsdf b{image, scale, last(scene)};
      b.flip_invalid_normals = b.use_shadowing_function = false;
      add(scene, b);
    }
    auto built = TextureTable::build(scene, [&](const Asset&) -> Result<ImageData> { return heights; });
    EXPECT_TRUE(built);
    textures = std::move(*built);
    auto table = BsdfTable::build(scene, textures);
    EXPECT_TRUE(table);
    bsdfs = std::move(*table);
  }
};

TEST(BumpMap, SlopesAreTheDerivativesOfTheLuminance) {
  std::mt19937 rng(3);
  const auto uniform = [&] { return static_cast<float>(rng() >> 8) * 0x1p-24f; };
  for (const std::uint32_t channels : {1u, 3u})
    for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
      BitmapTexture how;
      how.wrap = wrap;
      how.raw = true;
      how.to_uv.m = {2, .5, .1, -.25, 1.5, 0, 0, 0, 1};
      const Bumped b({}, random_image(6, 4, channels), how);
      for (int i = 0; i < 500; ++i) {
        const V2 uv(4 * uniform() - 2, 4 * uniform() - 2);
        // Central differences of a bilinear patch are exact along each axis. At the edges of patches they are
        // not, so such places, a small share, are skipped. Heights are accurate to 1e-7, over steps of 1e-3.
        constexpr float h = 5e-4f;
        const auto at = [&](float u, float v) { return luminance(b.textures.eval(b.image, {u, v})); };
        const V2 slope = b.textures.slope(b.image, uv);
        const float du = (at(uv.x + h, uv.y) - at(uv.x - h, uv.y)) / (2 * h),
                    dv = (at(uv.x, uv.y + h) - at(uv.x, uv.y - h)) / (2 * h);
        const bool edge = std::abs(at(uv.x + h, uv.y) + at(uv.x - h, uv.y) - 2 * at(uv.x, uv.y)) > 1e-5f ||
                          std::abs(at(uv.x, uv.y + h) + at(uv.x, uv.y - h) - 2 * at(uv.x, uv.y)) > 1e-5f;
        if (edge) continue;
        // The shear of to_uv makes the patches curved along u: by at most 12 texels^2 h.
        ASSERT_NEAR(slope.x, du, .05) << i;
        ASSERT_NEAR(slope.y, dv, .05) << i;
      }
    }
}

TEST(BumpMap, OnlyBilinearBitmapsHaveSlopes) {
  BitmapTexture nearest;
  nearest.filter = TextureFilter::nearest;
  const Bumped b({}, random_image(4, 4, 1), nearest);
  EXPECT_EQ(b.textures.slope(b.image, {.3f, .6f}), V2(0, 0));
}

// With the height h = a u and a dp/du of length l, the surface rises by a / l per unit of length.
TEST(BumpMap, ConstantSlopeTiltsTheNormalLikeAPlane) {
  const Scene gold = rough_metal(Microfacet::beckmann, .3, .3, kGoldEta, kGoldK);
  for (const double scale : {1., .25, -2.}) {
    const Bumped b(gold, ramp(8, 8, .3f, .8f), {}, scale);
    // dp/du = 2 s and dp/dv = -.5 s + 1.5 t. The gradient g of the heights on the surface solves g . dp/du =
    // .3 scale and g . dp/dv = .8 scale.
    const UvPoint at({.5f, .5f}, {2, 0, .7f}, {-.5f, 1.5f, -.1f});
    const double gs = .3 * scale / 2, gt = (.8 * scale + .5 * gs) / 1.5;
    const V3 n = normalize(V3(static_cast<float>(-gs), static_cast<float>(-gt), 1));
    const auto turned_gold = bench(turned(gold, n));
    for (const double mu : {.9, .6})
      for (const double nu : {.95, .5}) {
        const V3 wo = direction(mu, 1), wi = direction(nu, 3);
        const BsdfEval e = b.bsdfs.eval(last(b.scene), at, wo, wi), t = turned_gold->eval(wo, wi);
        // The colour of the normal map is rounded to 6e-8. In the tail this changes the slope of the half
        // vector by up to 1 / cos^2 = 10 times as much. Divided by alpha = .3, and times 2 sqrt(e) = 13 in
        // the farthest tail, it bounds the relative error.
        EXPECT_NEAR(e.f_cos.x, t.f_cos.x, 2e-4 * t.f_cos.x) << scale;
        EXPECT_NEAR(e.pdf, t.pdf, 2e-4 * t.pdf);
        const auto s = b.bsdfs.sample(last(b.scene), at, wo, .3f, {.4f, .7f});
        ASSERT_TRUE(s);
        EXPECT_NEAR(b.bsdfs.eval(last(b.scene), at, wo, s->wi).pdf, s->pdf, 1e-4 * s->pdf);
      }
  }
}

TEST(BumpMap, RisesWithTheHeightsWhicheverWayUAndVRun) {
  const Bumped b(diffuse({1, 1, 1}), ramp(8, 8, 1, 0));
  const UvPoint right({.5f, .5f}, {1, 0, 0}, {0, 1, 0}), mirrored({.5f, .5f}, {1, 0, 0}, {0, -1, 0});
  const V3 up(0, 0, 1), left = direction(.7, M_PI), uphill = direction(.7, 0);
  for (const UvPoint& at : {right, mirrored}) {
    // The surface rises towards +s, so it faces -s.
    EXPECT_GT(b.bsdfs.eval(last(b.scene), at, up, left).f_cos.x,
              2 * b.bsdfs.eval(last(b.scene), at, up, uphill).f_cos.x);
  }
}

TEST(BumpMap, IsFlatWithoutTextureDirections) {
  const Bumped b(diffuse({.5, .5, .5}), ramp(8, 8, 1, 1));
  const UvPoint pole({.5f, .5f}, {0, 0, 0}, {1, 0, 0});
  const V3 up(0, 0, 1);
  EXPECT_FLOAT_EQ(b.bsdfs.eval(last(b.scene), pole, up, up).f_cos.x, .5f * kInvPi);
}

// A bump map inside a normal map: it must be evaluated in the frame that the normal map rotates.
TEST(BumpMap, CanBeNestedInOtherMaps) {
  const Scene gold = rough_metal(Microfacet::beckmann, .4, .4, kGoldEta, kGoldK);
  Bumped b(gold, ramp(8, 8, .5f, 0));
  Scene& s = b.scene;
  const V3 tilt = direction(.9, 2);
  const BsdfIndex bump = last(s);
  NormalMapBsdf outer{texture(s, Rgb{.5 + .5 * tilt.x, .5 + .5 * tilt.y, .5 + .5 * tilt.z}), bump};
  outer.flip_invalid_normals = outer.use_shadowing_function = false;
  const BsdfIndex nested = add(s, outer);
  auto textures =
      TextureTable::build(s, [&](const Asset&) -> Result<ImageData> { return ramp(8, 8, .5f, 0); });
  ASSERT_TRUE(textures);
  auto table = BsdfTable::build(s, *textures);
  ASSERT_TRUE(table);
  EXPECT_TRUE(table->reads_slopes(nested) && table->anisotropic(nested) && table->reads_uv(nested));
  const Frame frame = Frame::from_tangent(tilt, V3(1, 0, 0));
  const UvPoint at({.5f, .5f}, {1, 0, 0}, {0, 1, 0});
  const V3 wo = direction(.8, 1), wi = direction(.7, 4);
  const BsdfEval e = table->eval(nested, at, wo, wi),
                 inner = table->eval(bump, at.seen_in(frame), frame.to_local(wo), frame.to_local(wi));
  EXPECT_NEAR(e.f_cos.x, inner.f_cos.x, 1e-5 * inner.f_cos.x);
}

// Only differences of heights count, so that a map may be shifted below 0.
TEST(BumpMap, HeightsBelowZeroAreHeights) {
  ImageData low = ramp(8, 8, .5f, -.25f);
  for (float& h : low.f32) h -= 1.25f;
  const Bumped above(diffuse({.5, .5, .5}), ramp(8, 8, .5f, -.25f)), below(diffuse({.5, .5, .5}), low);
  ASSERT_EQ(below.textures.clamped_texels(), 0u);
  for (const V2 uv : {V2(.2f, .3f), V2(.5f, .5f), V2(.7f, .4f)}) {
    const V2 a = above.textures.slope(above.image, uv), b = below.textures.slope(below.image, uv);
    // A height of up to 2 is rounded to 1.2e-7, and a slope is a difference of two times 8 texels.
    EXPECT_NEAR(a.x, b.x, 4e-6);
    EXPECT_NEAR(a.y, b.y, 4e-6);
  }
}

// One image as colour and as heights: as a colour it is not negative.
TEST(BumpMap, MayUseAColourImage) {
  Scene s = diffuse({.5, .5, .5});
  s.assets.push_back({"heights.exr", {}, 0});
  s.textures.emplace_back(BitmapTexture{.file = {0}});
  const TextureIndex image{static_cast<std::uint32_t>(s.textures.size() - 1)};
  const BsdfIndex coloured = add(s, DiffuseBsdf{image});
  add(s, BumpMapBsdf{image, 1, coloured});
  ImageData low = ramp(8, 8, .5f, 0);
  for (float& h : low.f32) h -= 1.25f;

  const auto textures = TextureTable::build(s, [&](const Asset&) -> Result<ImageData> { return low; });

  ASSERT_TRUE(textures) << textures.error().message;
  EXPECT_EQ(textures->eval(image, {.1f, .5f}).x, 0);
  // At u = .1 all heights are below 0.
  EXPECT_NEAR(textures->slope(image, {.1f, .5f}).x, .5, 4e-6);
  EXPECT_GT(textures->clamped_texels(), 0u);
}

}  // namespace
}  // namespace ls::render::test
