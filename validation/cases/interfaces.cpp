// Cases of many interfaces in a row, degenerate shapes, instances, textures and cameras.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "validation/fixtures/case.h"
#include "validation/fixtures/checks.h"
#include "validation/fixtures/fixtures.h"

namespace ls::cases {
namespace {

// `m` glass plates between an emitting wall and the camera, which looks at them along their normal.
SceneBuilder plates(int m) {
  SceneBuilder builder;
  const BsdfIndex glass = builder.glass(1.5);
  for (int i = 0; i < m; ++i) {
    builder.shape(RectangleShape{}, translate({0, 0, 2. * i + 1}) * scale(4 * m + 10), glass);
    builder.shape(RectangleShape{}, translate({0, 0, 2. * i}) * rotate_x(180) * scale(4 * m + 10), glass);
  }
  builder.lamp(RectangleShape{}, translate({0, 0, -2}) * scale(4 * m + 10));
  builder.look({0, 0, 2. * m + 5}, {0, 0, 0}, 1e-4, {0, 1, 0});
  return builder;
}
SceneBuilder floor_behind(int boundaries) {
  SceneBuilder builder;
  // A haze of optical depth 2e-4 fills the scene, since pruning removes boundaries that have no medium on
  // either side.
  const MediumIndex haze = builder.homogeneous(rgb(1e-5), rgb(0));
  builder.scene.sensor.medium = haze;
  builder.shape(RectangleShape{}, scale(30), builder.diffuse(.5)).exterior = haze;
  builder.scene.emitters.push_back(PointEmitter{{3, 0, 16}, {300, 200, 100}});
  const BsdfIndex null = builder.null();
  for (int i = 0; i < boundaries; ++i) {
    Shape& s = builder.shape(RectangleShape{}, translate({0, 0, 1 + .01 * i}) * scale(40), null);
    s.interior = s.exterior = haze;
  }
  builder.look({0, -2, 20}, {0, 0, 0}, 20, {0, 1, 0});
  return builder;
}

void stacks(Table& t) {
  const double r = .04;
  for (const int m : {1, 10, 100})
    t.mean(fmt::format("N42-plates-{}", m), "N42 7.6g",
           "A stack of m plates lets (1 - r) / (1 + (2 m - 1) r) pass.", [=] { return plates(m); },
           grey((1 - r) / (1 + (2 * m - 1) * r)),
           {.band = m < 100 ? kBand : .02,
            .why_band = m < 100 ? "" : "paths of hundreds of interfaces, of which a tenth gets through",
            .slow = m > 1});
  t.same(
      "N42-null-interfaces", "N42",
      "A thousand boundaries of nothing change nothing but that each moves a ray aside by 16 last places, a "
      "thousandth of the scene in all.",
      [] { return floor_behind(1000); }, [] { return floor_behind(0); },
      {.band = .002, .slack = 1e-3, .slow = true});
}

// A square as an OBJ file of two triangles. `more` are lines of the file with further faces, placed between
// the two.
SceneBuilder mesh(const std::string& more) {
  SceneBuilder builder;
  MeshShape m;
  m.file =
      builder.asset("mesh.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\n" + more + "f 1 3 4\n");
  builder.shape(m, scale(2), builder.diffuse(.5));
  builder.environment();
  builder.look({0, -4, 3}, {0, 0, 0}, 40);
  return builder;
}
SceneBuilder placed(bool as_instance, const Transform& at, double size = 1) {
  SceneBuilder builder;
  const BsdfIndex b = builder.bsdf(DiffuseBsdf{builder.texture({.75, .5, .25})});
  builder.shape(RectangleShape{}, translate({0, 0, -1.5 * size}) * scale(6 * size), builder.diffuse(.5));
  const Transform place = scale(size) * at;
  Shape& s = builder.shape(CubeShape{}, as_instance ? Transform{} : place, b);
  if (as_instance) {
    s.group = SceneBuilder::push<GroupTag>(builder.scene.groups, ShapeGroup{});
    builder.scene.instances.push_back(Instance{*s.group, place});
  }
  builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, 1, 1}});
  builder.environment(.25);
  builder.look({0, -6 * size, 3 * size}, {0, 0, 0}, 30);
  builder.scene.sensor.near_clip = 1e-6 * size;
  builder.scene.sensor.far_clip = 1e8 * size;
  return builder;
}

