// Attributes of PLY meshes. All expected values are those of Mitsuba 3.9.1.
#include "core/assets/mesh_parts.h"

#include <gmock/gmock.h>

#include "core/assets/mesh.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::FloatNear;
using testing::IsEmpty;

using Names = std::vector<std::string_view>;

std::vector<std::string> named(const Names& names) {
  std::vector<std::string> out;
  for (const PlyAttribute& a : ply_attributes(names)) {
    out.push_back(a.name);
    for (const std::size_t p : a.properties) out.back() += " " + std::to_string(p);
  }
  return out;
}

TEST(PlyAttributes, AreColoursAndSeriesOfNumberedOrLetteredNames) {
  EXPECT_THAT(named({"x", "y", "z", "red", "green", "blue"}), ElementsAre("color 3 4 5"));
  EXPECT_THAT(named({"r", "foo_x", "g", "b", "a"}), ElementsAre("color 0 2 3", "foo 1"));
  EXPECT_THAT(named({"foo_x", "foo_y", "foo_z"}), ElementsAre("foo 0 1 2"));
  EXPECT_THAT(named({"foo_r", "foo_g", "foo_b"}), ElementsAre("foo_color 0 1 2"));
  EXPECT_THAT(named({"foo_0", "bar_1", "bar_2", "bar_3"}), ElementsAre("foo 0", "bar 1 2 3"));
  EXPECT_THAT(named({"a_b_x"}), ElementsAre("a_b 0"));
}

TEST(PlyAttributes, ExcludePropertiesThatMitsubaIgnores) {
  EXPECT_THAT(named({"foo"}), IsEmpty());
  EXPECT_THAT(named({"foo_xy", "_x", "foo_y"}), IsEmpty());
  EXPECT_THAT(named({"foo_x", "foo_y"}), IsEmpty());
  EXPECT_THAT(named({"foo_x", "foo_y", "foo_z", "foo_w"}), IsEmpty());
  EXPECT_THAT(named({"foo_x", "foo_z", "foo_y"}), IsEmpty());
  EXPECT_THAT(named({"foo_x", "bar_x", "foo_y", "foo_z"}), ElementsAre("foo 0", "bar 1"));
  EXPECT_THAT(named({"x", "y", "z", "nx", "ny", "nz", "u", "v", "", "alpha"}), IsEmpty());
}

const MeshAttribute* find(const MeshData& m, std::string_view name) {
  for (const MeshAttribute& a : m.attributes)
    if (a.name == name) return &a;
  return nullptr;
}

// Two squares of two triangles each; between them in the file, a face without area.
const char kSquares[] =
    "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
    "property float r\nproperty float g\nproperty float b\nproperty float alpha\nproperty float heat_x\n"
    "element face 3\nproperty float stamp_x\nproperty list uchar int vertex_indices\nproperty ushort c_0\n"
    "property ushort c_1\nproperty ushort c_2\nend_header\n"
    "0 0 0 .1 .2 .3 1 7\n1 0 0 .4 .5 .6 1 8\n1 1 0 0 0 0 1 9\n0 1 0 1 1 1 1 10\n2 0 0 .7 .8 .9 1 11\n2 1 0 1 "
    "2 3 "
    "1 12\n"
    "5 4 0 1 2 3 0 32768 65535\n6 3 0 1 1 9 9 9\n7 4 1 4 5 2 65535 0 128\n";

