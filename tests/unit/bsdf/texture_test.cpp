#include "worker/render/texture/texture.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "core/scene/limits.h"
#include "worker/render/texture/texels.h"

namespace ls::render {
namespace {

using testing::HasSubstr;

// An image whose texel (x, y) has the value (x, y, 1), with y counted from the top.
ImageData ramp() {
  ImageData image{4, 4, 3, {}, {}, false};
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) image.f32.insert(image.f32.end(), {float(x), float(y), 1.f});
  return image;
}

TextureTable table(const Scene& scene, ImageData image) {
  auto t = TextureTable::build(scene, [&](const Asset&) { return Result<ImageData>(image); });
  EXPECT_TRUE(t.has_value()) << t.error().message;
  return std::move(*t);
}
std::string build_error(const Scene& scene, ImageData image = ramp()) {
  auto t = TextureTable::build(scene, [&](const Asset&) { return Result<ImageData>(image); });
  return t ? "" : t.error().message;
}

Scene with(const Texture& t) {
  Scene s;
  s.assets.push_back({"wood.png", {}, 1});
  s.textures.push_back(t);
  return s;
}

// Values of Mitsuba 3.9.1 for the same image at these coordinates.
const V2 kUv[] = {{.1f, .1f}, {.9f, .1f}, {.125f, .125f}, {0, 0}, {1, 1}, {1.3f, -.4f}, {-.2f, 2.6f}};

struct Expected {
  TextureFilter filter;
  Wrap wrap;
  V2 value[7];
};
const Expected kExpected[] = {
    {TextureFilter::nearest, Wrap::repeat, {{0, 0}, {3, 0}, {0, 0}, {0, 0}, {0, 0}, {1, 2}, {3, 2}}},
    {TextureFilter::nearest, Wrap::mirror, {{0, 0}, {3, 0}, {0, 0}, {0, 0}, {3, 3}, {2, 1}, {0, 2}}},
    {TextureFilter::nearest, Wrap::clamp, {{0, 0}, {3, 0}, {0, 0}, {0, 0}, {3, 3}, {3, 0}, {0, 3}}},
    {TextureFilter::bilinear,
     Wrap::repeat,
     {{.3f, .3f}, {2.7f, .3f}, {0, 0}, {1.5f, 1.5f}, {1.5f, 1.5f}, {.7f, 1.9f}, {2.7f, 1.9f}}},
    {TextureFilter::bilinear,
     Wrap::mirror,
     {{0, 0}, {3, 0}, {0, 0}, {0, 0}, {3, 3}, {2.3f, 1.1f}, {.3f, 1.9f}}},
    {TextureFilter::bilinear, Wrap::clamp, {{0, 0}, {3, 0}, {0, 0}, {0, 0}, {3, 3}, {3, 0}, {0, 3}}}};

// Coordinates are scaled by 4, so their float32 error is 4 x 2.6 x 2^-24, times a slope of 3 across the edge
// of the repeated image.
constexpr float kUvError = 4e-6f;

TEST(Bitmap, FiltersAndWrapsAsMitsubaDoes) {
  for (const Expected& e : kExpected) {
    const TextureTable t = table(with(BitmapTexture{{0}, e.filter, e.wrap, true, {}}), ramp());
    for (int i = 0; i < 7; ++i) {
      const C3 c = t.eval({0}, kUv[i]);
      EXPECT_NEAR(c.x, e.value[i].x, kUvError) << i;
      EXPECT_NEAR(c.y, e.value[i].y, kUvError) << i;
      EXPECT_EQ(c.z, 1);
    }
  }
}

UvTransform turned() {  // translate(.25, .1) rotate(30) scale(2, 3)
  UvTransform t;
  t.m = {std::sqrt(3.), -1.5, .25, 1, 1.5 * std::sqrt(3.), .1, 0, 0, 1};
  return t;
}

TEST(Bitmap, TransformsCoordinatesAsMitsubaDoes) {
  const TextureTable t =
      table(with(BitmapTexture{{0}, TextureFilter::bilinear, Wrap::repeat, true, turned()}), ramp());
  const V2 expected[] = {{.59282f, 1.33923f}, {2.13538f, .53923f}, {.61603f, 1.69904f}, {.5f, .3f},
                         {1.4282f, 2.2923f},  {.28001f, .94308f},  {1.45692f, 2.11999f}};
  for (int i = 0; i < 7; ++i) {
    EXPECT_NEAR(t.eval({0}, kUv[i]).x, expected[i].x, 5e-5f)
        // The expected values have five digits, and coordinates are up to 7.
        << i;
    EXPECT_NEAR(t.eval({0}, kUv[i]).y, expected[i].y, 5e-5f) << i;
  }
}

TEST(Bitmap, IsSafeForAnyCoordinate) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
  for (const auto wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp})
    for (const auto filter : {TextureFilter::nearest, TextureFilter::bilinear}) {
      const TextureTable t = table(with(BitmapTexture{{0}, filter, wrap, true, {}}), ramp());
      for (const float u : {1e9f, -1e9f, 1e38f, -1e38f, inf, -inf, nan, -1e-9f, 0x1.fffffep-1f, 1e-45f})
        for (const float v : {.5f, u}) {
          const C3 c = t.eval({0}, {u, v});
          EXPECT_TRUE(c.x >= 0 && c.x <= 3 && c.y >= 0 && c.y <= 3) << u << " " << v;
        }
    }
}

