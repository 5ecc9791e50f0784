// Mitsuba's `.serialized` meshes: both versions, both precisions, several meshes in a file, and files with
// wrong sizes and offsets.
#include <gmock/gmock.h>
#include <zlib.h>

#include <cmath>

#include "common/assets/mesh.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

std::string packed(const std::string& plain) {
  std::string out(compressBound(plain.size()), '\0');
  uLongf size = out.size();
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(out.data()), &size,
                     reinterpret_cast<const Bytef*>(plain.data()), plain.size()),
            Z_OK);
  out.resize(size);
  return out;
}

struct Parts {
  std::uint16_t version = 4;
  std::uint32_t flags = 0x1 | 0x2 | 0x8;  // normals, uvs, colours
  bool wide = false;
  float x = 0;  // x coordinate of the first vertex
  std::uint64_t vertices = 3, triangles = 1;
  std::vector<std::uint32_t> indices = {0, 1, 2};
};
template <class T>
void append_all(std::string& to, std::initializer_list<double> values) {
  for (const double v : values) append(to, static_cast<T>(v));
}
template <class T>
std::string body(const Parts& p) {
  std::string b;
  append(b, p.flags | (p.wide ? 0x2000u : 0x1000u));
  if (p.version == 4) b += std::string("a shape") + '\0';
  append(b, p.vertices);
  append(b, p.triangles);
  append_all<T>(b, {p.x, 0, 0, 1, 0, 0, 0, 1, 0});
  if (p.flags & 0x1) append_all<T>(b, {0, 0, 1, 0, 0, 1, 0, 0, 1});
  if (p.flags & 0x2) append_all<T>(b, {0, 0, 1, 0, .25, 1});
  if (p.flags & 0x8) append_all<T>(b, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (const std::uint32_t i : p.indices) append(b, i);
  return b;
}
std::string mesh(const Parts& p = {}) {
  std::string file;
  append(file, std::uint16_t{0x041C});
  append(file, p.version);
  return file + packed(p.wide ? body<double>(p) : body<float>(p));
}
std::string file_of(const std::vector<std::string>& meshes, int version = 4) {
  std::string file, table;
  for (const std::string& m : meshes) {
    if (version == 4)
      append(table, std::uint64_t{file.size()});
    else
      append(table, static_cast<std::uint32_t>(file.size()));
    file += m;
  }
  append(table, static_cast<std::uint32_t>(meshes.size()));
  return file + table;
}
Result<MeshData> decode_mesh(const std::string& file, int index = 0) {
  return decode_serialized("m.serialized", bytes_of(file), index);
}
std::string error_of(const std::string& file, int index = 0) {
  const auto m = decode_mesh(file, index);
  return m ? "" : m.error().message;
}

TEST(Serialized, ReadsBothVersionsInBothPrecisions) {
  for (const std::uint16_t version : {3, 4}) {
    for (const bool wide : {false, true}) {
      const auto m = decode_mesh(file_of({mesh({.version = version, .wide = wide})}, version));

      ASSERT_TRUE(m) << m.error().message;
      EXPECT_THAT(m->positions, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0));
      EXPECT_THAT(m->normals, ElementsAre(0, 0, 1, 0, 0, 1, 0, 0, 1));
      EXPECT_THAT(m->uvs, ElementsAre(0, 0, 1, 0, .25, 1));
      EXPECT_THAT(m->indices, ElementsAre(0, 1, 2));
      EXPECT_FALSE(m->face_normals);
    }
  }
}

TEST(Serialized, ReadsOnlyWhatIsThere) {
  const auto m = decode_mesh(mesh({.flags = 0x10}));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_TRUE(m->normals.empty());
  EXPECT_TRUE(m->uvs.empty());
  EXPECT_TRUE(m->face_normals);
}

TEST(Serialized, FindsEachOfSeveralMeshes) {
  for (const std::uint16_t version : {3, 4}) {
    const std::string file =
        file_of({mesh({.version = version, .x = -1}), mesh({.version = version, .x = -2}),
                 mesh({.version = version, .wide = true, .x = -3})},
                version);
    for (int i = 0; i < 3; ++i) {
      const auto m = decode_mesh(file, i);
      ASSERT_TRUE(m) << m.error().message;
      EXPECT_EQ(m->positions[0], -1 - i);
    }
    EXPECT_THAT(error_of(file, 3), HasSubstr("'m.serialized': has no mesh number 3: 3 of them"));
    EXPECT_THAT(error_of(file, -1), HasSubstr("has no mesh number -1"));
  }
}

