// Many interfaces one behind the other, shapes that are none, instances, textures, cameras.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "cli/cases/case.h"
#include "cli/cases/checks.h"
#include "cli/cases/stages.h"
#include "common/image/exr_file.h"

namespace ls::cases {
namespace {

// So many plates of glass between a white wall and the eye, straight on.
SceneKit plates(int m) {
  SceneKit kit;
  const BsdfIndex glass = kit.glass(1.5);
  for (int i = 0; i < m; ++i) {
    kit.shape(RectangleShape{}, translate({0, 0, 2. * i + 1}) * scale(4 * m + 10), glass);
    kit.shape(RectangleShape{}, translate({0, 0, 2. * i}) * rotate_x(180) * scale(4 * m + 10), glass);
  }
  kit.shape(RectangleShape{}, translate({0, 0, -2}) * scale(4 * m + 10), kit.diffuse(0)).emitter =
      AreaEmitter{kit.texture(rgb(1))};
  kit.look({0, 0, 2. * m + 5}, {0, 0, 0}, 1e-4, {0, 1, 0});
  return kit;
}
SceneKit floor_behind(int boundaries) {
  SceneKit kit;
  kit.shape(RectangleShape{}, scale(30), kit.diffuse(.5));
  kit.scene.emitters.push_back(PointEmitter{{3, 0, 16}, {300, 200, 100}});
  const BsdfIndex null = kit.null();
  for (int i = 0; i < boundaries; ++i)
    kit.shape(RectangleShape{}, translate({0, 0, 1 + .01 * i}) * scale(40), null);
  kit.look({0, -2, 20}, {0, 0, 0}, 20, {0, 1, 0});
  return kit;
}

void stacks(Table& t) {
  const double r = .04;
  for (const int m : {1, 10, 100})
    t.mean(fmt::format("N42-plates-{}", m), "N42 7.6g",
           "A stack of m plates lets (1 - r) / (1 + (2 m - 1) r) pass.", [=] { return plates(m); },
           grey((1 - r) / (1 + (2 * m - 1) * r)), {.band = m < 100 ? .003 : .02, .slow = m > 1});
  t.same(
      "N42-null-interfaces", "N42",
      "A thousand boundaries of nothing change nothing but that each moves a ray aside by 16 last places, a "
      "thousandth of the scene in all.",
      [] { return floor_behind(1000); }, [] { return floor_behind(0); },
      {.band = .002, .slack = 1e-3, .slow = true});
}

// ---- shapes that are none, and instances
SceneKit mesh(const std::string& more) {
  SceneKit kit;
  MeshShape m;
  m.file =
      text_file(kit, "mesh.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\n" + more + "f 1 3 4\n");
  kit.shape(m, scale(2), kit.diffuse(.5));
  kit.environment();
  kit.look({0, -4, 3}, {0, 0, 0}, 40);
  return kit;
}
SceneKit placed(bool as_instance, const Transform& at) {
  SceneKit kit;
  const BsdfIndex b = kit.bsdf(DiffuseBsdf{kit.texture({.75, .5, .25})});
  kit.shape(RectangleShape{}, translate({0, 0, -1.5}) * scale(6), kit.diffuse(.5));
  Shape& s = kit.shape(CubeShape{}, as_instance ? Transform{} : at, b);
  if (as_instance) {
    s.group = SceneKit::push<GroupTag>(kit.scene.groups, ShapeGroup{});
    kit.scene.instances.push_back(Instance{*s.group, at});
  }
  kit.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, 1, 1}});
  kit.environment(.25);
  kit.look({0, -6, 3}, {0, 0, 0}, 30);
  return kit;
}