TEST(Bitmap, DecodesSrgbBeforeFilteringUnlessRaw) {
  const ImageData image{2, 1, 1, {0, 255}, {}, true};
  const TextureTable cooked = table(with(BitmapTexture{{0}}), image);
  const TextureTable raw = table(with(BitmapTexture{{0}, TextureFilter::bilinear, Wrap::repeat, true, {}}),
                                 {2, 1, 1, {0, 128}, {}, true});

  EXPECT_EQ(cooked.eval({0}, {.25f, .5f}), C3(0));
  EXPECT_EQ(cooked.eval({0}, {.75f, .5f}), C3(1));
  EXPECT_EQ(cooked.eval({0}, {.5f, .5f}), C3(.5f));  // filtering before decoding would give .2140
  EXPECT_EQ(raw.eval({0}, {.75f, .5f}), C3(128.f / 255));
}

TEST(Bitmap, SrgbIsContinuousAndExactAtItsEnds) {
  EXPECT_EQ(srgb_to_linear(0), 0);
  EXPECT_EQ(srgb_to_linear(1), 1);
  // The rounded constants of the standard leave a gap of 3e-8 between the two pieces.
  EXPECT_NEAR(srgb_to_linear(.04045), srgb_to_linear(std::nextafter(.04045, 1)), 1e-7);
  EXPECT_NEAR(srgb_to_linear(.04045), .0031308, 5e-8);
}

TEST(Bitmap, RefusesTexelsThatAreNotFiniteAndCountsNegativeOnes) {
  ImageData image = ramp();
  image.f32[3 * (4 * 2 + 1)] = std::nanf("");
  EXPECT_THAT(build_error(with(BitmapTexture{{0}}), image), HasSubstr("'wood.png': the texel at x 1, y 2"));
  image.f32[3 * (4 * 2 + 1)] = -1;
  const TextureTable t = table(with(BitmapTexture{{0}, TextureFilter::nearest}), image);
  EXPECT_EQ(t.clamped_texels(), 1u);
  EXPECT_EQ(t.eval({0}, {.3f, .6f}).x, 0);
}

TEST(Bitmap, RefusesAnImageWithoutPixels) {
  EXPECT_THAT(build_error(with(BitmapTexture{{0}}), {0, 0, 3, {}, {}, false}), HasSubstr("no pixels"));
}

