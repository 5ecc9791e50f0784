// `mesh_attribute` textures in worlds: values at hits, light, instances, and refused input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/render/light_bench.h"

namespace ls::render {
namespace {

using test::SceneBuilder;
using test::translate;
using testing::HasSubstr;

// A square in z = 0 from (0, 0) to (1, 1) of two triangles, with a triangle without area between them.
std::string square(const std::string& vertex, const std::vector<std::string>& at_vertex,
                   const std::string& face, const std::vector<std::string>& at_face) {
  std::string s =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n" +
      vertex + "element face 3\nproperty list uchar int vertex_indices\n" + face + "end_header\n";
  const char* corners[] = {"0 0 0", "1 0 0", "0 1 0", "1 1 0"};
  for (int i = 0; i < 4; ++i)
    s += std::string(corners[i]) + " " + at_vertex[static_cast<std::size_t>(i)] + "\n";
  const char* faces[] = {"3 0 1 2", "3 1 1 2", "3 1 3 2"};
  for (int i = 0; i < 3; ++i) s += std::string(faces[i]) + " " + at_face[static_cast<std::size_t>(i)] + "\n";
  return s;
}
const std::string kRgb = "property float r\nproperty float g\nproperty float b\n",
                  kStamp = "property float stamp_x\n";
const std::string kSquare =
    square(kRgb, {"0 .5 1", ".1 .2 .3", "1 .8 .6", ".9 .7 .4"}, kStamp, {".25", ".5", ".75"});

Shape& add_mesh(SceneBuilder& builder, const std::string& text, BsdfIndex bsdf,
                const Transform& to_world = {}) {
  MeshShape mesh;
  mesh.file = builder.asset("square.ply", text);
  mesh.format = MeshFormat::ply;
  return builder.shape(mesh, to_world, bsdf);
}
TextureIndex attribute(SceneBuilder& builder, const std::string& name, double scale = 1) {
  return SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(MeshAttributeTexture{name, scale}));
}
SurfaceHit hit_at(const LightBench& b, const V3d& p) {
  SurfaceHit hit;
  const V3 o = b.at(p + V3d(0, 0, 1)), d(0, 0, -1);
  const auto id = b.world->accel.nearest(o, d, kInfinity);
  EXPECT_TRUE(id && b.world->geometry.complete(*id, o, d, hit));
  return hit;
}
C3 albedo_at(const LightBench& b, const V3d& p) {
  const SurfaceHit hit = hit_at(b, p);
  const V3 up(0, 0, 1);
  return b.world->bsdfs.eval(b.world->geometry.surfaces[hit.surface].bsdf, hit.uv_point(), up, up).f_cos *
         kPi;
}
void expect_near(const C3& a, const C3& b) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 2e-6f);
}

// From these corners mesh_attribute.eval of Mitsuba 3.9.1 gave (.32, .53, .74) at (.2, .3, 0).
TEST(MeshAttributes, AreInterpolatedOfVerticesAndConstantOfFaces) {
  for (const char* name : {"vertex_color", "face_stamp"}) {
    SceneBuilder builder;
    const BsdfIndex b = builder.bsdf(DiffuseBsdf{attribute(builder, name)});
    add_mesh(builder, kSquare, b, translate({5, 0, 0}));
    const LightBench bench(builder);
    if (std::string_view(name) == "vertex_color") {
      expect_near(albedo_at(bench, {5.2, .3, 0}), {.32f, .53f, .74f});
      expect_near(albedo_at(bench, {5.9, .8, 0}),
                  {.1f * .2f + .9f * .7f + 1 * .1f, .2f * .2f + .7f * .7f + .8f * .1f,
                   .3f * .2f + .4f * .7f + .6f * .1f});
    } else {
      expect_near(albedo_at(bench, {5.2, .3, 0}), C3(.25f));
      // The second triangle was left out, together with its value.
      expect_near(albedo_at(bench, {5.9, .8, 0}), C3(.75f));
    }
    EXPECT_EQ(bench.world->geometry.dropped_triangles, 1u) << "counted, by whoever leaves it out";
  }
}

