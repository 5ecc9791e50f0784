// face_normals, flip_normals and flip_tex_coords of OBJ, PLY and `.serialized` meshes, and polygons of many
// corners: hits are compared with those of Mitsuba 3.9.1.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;

struct Corner {
  std::array<float, 3> p, n;
  std::array<float, 2> uv;
};
using Polygon = std::vector<Corner>;

const Polygon kQuad = {{{0, 0, 0}, {.3f, 0, 1}, {.1f, .2f}},
                       {{2, 0, 0}, {-.1f, .2f, 1}, {.9f, .1f}},
                       {{2, 1, 0}, {0, 0, 1}, {.8f, .7f}},
                       {{0, 1, 0}, {.2f, .2f, 1}, {.2f, .6f}}};

std::string obj(const Polygon& polygon) {
  std::string s, face = "f";
  for (const Corner& c : polygon) s += fmt::format("v {} {} {}\n", c.p[0], c.p[1], c.p[2]);
  for (const Corner& c : polygon)
    s += fmt::format("vt {} {}\nvn {} {} {}\n", c.uv[0], c.uv[1], c.n[0], c.n[1], c.n[2]);
  for (std::size_t i = 1; i <= polygon.size(); ++i) face += fmt::format(" {}/{}/{}", i, i, i);
  return s + face + "\n";
}
std::string ply(const Polygon& polygon) {
  std::string s = fmt::format("ply\nformat ascii 1.0\nelement vertex {}\n", polygon.size());
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "u", "v"})
    s += fmt::format("property float {}\n", name);
  s += "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  std::string face = fmt::format("{}", polygon.size());
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner& c = polygon[i];
    s += fmt::format("{} {} {} {} {} {} {} {}\n", c.p[0], c.p[1], c.p[2], c.n[0], c.n[1], c.n[2], c.uv[0],
                     c.uv[1]);
    face += fmt::format(" {}", i);
  }
  return s + face + "\n";
}
template <class T>
void put(std::string& s, const T& v) {
  s.append(reinterpret_cast<const char*>(&v), sizeof v);
}
// The polygon as a fan of triangles from its first corner, as a `.serialized` file.
std::string serialized(const Polygon& polygon) {
  std::string body;
  put(body, std::uint32_t{0x1 | 0x2 | 0x1000});
  body += std::string("q\0", 2);
  put(body, std::uint64_t{polygon.size()});
  put(body, std::uint64_t{polygon.size() - 2});
  for (const Corner& c : polygon) put(body, c.p);
  for (const Corner& c : polygon) put(body, c.n);
  for (const Corner& c : polygon) put(body, c.uv);
  for (std::uint32_t i = 1; i + 1 < polygon.size(); ++i)
    for (const std::uint32_t k : {0u, i, i + 1}) put(body, k);
  std::string packed(compressBound(body.size()), '\0');
  uLongf size = packed.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size,
                     reinterpret_cast<const Bytef*>(body.data()), body.size()),
            Z_OK);
  std::string file;
  put(file, std::uint16_t{0x041C});
  put(file, std::uint16_t{4});
  file += packed.substr(0, size);
  put(file, std::uint64_t{0});
  put(file, std::uint32_t{1});
  return file;
}

struct Flags {
  bool face_normals = false, flip_normals = false, flip_tex_coords = false, flat_without_normals = false;
};
LightBench bench_of(const std::string& file, MeshFormat format, const Flags& flags) {
  SceneBuilder builder;
  MeshShape mesh;
  mesh.file = builder.asset("mesh", file);
  mesh.format = format;
  mesh.face_normals = flags.face_normals;
  mesh.flat_without_normals = flags.flat_without_normals;
  mesh.flip_tex_coords = flags.flip_tex_coords;
  // The material has a texture, so that hits have uv.
  const TextureIndex dark = builder.texture({.1, .1, .1}), light = builder.texture({.9, .9, .9});
  const TextureIndex checks =
      SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(CheckerboardTexture{dark, light, {}}));
  builder.shape(mesh, {}, builder.bsdf(DiffuseBsdf{checks})).flip_normals = flags.flip_normals;
  return LightBench(builder);
}
SurfaceHit hit_at(const LightBench& b, double x, double y) {
  SurfaceHit hit;
  const V3 o = b.at({x, y, 1}), d(0, 0, -1);
  const auto id = b.world->accel.nearest(o, d, kInfinity);
  EXPECT_TRUE(id && b.world->geometry.complete(*id, o, d, hit)) << x << " " << y;
  return hit;
}