void shapes(Table& t) {
  t.exact("N40-degenerate-triangles", "N40",
          "Triangles without area are left out, and counted; nothing else changes.",
          [](const Bench& b) -> Figure {
            const SceneBuilder with = mesh("f 1 1 2\nf 2 3 2\nf 4 4 4\n");
            Figure f = same_bits(b, with, mesh(""), 4);
            const auto p = shoot(with, 2, b);
            if (!p) return {.why = p.error().message};
            if (p->clamped_inputs != 3) f.why = fmt::format("{} were counted, not 3", p->clamped_inputs);
            return f;
          });
  t.exact("N40-index-out-of-range", "N40", "A face of a vertex that is not there is refused.",
          [](const Bench& b) { return refused(b, mesh("f 1 2 9\n"), {"mesh.obj"}); });
  const Transform maps[] = {scale(-1, 1, 1), scale(1e-3, 1, 1), scale(1, 1e-3, 1e-3) * rotate_x(30),
                            scale(2, .5, 1) * rotate_y(40)};
  for (std::size_t i = 0; i < std::size(maps); ++i)
    t.same(
        fmt::format("N44-instance-{}", i), "N44",
        "A box as an instance, mirrored or squeezed, is the box there.",
        [m = maps[i]] { return placed(true, m); }, [m = maps[i]] { return placed(false, m); },
        {.band = .003});
  // In the first two cases the whole scene is scaled by `s`. In the third, only the box is squeezed: its
  // height is multiplied by 1e-6.
  for (const double s : {1e-6, 1e6})
    t.same(
        fmt::format("N44-instance-scaled-{:g}", s), "N44 N4",
        "The scene and its instance at a millionth, and a million.",
        [=] { return placed(true, rotate_x(30), s); }, [] { return placed(true, rotate_x(30)); });
  t.same(
      "N44-instance-squeezed-by-1e6", "N44", "An instance a million times as wide as high is the box there.",
      [] { return placed(true, scale(1, 1, 1e-6)); }, [] { return placed(false, scale(1, 1, 1e-6)); });
  t.exact("N44-squeezed-too-much", "N44", "One that is thinner than what the scene's size leaves is refused.",
          [](const Bench& b) { return refused(b, placed(true, scale(1e6, 1, 1e-6)), {"to_world"}); });
  t.exact("N44-singular", "N44", "An instance that is pressed flat is refused.", [](const Bench& b) {
    return refused(b, placed(true, scale(1, 1, 0)), {"to_world", "no inverse"});
  });
}

// A floor with a square texture image of `side` texels per side, whose texels all have the value `texel`.
SceneBuilder painted(float texel, const UvTransform& to_uv = {}, int side = 1) {
  SceneBuilder builder;
  BitmapTexture image;
  image.file = add_image(builder, SkyImage(side, side, texel), "paint.exr");
  image.to_uv = to_uv;
  builder.shape(RectangleShape{}, scale(50),
                builder.bsdf(DiffuseBsdf{SceneBuilder::push<TextureTag>(builder.scene.textures, image)}));
  builder.environment();
  builder.look({0, -1, 5}, {0, 0, 0}, 20, {0, 1, 0});
  return builder;
}

// A floor, lit by the sun and an environment, with a normal map that is constant: `normal` is the normal as a
// colour, each component mapped from [-1, 1] to [0, 1].
SceneBuilder mapped(const Rgb& normal) {
  SceneBuilder builder;
  builder.shape(RectangleShape{}, scale(9),
                builder.bsdf(NormalMapBsdf{builder.texture(normal), builder.diffuse(.5)}));
  builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, rgb(1)});
  builder.environment();
  builder.look({0, -1, 5}, {0, 0, 0}, 20, {0, 1, 0});
  return builder;
}

void textures(Table& t) {
  for (const double k : {1., 1e9, 1e30})
    t.mean(fmt::format("N45-uv-{:g}", k), "N45",
           "An image of one grey is that grey, wherever it is looked up.",
           [=] {
             return painted(.5f, {{k, 0, k, 0, -k, 3 * k, 0, 0, 1}}, 3);
           },
           grey(.5), {.band = 1e-3});
  t.mean("N45-one-texel", "N45", "So is one of a single texel.", [] { return painted(.5f); }, grey(.5),
         {.band = 1e-3});
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
    t.exact(fmt::format("N45-texel-{}", bad), "N45", "A texel that is no number is refused, with its place.",
            [=](const Bench& b) {
              return refused(b, painted(bad), {"paint.exr", "texel"});
            });
  t.exact("N45-texel-above-1", "N45", "A texel of 3 reflects as one of 1 does, bit for bit.",
          [](const Bench& b) { return same_bits(b, painted(3), painted(1), 16); });
  t.exact("N45-negative-texel", "N45", "Negative texels are black and counted.",
          [](const Bench& b) -> Figure {
            const auto p = shoot(painted(-.5f), 4, b);
            if (!p) return {.why = p.error().message};
            Figure f = every_value(b, painted(-.5f), 4, grey(0), 0);
            if (p->clamped_inputs == 0) f.why = "they were not counted";
            return f;
          });
  t.exact("N46-normal-of-nothing", "N46",
          "A normal map whose normals are (0, 0, 0) is none: the surface's own, bit for bit.",
          [](const Bench& b) {
            return same_bits(b, mapped(rgb(.5)), mapped({.5, .5, 1}), 16);
          });
  t.exact("N46-normal-from-below", "N46",
          "A normal map whose normals point into the surface: nothing lights it.", [](const Bench& b) {
            return every_value(b, mapped({.5, .5, 0}), 16, grey(0), 0);
          });
}