TEST(MeshAttributes, EachMeshHasItsOwnAttributeOfAName) {
  SceneBuilder builder;
  const BsdfIndex b = builder.bsdf(DiffuseBsdf{attribute(builder, "vertex_color", .5)});
  add_mesh(builder, kSquare, b);
  add_mesh(builder, square(kRgb, {"1 1 1", "1 1 1", "1 1 1", "1 1 1"}, "", {"", "", ""}), b,
           translate({3, 0, 0}));
  const BsdfIndex plain = builder.diffuse(.125);
  add_mesh(builder, kSquare, plain, translate({6, 0, 0}));
  const LightBench bench(builder);
  expect_near(albedo_at(bench, {.2, .3, 0}), {.16f, .265f, .37f});
  expect_near(albedo_at(bench, {3.2, .3, 0}), C3(.5f));
  expect_near(albedo_at(bench, {6.2, .3, 0}), C3(.125f));
  EXPECT_FALSE(bench.world->geometry.surfaces[2].wants_attributes);
}

TEST(MeshAttributes, AreSeenThroughInstances) {
  SceneBuilder builder;
  const BsdfIndex b = builder.bsdf(DiffuseBsdf{attribute(builder, "vertex_color")});
  add_mesh(builder, kSquare, b).group = GroupIndex{0};
  builder.scene.groups.emplace_back();
  builder.scene.instances.push_back({GroupIndex{0}, translate({2, 1, 0})});
  const LightBench bench(builder);
  expect_near(albedo_at(bench, {2.2, 1.3, 0}), {.32f, .53f, .74f});
}

TEST(MeshAttributes, AreReadInCheckerboardsNormalMapsAndMasks) {
  SceneBuilder builder;
  const TextureIndex stamp = attribute(builder, "face_stamp");
  const TextureIndex checks =
      SceneBuilder::push<TextureTag>(builder.scene.textures, Texture(CheckerboardTexture{stamp, stamp, {}}));
  const BsdfIndex white = builder.bsdf(DiffuseBsdf{checks});
  const BsdfIndex masked = builder.bsdf(MaskBsdf{stamp, white});
  add_mesh(builder, kSquare, masked);
  const LightBench bench(builder);
  expect_near(albedo_at(bench, {.2, .3, 0}), C3(.25f * .25f));
  const SurfaceHit hit = hit_at(bench, {.9, .8, 0});
  EXPECT_FLOAT_EQ(bench.world->bsdfs.null_transmission(masked, hit.uv_point(), {0, 0, 1}).probability, .25f);
}

// A light whose faces have different radiances: light samples and hits must agree, and each face must get
// half of the samples.
TEST(MeshAttributes, EmissionMatchesItsSampling) {
  SceneBuilder builder;
  const BsdfIndex black = builder.diffuse(0);
  const TextureIndex light = attribute(builder, "face_stamp", 4);
  add_mesh(builder, kSquare, black, test::rotate_x(180)).emitter = AreaEmitter{light};
  const LightBench bench(builder);
  RandomStream r(3);
  const V3 x = bench.at({.3, -.4, -.7});
  int dim = 0;
  for (int i = 0; i < 1000; ++i) {
    const float u = r.uniform(), v = r.uniform();
    const auto s = bench.world->lights.sample(bench.world->lights.choose(numbers(0, u, v)), x);
    ASSERT_TRUE(s);
    SurfaceHit hit;
    const auto id = bench.world->accel.nearest(x, s->direction, kInfinity);
    if (!id || !bench.world->geometry.complete(*id, x, s->direction, hit)) continue;  // missed at the rim
    const C3 seen = bench.world->lights.emitted(hit, -s->direction);
    // Next to the diagonal rounding may select the other triangle.
    if (std::abs(hit.uv.x + hit.uv.y - 1) < 1e-5f) continue;
    ASSERT_EQ(seen, s->radiance) << i;
    ASSERT_TRUE(seen.x == 1 || seen.x == 3) << seen.x;
    dim += seen.x == 1;
  }
  EXPECT_NEAR(dim, 500, 5 * std::sqrt(250.));
}