struct Format {
  const char* name;
  MeshFormat format;
  std::string (*write)(const Polygon&);
};
const Format kFormats[] = {{"obj", MeshFormat::obj, obj},
                           {"ply", MeshFormat::ply, ply},
                           {"serialized", MeshFormat::serialized, serialized}};

// At (.5, .7) Mitsuba 3.9.1 gave the normal (0, 0, 1), the shading normal (.17465, .08753, .98073) and the uv
// (.32, .505). flip_normals reversed both normals, face_normals made the shading normal (0, 0, 1), and
// flip_tex_coords gave the uv (.32, .495).
TEST(MeshFlags, FlipNormalsAndCoordinatesAsInMitsuba) {
  for (const Format& f : kFormats)
    for (int k = 0; k < 8; ++k) {
      const Flags flags{(k & 1) != 0, (k & 2) != 0, (k & 4) != 0};
      // This format lacks the parameter.
      if (flags.flip_tex_coords && f.format == MeshFormat::serialized) continue;
      const SurfaceHit hit = hit_at(bench_of(f.write(kQuad), f.format, flags), .5, .7);
      const float sign = flags.flip_normals ? -1.f : 1.f;
      const V3 ng = V3(0, 0, sign), ns = flags.face_normals ? ng : V3(.17465f, .08753f, .98073f) * sign;
      EXPECT_LT((hit.ng - ng).length(), 1e-6f) << f.name << " " << k;
      EXPECT_LT((hit.shading.n - ns).length(), 1e-4f) << f.name << " " << k;
      EXPECT_NEAR(hit.uv.x, .32f, 1e-5f) << f.name << " " << k;
      EXPECT_NEAR(hit.uv.y, flags.flip_tex_coords ? .495f : .505f, 1e-5f) << f.name << " " << k;
    }
}

// A roof of two triangles without normals. Its ridge is x = 0; the left side has the normal (-1, 0, 1) / sqrt
// 2.
TEST(MeshFlags, MeshWithoutNormalsIsSmoothUnlessFlatIsRequested) {
  const std::string roof = "v 0 0 1\nv 0 2 1\nv -1 1 0\nv 1 1 0\nf 1 2 3\nf 2 1 4\n";
  const float side = std::sqrt(.5f);
  for (const bool flat : {false, true}) {
    Flags flags;
    flags.flat_without_normals = flat;
    const SurfaceHit hit = hit_at(bench_of(roof, MeshFormat::obj, flags), -1e-3, 1);
    EXPECT_LT((hit.ng - V3(-side, 0, side)).length(), 1e-6f);
    EXPECT_LT((hit.shading.n - (flat ? V3(-side, 0, side) : V3(0, 0, 1))).length(), 2e-3f) << flat;
  }
  // Vertex normals from the file are used nevertheless.
  Flags flags;
  flags.flat_without_normals = true;
  EXPECT_EQ(hit_at(bench_of(obj(kQuad), MeshFormat::obj, flags), .5, .7).shading.n,
            hit_at(bench_of(obj(kQuad), MeshFormat::obj, {}), .5, .7).shading.n);
}

// A polygon of seven corners that is not flat is read as the fan of triangles from its first corner: the
// formats agree bit for bit.
TEST(MeshFlags, PolygonsAreFansInEveryFormat) {
  Polygon seven;
  for (int i = 0; i < 7; ++i) {
    const double a = 2 * M_PI * i / 7;
    const auto x = static_cast<float>(std::cos(a)), y = static_cast<float>(std::sin(a));
    seven.push_back({{x, y, .1f * x * y}, {.2f * x, .3f * y, 1}, {.5f + .5f * x, .5f + .5f * y}});
  }
  const LightBench reference = bench_of(serialized(seven), MeshFormat::serialized, {});
  EXPECT_EQ(reference.world->geometry.triangle_count(), 5u);
  for (const Format& f : kFormats) {
    const LightBench b = bench_of(f.write(seven), f.format, {});
    EXPECT_EQ(b.world->geometry.triangle_count(), 5u) << f.name;
    RandomStream r(2);
    for (int i = 0; i < 200; ++i) {
      const double a = 2 * M_PI * r.uniform(), s = .85 * r.uniform(), x = s * std::cos(a),
                   y = s * std::sin(a);
      const SurfaceHit got = hit_at(b, x, y), want = hit_at(reference, x, y);
      ASSERT_EQ(got.p, want.p) << f.name;
      ASSERT_EQ(got.shading.n, want.shading.n) << f.name;
      ASSERT_EQ(got.uv, want.uv) << f.name;
    }
  }
}

}  // namespace
}  // namespace ls::render