// Compares a cropped frame with the same part of the whole frame. The figure is the number of values (pixels
// times channels) that differ. `radius` is the radius of the tent filter in pixels.
Figure cropped(const Bench& b, double radius) {
  SceneBuilder whole = placed(false, {});
  whole.scene.film.filter = TentFilter{radius};
  SceneBuilder part = whole;
  part.scene.film.crop_offset = {5, 3};
  part.scene.film.crop_size = {4, 6};
  const auto w = shoot(whole, 8, b), p = shoot(part, 8, b);
  if (!w || !p) return {.why = "one of the scenes is refused"};
  Figure f;
  bool any = false;
  for (std::size_t y = 0; y < 6; ++y)
    for (std::size_t x = 0; x < 4; ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        f.got += w->mean((y + 3) * 16 + x + 5, c) != p->mean(y * 4 + x, c);
        any = any || p->mean(y * 4 + x, c) != 0;
      }
  if (!any) f.why = "both frames are black: nothing was compared";
  return f;
}

// A white sky that fills the frame, with a sphere behind the camera.
SceneBuilder sky_only(double fov = 40, FrameSize size = {16, 16}) {
  SceneBuilder builder(size);
  builder.shape(SphereShape{}, translate({0, 0, -1e4}), builder.diffuse(.5));
  builder.environment();
  builder.look({0, 0, 0}, {0, 0, 1}, fov, {0, 1, 0});
  return builder;
}

void cameras(Table& t) {
  t.exact("N47-lens-of-nothing", "N47",
          "A lens of radius 0 is a pinhole, bit for bit, wherever it is focused.", [](const Bench& b) {
            SceneBuilder lens = placed(false, {});
            const SceneBuilder pinhole = lens;
            lens.scene.sensor.aperture_radius = 0;
            lens.scene.sensor.focus_distance = 1e-3;
            return same_bits(b, lens, pinhole, 8);
          });
  for (const double focus : {0., std::numeric_limits<double>::quiet_NaN()})
    t.exact(fmt::format("N47-focus-at-{:g}", focus), "N47", "A lens that is focused nowhere is refused.",
            [=](const Bench& b) {
              SceneBuilder lens = placed(false, {});
              lens.scene.sensor.aperture_radius = .1;
              lens.scene.sensor.focus_distance = focus;
              return refused(b, lens, {"focus_distance"});
            });
  t.exact("N47-lens-wider-than-its-focus", "N47",
          "A lens ten times as wide as its focus is far: the sky stays white.", [](const Bench& b) {
            SceneBuilder builder = sky_only();
            builder.scene.sensor.aperture_radius = 1;
            builder.scene.sensor.focus_distance = .1;
            return every_value(b, builder, 64, grey(1), 0);
          });
  for (const FrameSize size : {FrameSize{10'000, 1}, FrameSize{1, 10'000}})
    t.exact(fmt::format("N48-frame-of-{}x{}", size.width, size.height), "N48",
            "A white sky is white in a frame ten thousand times as long as wide.",
            [=](const Bench& b) { return every_value(b, sky_only(40, size), 2, grey(1), 0); });
  for (const double fov : {179.9, .01, 1e-9})
    t.exact(fmt::format("N48-fov-{:g}", fov), "N48", "A white sky is white in any field of view.",
            [=](const Bench& b) { return every_value(b, sky_only(fov), 4, grey(1), 0); });
  // The second radius is the largest allowed: such a filter is 64 pixels wide, more than the frame and any of
  // its tiles.
  for (const double radius : {2., 32.})
    t.exact(fmt::format("N48-crop-filter-{:g}", radius), "N48",
            "A crop is that part of the frame, bit for bit.",
            [=](const Bench& b) { return cropped(b, radius); });
}

}  // namespace

void add_interfaces(Table& t) {
  stacks(t);
  shapes(t);
  textures(t);
  cameras(t);
}

}  // namespace ls::cases