std::string refusal(const std::string& mesh, const std::function<void(SceneBuilder&)>& make) {
  SceneBuilder builder;
  make(builder);
  const BsdfIndex last{static_cast<std::uint32_t>(builder.scene.bsdfs.size() - 1)};
  add_mesh(builder, mesh, last);
  const auto w = build_world(builder.scene, test::settings_of(builder.scene), builder.files, 1);
  return w ? "" : w.error().message;
}

TEST(MeshAttributes, MissingAttributeIsRefusedByName) {
  const auto diffuse = [](const char* name) {
    return [name](SceneBuilder& builder) { builder.bsdf(DiffuseBsdf{attribute(builder, name)}); };
  };
  EXPECT_THAT(
      refusal(kSquare, diffuse("vertex_colour")),
      HasSubstr(
          "shape 1: the mesh 'square.ply' has no attribute \"vertex_colour\", which a texture reads; it "
          "has vertex_color, face_stamp"));
  EXPECT_THAT(refusal(square("", {"", "", "", ""}, "", {"", "", ""}), diffuse("vertex_color")),
              HasSubstr("it has none"));
  const auto rough = [](SceneBuilder& builder) {
    const TextureIndex a = attribute(builder, "vertex_color"), one = builder.texture({1, 1, 1});
    builder.bsdf(RoughConductorBsdf{Microfacet::ggx, a, a, {0, 0, 0}, {1, 1, 1}, one});
  };
  EXPECT_THAT(refusal(kSquare, rough),
              HasSubstr("reads the attribute \"vertex_color\" as one number, but it has 3"));
  const auto map = [](SceneBuilder& builder) {
    const BsdfIndex b = builder.diffuse(.5);
    builder.bsdf(NormalMapBsdf{attribute(builder, "face_stamp"), b});
  };
  EXPECT_THAT(refusal(kSquare, map),
              HasSubstr("a normal map reads the attribute \"face_stamp\", which has one number"));
  EXPECT_THAT(refusal(square(kRgb, {"0 0 0", "nan 0 0", "0 0 0", "0 0 0"}, "", {"", "", ""}),
                      diffuse("vertex_color")),
              HasSubstr("not finite"));
  SceneBuilder sphere;
  sphere.shape(SphereShape{}, {}, sphere.bsdf(DiffuseBsdf{attribute(sphere, "vertex_color")}));
  const auto w = build_world(sphere.scene, test::settings_of(sphere.scene), sphere.files, 1);
  ASSERT_FALSE(w);
  EXPECT_THAT(w.error().message, HasSubstr("\"vertex_color\", but only meshes have attributes"));
}

// Mitsuba 3.9.1 uses bytes as numbers from 0 to 255.
TEST(MeshAttributes, ByteAttributesNeedAScale) {
  const std::string bytes = square("property uchar red\nproperty uchar green\nproperty uchar blue\n",
                                   {"0 128 255", "0 128 255", "0 128 255", "0 128 255"}, "", {"", "", ""});
  const auto diffuse = [](double scale) {
    return [scale](SceneBuilder& builder) {
      builder.bsdf(DiffuseBsdf{attribute(builder, "vertex_color", scale)});
    };
  };
  EXPECT_THAT(refusal(bytes, diffuse(1)), HasSubstr("stored in bytes, which are numbers from 0 to 255"));
  EXPECT_EQ(refusal(bytes, diffuse(.00392157)), "");
}

}  // namespace
}  // namespace ls::render