TEST(Bitmap, LoadsAFileOnceForAllTextures) {
  Scene s = with(BitmapTexture{{0}});
  s.textures.push_back(BitmapTexture{{0}, TextureFilter::nearest});
  int loads = 0;
  const auto t = TextureTable::build(s, [&](const Asset&) { return ++loads, Result<ImageData>(ramp()); });

  ASSERT_TRUE(t);
  EXPECT_EQ(loads, 1);
  EXPECT_EQ(t->bytes(), 4u * 4 * 3 * sizeof(float));
}

TEST(Bitmap, DecodesAFileOnceForAllUses) {
  Scene s = with(BitmapTexture{{0}});
  for (const bool raw : {true, false, true}) {
    BitmapTexture t{{0}, TextureFilter::nearest};
    t.raw = raw;
    t.channel = Channel::red;
    s.textures.push_back(t);
    t.channel = Channel::all;
    s.textures.push_back(t);
  }
  int loads = 0;
  const auto t = TextureTable::build(s, [&](const Asset&) { return ++loads, Result<ImageData>(ramp()); });

  ASSERT_TRUE(t);
  EXPECT_EQ(loads, 1);
  EXPECT_EQ(t->bytes(), 2u * (4 * 4 * 3 + 4 * 4) * sizeof(float)) << "each way is kept once";
  for (std::uint32_t i = 0; i < s.textures.size(); ++i) {
    const bool one = std::get<BitmapTexture>(s.textures[i]).channel == Channel::red;
    EXPECT_EQ(t->eval({i}, {.6f, .9f}).x, i == 0 ? t->eval({0}, {.6f, .9f}).x : 2.f) << i;
    EXPECT_EQ(t->eval({i}, {.6f, .9f}).z, one ? 2.f : 1.f) << i;
  }
}