TEST(Serialized, TellsOtherFilesAndVersions) {
  EXPECT_THAT(error_of("ply\n"), HasSubstr("no serialized mesh"));
  EXPECT_THAT(error_of(""), HasSubstr("no serialized mesh"));
  EXPECT_THAT(error_of(mesh({.version = 5})), HasSubstr("version 5"));
}

TEST(Serialized, RefusesTablesThatPointElsewhere) {
  std::string file = file_of({mesh(), mesh()});
  const std::size_t second = file.size() - 12;
  file[second + 5] = '\x7f';
  EXPECT_THAT(error_of(file, 1), HasSubstr("is said to begin at byte"));
  file = file_of({mesh(), mesh()});
  file[second] = '\1';
  EXPECT_THAT(error_of(file, 1), HasSubstr("no serialized mesh"));
  file = file_of({mesh(), mesh()});
  file.replace(file.size() - 4, 4, "\xff\xff\xff\x7f");
  EXPECT_THAT(error_of(file, 1), HasSubstr("has no mesh number 1"));
}

TEST(Serialized, RefusesIndicesOutOfRange) {
  EXPECT_THAT(error_of(mesh({.indices = {0, 1, 3}})), HasSubstr("triangle 0 names vertex 3 of 3"));
  EXPECT_THAT(error_of(mesh({.triangles = 0, .indices = {}})), HasSubstr("has no faces"));
}

// Impossible counts are rejected before memory is allocated.
TEST(Serialized, RefusesCountsThatCannotBe) {
  EXPECT_THAT(error_of(mesh({.vertices = 0xffffffffffffffffu})), HasSubstr("the limits are"));
  EXPECT_THAT(error_of(mesh({.triangles = 1u << 29})), HasSubstr("the limits are"));
  EXPECT_THAT(error_of(mesh({.vertices = 1u << 27})), HasSubstr("are announced, but only"));
  EXPECT_THAT(error_of(mesh({.vertices = 4})), HasSubstr("cannot be unpacked"));
  EXPECT_THAT(error_of(mesh({.triangles = 2})), HasSubstr("its triangles end too early"));
}

TEST(Serialized, DropsTrianglesWithoutArea) {
  const auto m = decode_mesh(mesh({.triangles = 3, .indices = {0, 1, 2, 0, 0, 1, 2, 1, 0}}));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_EQ(m->triangle_count(), 2u);
  EXPECT_EQ(m->dropped_triangles, 1u);
}

TEST(Serialized, SurvivesTruncationAndMutation) {
  const std::string file = file_of({mesh(), mesh({.wide = true})});
  const auto decode_second = [](std::string_view name, std::span<const std::byte> bytes) {
    return decode_serialized(name, bytes, 1);
  };
  EXPECT_EQ(test::accepted_truncations(file, decode_second), 0);
  // The first mesh can be read from a truncated file: it ends long before the file does, and reading it does
  // not need the table at the file's end.
  const int first =
      test::accepted_truncations(file, [](std::string_view name, std::span<const std::byte> bytes) {
        return decode_serialized(name, bytes, 0);
      });
  EXPECT_LT(first, static_cast<int>(file.size()) - static_cast<int>(mesh().size()) + 8);
  test::survive_mutations(file, decode_second, [](const MeshData& m) {
    for (const std::uint32_t i : m.indices) EXPECT_LT(i, m.vertex_count());
  });
}

TEST(Obj, MakesAFanOfAPolygonOfAnyNumberOfSides) {
  for (const int sides : {3, 36, 1000}) {
    std::string text, face = "f";
    for (int i = 0; i < sides; ++i) {
      text += "v " + std::to_string(std::cos(6.2831853 * i / sides)) + " " +
              std::to_string(std::sin(6.2831853 * i / sides)) + " 0\n";
      face += " " + std::to_string(i + 1);
    }
    const auto m = decode_obj("disk.obj", bytes_of(text + face + "\n"));
    ASSERT_TRUE(m) << m.error().message;
    EXPECT_EQ(m->triangle_count(), static_cast<std::size_t>(sides - 2));
  }
}

}  // namespace
}  // namespace ls