void shapes(Table& t) {
  t.exact("N40-degenerate-triangles", "N40",
          "Triangles without area are left out, and counted; nothing else changes.",
          [](const Bench& b) -> Figure {
            const SceneKit with = mesh("f 1 1 2\nf 2 3 2\nf 4 4 4\n");
            Figure f = same_bits(b, with, mesh(""), 4);
            const auto p = shoot(with, 2, b.seed, b.threads);
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
  t.exact("N44-singular", "N44", "An instance that is pressed flat is refused.", [](const Bench& b) {
    return refused(b, placed(true, scale(1, 1, 0)), {"to_world", "no inverse"});
  });
}

// ---- textures
SceneKit painted(float texel, const UvTransform& to_uv = {}, int side = 1) {
  SceneKit kit;
  ExrPicture picture;
  picture.size = {side, side};
  for (const char* c : {"R", "G", "B"})
    picture.channels[c] = ExrFloat{std::vector<float>(static_cast<std::size_t>(side * side), texel)};
  const auto bytes = write_exr(picture);
  BitmapTexture image;
  if (bytes)
    image.file = text_file(kit, "paint.exr", {reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  image.to_uv = to_uv;
  kit.shape(RectangleShape{}, scale(50),
            kit.bsdf(DiffuseBsdf{SceneKit::push<TextureTag>(kit.scene.textures, image)}));
  kit.environment();
  kit.look({0, -1, 5}, {0, 0, 0}, 20, {0, 1, 0});
  return kit;
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
  t.exact("N45-negative-texel", "N45", "Negative texels are black and counted.",
          [](const Bench& b) -> Figure {
            const auto p = shoot(painted(-.5f), 4, b.seed, b.threads);
            if (!p) return {.why = p.error().message};
            Figure f = every_value(b, painted(-.5f), 4, grey(0), 0);
            if (p->clamped_inputs == 0) f.why = "they were not counted";
            return f;
          });
  t.exact("N46-normal-of-nothing", "N46",
          "A normal map whose normals are (0, 0, 0) leaves a healthy surface.", [](const Bench& b) -> Figure {
            SceneKit kit;
            const TextureIndex none = kit.texture(rgb(.5));
            kit.shape(RectangleShape{}, scale(9), kit.bsdf(NormalMapBsdf{none, kit.diffuse(.5)}));
            kit.environment();
            kit.look({0, -1, 5}, {0, 0, 0}, 20, {0, 1, 0});
            const auto p = shoot(kit, 16, b.seed, b.threads);
            if (!p) return {.why = p.error().message};
            return {.expected = .25,
                    .got = p->mean(0, 1),
                    .tolerance = .26,
                    .unhealthy = p->health.nonfinite + p->health.negative};
          });
}

// ---- cameras
void cameras(Table& t) {
  t.exact("N47-lens-of-nothing", "N47",
          "A lens of radius 0 is a pinhole, bit for bit, wherever it is focused.", [](const Bench& b) {
            SceneKit lens = placed(false, {});
            const SceneKit pinhole = lens;
            lens.scene.sensor.aperture_radius = 0;
            lens.scene.sensor.focus_distance = 1e-3;
            return same_bits(b, lens, pinhole, 8);
          });
  for (const double fov : {179.9, .01, 1e-9})
    t.exact(fmt::format("N48-fov-{:g}", fov), "N48", "A white sky is white in any field of view.",
            [=](const Bench& b) {
              SceneKit kit;
              kit.shape(SphereShape{}, translate({0, 0, -1e4}), kit.diffuse(.5));
              kit.environment();
              kit.look({0, 0, 0}, {0, 0, 1}, fov, {0, 1, 0});
              return every_value(b, kit, 4, grey(1), 0);
            });
  t.exact("N48-crop", "N48", "A crop is that part of the frame, bit for bit.", [](const Bench& b) -> Figure {
    SceneKit whole = placed(false, {});
    whole.scene.film.filter = TentFilter{2};
    SceneKit part = whole;
    part.scene.film.crop_offset = {5, 3};
    part.scene.film.crop_size = {4, 6};
    const auto w = shoot(whole, 8, b.seed, b.threads), p = shoot(part, 8, b.seed, b.threads);
    if (!w || !p) return {.why = "one of the scenes is refused"};
    Figure f;
    for (std::size_t y = 0; y < 6; ++y)
      for (std::size_t x = 0; x < 4; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          f.got += w->mean((y + 3) * 16 + x + 5, c) != p->mean(y * 4 + x, c);
    return f;
  });
}

}  // namespace

void add_interfaces(Table& t) {
  stacks(t);
  shapes(t);
  textures(t);
  cameras(t);
}

}  // namespace ls::cases