TEST(Checkerboard, MatchesMitsuba) {
  const auto board = [](const UvTransform& to_uv) {
    Scene s;
    s.textures = {ConstantTexture{{0, 0, 0}}, ConstantTexture{{1, 1, 1}},
                  CheckerboardTexture{{0}, {1}, to_uv}};
    return table(s, ramp());
  };
  const V2 more[] = {{.5f, .2f}, {.5f, .5f}, {.25f, .1f}, {.50001f, .2f}};
  const auto expect = [&](const UvTransform& to_uv, const std::vector<int>& values) {
    const TextureTable t = board(to_uv);
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_EQ(t.eval({2}, i < 7 ? kUv[i] : more[i - 7]).x, static_cast<float>(values[i])) << i;
    EXPECT_EQ(t.mean({2}), C3(.5f));
    EXPECT_FALSE(t.is_constant({2}));
  };

  expect({}, {0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  expect({{2, 0, 0, 0, 2, 0, 0, 0, 1}}, {0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0});
  expect(turned(), {0, 1, 1, 0, 1, 0, 1, 1, 1, 0, 1});
}

// As in Mitsuba 3.9.1, where eval_1 gives 0.9 if eval gives 0.1.
TEST(Checkerboard, IsInvertedAsANumber) {
  Scene s;
  s.textures = {ConstantTexture{{.1, .1, .1}}, ConstantTexture{{0, 1, 0}}, CheckerboardTexture{{0}, {1}, {}},
                CheckerboardTexture{{2}, {0}, {}}, PeakTexture{{2}}};
  const TextureTable t = table(s, ramp());
  const V2 even(.2f, .2f), odd(.7f, .2f);

  EXPECT_EQ(t.eval({2}, even), C3(.1f));
  EXPECT_EQ(t.eval({2}, odd), C3(0, 1, 0));
  EXPECT_FLOAT_EQ(t.number({2}, even), luminance(C3(0, 1, 0)));
  EXPECT_FLOAT_EQ(t.number({2}, odd), .1f);
  // Nested boards: the even squares of the outer board have its color1, the odd ones its color0, which is a
  // board that is also evaluated as a number.
  EXPECT_FLOAT_EQ(t.number({3}, even), .1f);
  EXPECT_FLOAT_EQ(t.number({3}, odd), .1f);
  EXPECT_EQ(t.eval({3}, even), C3(.1f));
  // A texture in between (here PeakTexture) evaluates the colours of the board.
  EXPECT_FLOAT_EQ(t.number({4}, even), .1f);
  EXPECT_FLOAT_EQ(t.number({4}, odd), 1);
  EXPECT_FLOAT_EQ(t.number({0}, even), .1f);
}

TEST(Checkerboard, RefusesCyclesAndMissingTextures) {
  Scene s;
  s.textures = {CheckerboardTexture{{1}, {1}, {}}, CheckerboardTexture{{0}, {0}, {}}};
  EXPECT_THAT(build_error(s), HasSubstr("circle"));
  s.textures = {CheckerboardTexture{{0}, {7}, {}}};
  EXPECT_THAT(build_error(s), HasSubstr("does not exist"));
  EXPECT_THAT(build_error(with(BitmapTexture{{3}})), HasSubstr("file 3 of 1"));
}

// Textures may be nested as deeply as in files (core/scene/limits.h), and no deeper.
TEST(Checkerboard, MayBeNestedUpToTheReadersLimit) {
  const auto chain = [](int n) {
    Scene s;
    for (std::uint32_t i = 1; i <= static_cast<std::uint32_t>(n); ++i)  // the outermost board first
      s.textures.push_back(CheckerboardTexture{{i}, {i}, {}});
    s.textures.push_back(ConstantTexture{{.5, .5, .5}});
    return s;
  };
  EXPECT_EQ(build_error(chain(scene::kMaxReferenceDepth)), "");
  EXPECT_THAT(build_error(chain(scene::kMaxReferenceDepth + 1)), HasSubstr("deep"));
}

TEST(Bitmap, OpacityIsTheAlphaChannelIfThereIsOne) {
  BitmapTexture opacity{{0}, TextureFilter::nearest};
  opacity.alpha = true;
  const V2 left(.25f, .5f), right(.75f, .5f);
  const TextureTable masks = table(with(opacity), {2, 1, 4, {10, 20, 30, 0, 40, 50, 60, 102}, {}, true});
  EXPECT_EQ(masks.eval({0}, left), C3(0));
  EXPECT_EQ(masks.eval({0}, right), C3(102 / 255.f)) << "linear, whatever the colours are";
  const TextureTable grey = table(with(opacity), {2, 1, 2, {0, 249, 255, 255}, {}, true});
  EXPECT_EQ(grey.eval({0}, left), C3(0)) << "an alpha that hides nothing: the colour is the mask";
  EXPECT_EQ(grey.eval({0}, right), C3(1));
  const TextureTable plain = table(with(opacity), {2, 1, 3, {}, {0, 0, 0, .5f, .5f, .5f}, false});
  EXPECT_EQ(plain.eval({0}, right), C3(.5f));
}

// The image of one texel (.25, .5, .25) whose primaries are those of Rec. 2020, with the matrix to linear
// sRGB.
ImageData wide_colour() {
  ImageData image{1, 1, 3, {}, {.25f, .5f, .25f}, false};
  // ITU-R BT.2087-0, the inverse of the matrix of its annex
  image.to_srgb = {1.660491f, -.587641f, -.072850f, -.124550f, 1.132900f,
                   -.008349f, -.018151f, -.100579f, 1.118730f};
  return image;
}

// The values are those of Mitsuba 3.9.1 for an EXR of these numbers and primaries, with `raw` and without.
TEST(Bitmap, ColoursOfOtherPrimariesBecomeLinearSrgb) {
  for (const bool raw : {false, true}) {
    Scene s = with(BitmapTexture{.file = {0}, .raw = raw});
    s.bsdfs.emplace_back(DiffuseBsdf{{0}});

    const C3 c = table(s, wide_colour()).eval({0}, {.5f, .5f});

    EXPECT_NEAR(c.x, .10309f, 1e-5f);
    EXPECT_NEAR(c.y, .533225f, 1e-5f);
    EXPECT_NEAR(c.z, .224855f, 1e-5f);
  }
}

C3 seen_as(ImageColours colours, const ImageData& image, bool raw = false) {
  Scene s = with(BitmapTexture{.file = {0}, .raw = raw, .colours = colours});
  s.bsdfs.emplace_back(DiffuseBsdf{{0}});
  return table(s, image).eval({0}, {.5f, .5f});
}

TEST(Bitmap, ColourSpaceOfTheSceneReplacesThatOfTheFile) {
  const ImageData plain{1, 1, 3, {}, {.25f, .5f, .25f}, false}, white{1, 1, 3, {}, {1, 1, 1}, false},
      codes{1, 1, 3, {51, 102, 51}, {}, true};
  EXPECT_EQ(seen_as(ImageColours::rec709, wide_colour()), C3(.25f, .5f, .25f));
  EXPECT_EQ(seen_as(ImageColours::rec709, codes), C3(.2f, .4f, .2f)) << "linear, without the curve";
  for (const auto& [image, factor] : {std::pair(plain, 1.f), std::pair(codes, .8f)}) {
    const C3 c = seen_as(ImageColours::rec2020, image);
    // ITU-R BT.2087 has the inverse of this matrix with four digits.
    EXPECT_NEAR(c.x, factor * .10309f, 1e-4f);
    EXPECT_NEAR(c.y, factor * .533225f, 1e-4f);
    EXPECT_NEAR(c.z, factor * .224855f, 1e-4f);
  }
  EXPECT_NEAR(seen_as(ImageColours::srgb, plain).y, .214041f, 1e-6f) << "IEC 61966-2-1 at .5";
  const C3 c = seen_as(ImageColours::acescg, white);
  for (const float v : {c.x, c.y, c.z}) EXPECT_NEAR(v, 1, 1e-6f) << "a white of D60 becomes one of D65";
  EXPECT_EQ(seen_as(ImageColours::acescg, codes, true), C3(.2f, .4f, .2f)) << "`raw` values are no colours";
}

struct Encoded {
  ImageColours colours;
  std::array<float, 3> stored;
  C3 linear;  // in Rec. 709
};
// The linear values are those of OpenColorIO 2.4.2 with its cg-config 2.1.0 of ACES 1.3. Those of Adobe RGB,
// which it does not have, follow from the primaries and the exponent 563/256 of Adobe RGB (1998) in double
// precision.
const Encoded kEncoded[] = {
    {ImageColours::rec2020, {.4f, .5f, .45f}, {.3375933f, .5128725f, .4458786f}},
    {ImageColours::p3_d65, {.4f, .5f, .45f}, {.3775059f, .5042056f, .4470501f}},
    {ImageColours::acescg, {.4f, .5f, .45f}, {.3336579f, .513553f, .4447517f}},
    {ImageColours::aces2065_1, {.4f, .5f, .45f}, {.2672092f, .53246f, .4431202f}},
    {ImageColours::adobe_linear, {.4f, .5f, .45f}, {.3601644f, .5f, .4478536f}},
    {ImageColours::g18_rec709, {.4f, .5f, .45f}, {.1921799f, .2871746f, .237565f}},
    {ImageColours::g22_rec709, {.4f, .5f, .45f}, {.1332085f, .2176376f, .1726106f}},
    {ImageColours::g24_rec709, {.4f, .5f, .45f}, {.1109032f, .1894646f, .147133f}},
    {ImageColours::g22_ap1, {.4f, .5f, .45f}, {.07743052f, .22911f, .1677493f}},
    {ImageColours::adobe, {.4f, .5f, .45f}, {.09966212f, .2177555f, .1707849f}},
    {ImageColours::srgb_ap1, {.4f, .5f, .45f}, {.07925036f, .2250722f, .1659549f}},
    {ImageColours::srgb_p3_d65, {.4f, .5f, .45f}, {.1146092f, .217455f, .1679742f}},
    {ImageColours::acescc, {.45f, .48f, .46f}, {.2005371f, .4201635f, .3059195f}},
    {ImageColours::acescc, {-.31f, -.305f, -.308f}, {2.219279e-5f, 2.83556e-5f, 2.55591e-5f}},
    {ImageColours::acescct, {.45f, .48f, .46f}, {.200536f, .4201621f, .3059185f}},
    {ImageColours::acescct, {.12f, .13f, .125f}, {.003838643f, .005545391f, .004892642f}},
};

// OpenColorIO computes in floats, its curve of ACEScc by a table: relative errors up to 5e-6 were seen
// between its ACEScc and ACEScct, which are the same function there. Matrices rounded to seven digits add
// 1e-6.
constexpr float kOfOpenColorIo = 1e-5f;

TEST(Bitmap, ColoursAreThoseOfOpenColorIo) {
  for (const Encoded& e : kEncoded) {
    SCOPED_TRACE(scene::name_of(e.colours));
    const C3 c = seen_as(e.colours, {1, 1, 3, {}, {e.stored[0], e.stored[1], e.stored[2]}, false});
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(c[k], e.linear[k], kOfOpenColorIo * e.linear[1]);
  }
}

TEST(Bitmap, EncodedBytesAreDecodedLikeFloats) {
  const ImageData bytes{1, 1, 3, {102, 153, 51}, {}, true}, floats{1, 1, 3, {}, {.4f, .6f, .2f}, false};
  for (const Encoded& e : kEncoded) {
    SCOPED_TRACE(scene::name_of(e.colours));
    EXPECT_EQ(seen_as(e.colours, bytes), seen_as(e.colours, floats));
  }
}

TEST(Bitmap, AlphaAndSingleChannelsAreNotEncoded) {
  const ImageData image{1, 1, 4, {}, {.4f, .5f, .45f, .25f}, false};
  BitmapTexture opacity{.file = {0}, .alpha = true, .colours = ImageColours::g22_ap1};
  EXPECT_EQ(table(with(opacity), image).eval({0}, {.5f, .5f}), C3(.25f));
  for (const auto& [channel, value] : {std::pair(Channel::green, .5f), std::pair(Channel::alpha, .25f)}) {
    BitmapTexture one{.file = {0}, .channel = channel, .colours = ImageColours::acescct};
    EXPECT_EQ(table(with(one), image).eval({0}, {.5f, .5f}), C3(value));
  }
}

TEST(Bitmap, NumbersAtTheEndsOfACurveAreFinite) {
  for (const Encoded& e : kEncoded)
    for (const float v : {-1.f, -0.f, 0.f, 1e-40f, 1.f}) {
      SCOPED_TRACE(scene::name_of(e.colours));
      const C3 c = seen_as(e.colours, {1, 1, 3, {}, {v, v, v}, false});
      for (int k = 0; k < 3; ++k) EXPECT_GE(c[k], 0) << v;
    }
  for (const ImageColours aces : {ImageColours::acescc, ImageColours::acescct})
    EXPECT_NEAR(seen_as(aces, {1, 1, 3, {}, {1e30f, 1e30f, 1e30f}, false}).y, 65504, 1)
        << "the largest value of ACEScc";
}

TEST(Bitmap, NumbersAndNormalsAreNotColourConverted) {
  Scene normals = with(BitmapTexture{.file = {0}});
  normals.textures.push_back(ConstantTexture{{.5, .5, .5}});
  normals.bsdfs.emplace_back(DiffuseBsdf{{1}});
  normals.bsdfs.emplace_back(NormalMapBsdf{{0}, {0}});
  EXPECT_EQ(table(normals, wide_colour()).eval({0}, {.5f, .5f}), C3(.25f, .5f, .25f));

  Scene opacity = with(BitmapTexture{.file = {0}, .channel = Channel::green});
  opacity.bsdfs.emplace_back(DiffuseBsdf{{0}});
  EXPECT_EQ(table(opacity, wide_colour()).eval({0}, {.5f, .5f}), C3(.5f));
}

TEST(Bitmap, InvalidPrimariesAffectOnlyColours) {
  ImageData image = wide_colour();
  image.to_srgb->fill(std::numeric_limits<float>::quiet_NaN());
  Scene colours = with(BitmapTexture{.file = {0}});
  colours.bsdfs.emplace_back(DiffuseBsdf{{0}});
  Scene normals = with(BitmapTexture{.file = {0}});
  normals.textures.push_back(ConstantTexture{{.5, .5, .5}});
  normals.bsdfs.emplace_back(DiffuseBsdf{{1}});
  normals.bsdfs.emplace_back(NormalMapBsdf{{0}, {0}});

  EXPECT_EQ(table(normals, image).eval({0}, {.5f, .5f}), C3(.25f, .5f, .25f));
  EXPECT_THAT(build_error(colours, image),
              HasSubstr("'wood.png': the `chromaticities` in its header are those of no colour space"));
}

TEST(Bitmap, GivesOneChannelAsANumber) {
  const ImageData codes{1, 1, 4, {51, 102, 153, 204}, {}, true};
  const std::pair<Channel, float> channels[] = {
      {Channel::red, .2f}, {Channel::green, .4f}, {Channel::blue, .6f}, {Channel::alpha, .8f}};

  for (const auto& [channel, want] : channels) {
    BitmapTexture b{{0}};
    b.channel = channel;
    EXPECT_EQ(table(with(b), codes).eval({0}, {.5f, .5f}), C3(want));
  }
}

TEST(Bitmap, MissingChannelsAreGreyOrOne) {
  BitmapTexture blue{{0}}, alpha{{0}};
  blue.channel = Channel::blue;
  alpha.channel = Channel::alpha;

  EXPECT_EQ(table(with(blue), ImageData{1, 1, 2, {51, 102}, {}, true}).eval({0}, {0, 0}), C3(.2f));
  EXPECT_EQ(table(with(alpha), ImageData{1, 1, 2, {51, 102}, {}, true}).eval({0}, {0, 0}), C3(.4f));
  EXPECT_EQ(table(with(alpha), ramp()).eval({0}, {0, 0}), C3(1));
}

TEST(Product, MultipliesAndClamps) {
  Scene s;
  s.textures = {ConstantTexture{{.5, .25, 1}}, ConstantTexture{{.5, 1, .5}}, ProductTexture{{0}, {1}},
                ProductTexture{{0}, {1}, .25}, ProductTexture{{2}, {1}, .3}};

  const TextureTable t = table(s, ramp());

  EXPECT_EQ(t.eval({2}, {0, 0}), C3(.25f, .25f, .5f));
  EXPECT_EQ(t.mean({2}), C3(.25f, .25f, .5f));
  EXPECT_EQ(t.number({3}, {0, 0}), 1);  // the luminance is at least .25
  EXPECT_EQ(t.number({4}, {0, 0}), 0);  // and below .3
}

// The mean decides how often a light is sampled, and whether it is one at all.
TEST(Product, ClampedProductHasAPositiveMean) {
  Scene s;
  s.textures = {ConstantTexture{{1, 1, 1}}, ConstantTexture{{0, 0, 0}}, CheckerboardTexture{{0}, {1}, {}},
                CheckerboardTexture{{2}, {1}, {}}, ProductTexture{{3}, {0}, .5}};

  const TextureTable t = table(s, ramp());

  EXPECT_EQ(t.mean({4}), C3(.25f));
}

TEST(Product, RefusesCyclesAndMissingTextures) {
  Scene s;
  s.textures = {ProductTexture{{1}, {1}}, ProductTexture{{0}, {0}}};
  EXPECT_THAT(build_error(s), HasSubstr("textures contain each other in a circle"));
  s.textures = {ProductTexture{{0}, {7}}};
  EXPECT_THAT(build_error(s), HasSubstr("names a texture that does not exist"));
  s.textures = {ConstantTexture{}, ProductTexture{{0}, {0}, -1}};
  EXPECT_THAT(build_error(s), HasSubstr("the threshold -1 of a product"));
}

}  // namespace
}  // namespace ls::render