TEST(PlyAttributes, FaceAttributesApplyToItsTriangles) {
  const std::vector<std::string> wanted{"vertex_color", "face_stamp", "face_c", "vertex_nothing"};
  const auto m = decode_ply("m.ply", bytes_of(kSquares), wanted);

  ASSERT_TRUE(m) << m.error().message;
  ASSERT_EQ(m->triangle_count(), 4u);
  EXPECT_THAT(m->attribute_names, ElementsAre("vertex_color", "vertex_heat", "face_stamp", "face_c"));
  ASSERT_EQ(m->attributes.size(), 3u) << "heat is not wanted";
  const MeshAttribute* colour = find(*m, "vertex_color");
  ASSERT_TRUE(colour && colour->components == 3 && colour->values.size() == 18);
  EXPECT_THAT(std::vector(colour->values.begin(), colour->values.begin() + 6),
              ElementsAre(.1f, .2f, .3f, .4f, .5f, .6f));
  const MeshAttribute* stamp = find(*m, "face_stamp");
  ASSERT_TRUE(stamp && stamp->components == 1 && !stamp->bytes);
  EXPECT_THAT(stamp->values, ElementsAre(5, 5, 7, 7));
  const MeshAttribute* c = find(*m, "face_c");
  ASSERT_TRUE(c && c->values.size() == 12);
  EXPECT_THAT(std::vector(c->values.begin() + 6, c->values.begin() + 9),
              ElementsAre(1, 0, FloatNear(1.5117298e-4f, 1e-9f)));
}

TEST(PlyAttributes, IntegersAreSrgbCodesAndBytesRangeFrom0To255) {
  std::string file =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float "
      "z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty ushort u_x\nproperty char "
      "i_x\n"
      "property double d_x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const float corner : {0.f, 1.f, 2.f}) {
    for (const float x : {corner, corner * corner, 0.f}) append(file, x);
    for (const int byte : {0, 128, 255}) append(file, static_cast<std::uint8_t>(byte));
    append(file, std::uint16_t{32768});
    append(file, std::int8_t{64});
    append(file, 64.);
  }
  append(file, std::uint8_t{3});
  for (const std::int32_t i : {0, 1, 2}) append(file, i);
  const std::vector<std::string> wanted{"vertex_color", "vertex_u", "vertex_i", "vertex_d"};
  const auto m = decode_ply("m.ply", bytes_of(file), wanted);

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_TRUE(find(*m, "vertex_color")->bytes);
  EXPECT_THAT(
      std::vector(find(*m, "vertex_color")->values.begin(), find(*m, "vertex_color")->values.begin() + 3),
      ElementsAre(0, 128, 255));
  // Mitsuba's expected values are from its own power function, which has errors of up to 1e-6.
  EXPECT_NEAR(find(*m, "vertex_u")->values[0], .21404809f, 3e-7f);
  EXPECT_NEAR(find(*m, "vertex_i")->values[0], .21770316f, 3e-7f);
  EXPECT_FLOAT_EQ(find(*m, "vertex_d")->values[0], 64);
}

TEST(PlyAttributes, UnusedAttributesAreDropped) {
  const auto m = decode_ply("m.ply", bytes_of(kSquares));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_TRUE(m->attributes.empty());
}

const std::vector<std::string> kWanted{"vertex_color", "face_stamp", "face_c"};

void expect_whole(const MeshData& m) {
  for (const MeshAttribute& a : m.attributes)
    EXPECT_EQ(a.values.size(),
              a.components * (a.name.starts_with("face_") ? m.triangle_count() : m.vertex_count()))
        << a.name;
}

// A file that is cut or changed must not give an attribute with fewer values than the mesh has vertices or
// triangles.
TEST(PlyAttributes, DamagedFileHasAllAttributesOrIsRefused) {
  const std::string file = kSquares;
  const auto decode = [](std::string_view name, std::span<const std::byte> bytes) {
    return decode_ply(name, bytes, kWanted);
  };
  test::accepted_truncations(file, decode);
  test::survive_mutations(file, decode, expect_whole);
}

TEST(PlyAttributes, AttributesOfOneOfTwoFaceListsAreRefused) {
  std::string file = kSquares;
  file.insert(file.find("end_header"), "element face 1\nproperty list uchar int vertex_indices\n");
  file += "3 0 1 2\n";
  EXPECT_TRUE(decode_ply("m.ply", bytes_of(file)));
  const auto m = decode_ply("m.ply", bytes_of(file), kWanted);
  ASSERT_FALSE(m);
  EXPECT_EQ(m.error().message, "'m.ply': not all of it has the attribute 'face_stamp'");
}

}  // namespace
}  // namespace ls
