#include "core/assets/mesh.h"

#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/assets/mesh_parts.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kQuadObj =
    "# a quad\nmtllib a.mtl\no quad\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 "
    "1\nvn 0 0 1\n"
    "usemtl m\ns off\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

void expect_sound_mesh(const MeshData& m) {
  const std::size_t n = m.vertex_count();
  EXPECT_EQ(m.positions.size() % 3, 0u);
  EXPECT_EQ(m.indices.size() % 3, 0u);
  EXPECT_TRUE(m.normals.empty() || m.normals.size() == 3 * n);
  EXPECT_TRUE(m.uvs.empty() || m.uvs.size() == 2 * n);
  for (const std::uint32_t i : m.indices) EXPECT_LT(i, n);
}

std::string obj_error(const std::string& text) {
  const auto m = decode_obj("m.obj", bytes_of(text));
  return m ? "" : m.error().message;
}

// A file can choose corners whose hashes collide if the hash has no secret. With a secret that the file does
// not know, the same corners are spread over the table.
TEST(Obj, CornersThatCollideWithoutASecretAreSpreadWithOne) {
  constexpr std::size_t kPlaces = 10273, kCorners = 500;
  std::vector<Corner> chosen;
  for (std::int64_t v = 0; chosen.size() < kCorners; ++v)
    for (std::int64_t vt = 0; vt < 1000; ++vt)
      if (CornerHash{}({v, vt, -1}) % kPlaces == 0) chosen.push_back({v, vt, -1});

  for (const std::uint64_t secret : {1ull, 2ull, 0x243f6a8885a308d3ull}) {
    std::map<std::size_t, std::size_t> places;
    for (const Corner& c : chosen) ++places[CornerHash{secret}(c) % kPlaces];
    // 500 random places out of 10273: some two are equal, but five equal ones have a probability of 2e-5.
    EXPECT_LT(std::max_element(places.begin(), places.end(),
                               [](const auto& a, const auto& b) { return a.second < b.second; })
                  ->second,
              5u);
  }
}

TEST(Obj, ReadsAQuadAsTwoTriangles) {
  const auto m = decode_obj("q.obj", bytes_of(kQuadObj));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_THAT(m->indices, ElementsAre(0, 1, 2, 0, 2, 3));
  EXPECT_THAT(m->positions, ElementsAre(-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0));
  EXPECT_THAT(m->uvs, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
  EXPECT_EQ(m->normals.size(), 12u);
}

TEST(Obj, CountsNegativeIndicesBackFromTheLast) {
  const auto m = decode_obj("q.obj", bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\r\n"));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_THAT(m->indices, ElementsAre(0, 1, 2));
  EXPECT_TRUE(m->uvs.empty());
  EXPECT_TRUE(m->normals.empty());
}

TEST(Obj, SharesOnlyIdenticalCorners) {
  const auto m = decode_obj(
      "q.obj", bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 2/1 3/1\n"));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_THAT(m->indices, ElementsAre(0, 1, 2, 3, 1, 2));
}

TEST(Obj, DropsAndCountsTrianglesWithoutAreaOrWithVerticesThatAreNotFinite) {
  const auto m = decode_obj(
      "q.obj",
      bytes_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 1 2\n"));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_EQ(m->triangle_count(), 1u);
  EXPECT_EQ(m->dropped_triangles, 3u);
}

TEST(Obj, ErrorsNameFileAndLine) {
  EXPECT_THAT(obj_error("v 0 0 0\nf 1 2 3\n"),
              HasSubstr("'m.obj', line 2: index 2 in '2' is out of range: 1 so far"));
  EXPECT_THAT(obj_error("v 0 0 zero\n"), HasSubstr("line 1: expected 3 numbers, found 'zero'"));
  EXPECT_THAT(obj_error("v 0 0 0\nf 0 1 1\n"), HasSubstr("line 2"));
  EXPECT_THAT(obj_error("v 0 0 0\nf\n"), HasSubstr("at least three corners"));
  EXPECT_THAT(obj_error("v 0 0 0\nf 1/x 1 1\n"), HasSubstr("no corner of a face"));
  EXPECT_THAT(obj_error("\nfrobnicate\n"), HasSubstr("line 2: unknown statement 'frobnicate'"));
  EXPECT_THAT(obj_error(""), HasSubstr("has no faces"));
}

TEST(Obj, SurvivesTruncationsAndMutations) {
  test::accepted_truncations(kQuadObj, decode_obj);
  test::survive_mutations(kQuadObj, decode_obj, expect_sound_mesh);
}

std::string ply_header(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\ncomment made by hand\nelement vertex 4\nproperty float z\nproperty double x\n" +
         "property float y\nproperty uchar red\nproperty float s\nproperty float t\nelement face 1\nproperty "
         "uchar flags\n" +
         "property list uchar int vertex_indices\nelement edge 1\nproperty list int float w\nend_header\n";
}

const std::string kPlyAscii =
    ply_header("ascii") +
    "0 -1 -1 255 0 0\n0 1 -1 255 1 0\n0 1 1 255 1 1\n0 -1 1 255 0 1\n7 4 0 1 2 3\n2 0.5 0.25\n";

template <class T>
void put(std::string& s, T v, bool big) {
  std::string raw;
  append(raw, v);
  if (big) std::reverse(raw.begin(), raw.end());
  s += raw;
}
std::string ply_binary(bool big) {
  std::string s = ply_header(big ? "binary_big_endian" : "binary_little_endian");
  const float corners[4][4] = {{-1, -1, 0, 0}, {1, -1, 1, 0}, {1, 1, 1, 1}, {-1, 1, 0, 1}};
  for (const auto& c : corners) {
    put(s, 0.f, big);
    put(s, double{c[0]}, big);
    put(s, c[1], big);
    put(s, std::uint8_t{255}, big);
    put(s, c[2], big);
    put(s, c[3], big);
  }
  put(s, std::uint8_t{7}, big);
  put(s, std::uint8_t{4}, big);
  for (const std::int32_t i : {0, 1, 2, 3}) put(s, i, big);
  put(s, std::int32_t{1}, big);
  put(s, .5f, big);
  return s;
}
std::string ply_error(const std::string& text) {
  const auto m = decode_ply("m.ply", bytes_of(text));
  return m ? "" : m.error().message;
}
std::string replaced(std::string s, const std::string& what, const std::string& with) {
  return s.replace(s.find(what), what.size(), with);
}

TEST(Ply, ReadsAllThreeEncodingsTheSame) {
  for (const std::string& file : {kPlyAscii, ply_binary(false), ply_binary(true)}) {
    const auto m = decode_ply("q.ply", bytes_of(file));

    ASSERT_TRUE(m) << m.error().message;
    EXPECT_THAT(m->indices, ElementsAre(0, 1, 2, 0, 2, 3));
    EXPECT_THAT(m->positions, ElementsAre(-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0));
    EXPECT_THAT(m->uvs, ElementsAre(0, 0, 1, 0, 1, 1, 0, 1));
    EXPECT_TRUE(m->normals.empty());
  }
}

TEST(Ply, NumbersOutsideOfDoubleAreInfiniteOrZero) {
  const auto with = [](const std::string& x) {
    return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 2\nproperty list uchar int vertex_indices\nend_header\n" +
           x + " 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 1 2 3\n";
  };
  const auto decoded = [&](const std::string& x) { return decode_ply("m.ply", bytes_of(with(x))).value(); };
  EXPECT_EQ(decoded("1e400").dropped_triangles, 1u);
  EXPECT_EQ(decoded("-1e400").dropped_triangles, 1u);
  EXPECT_EQ(decoded("1" + std::string(400, '0')).dropped_triangles, 1u);
  const auto small = decoded("1e-400");
  EXPECT_EQ(small.dropped_triangles, 0u);
  EXPECT_EQ(small.positions[0], 0);
}

TEST(Ply, RefusesCountsThatTheFileCannotHold) {
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "vertex 4", "vertex 4000000000")),
              HasSubstr("4000000000 elements 'vertex'"));
  EXPECT_THAT(ply_error(replaced(ply_binary(false), "face 1", "face 99")), HasSubstr("99 elements 'face'"));
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "vertex 4", "vertex 3")), HasSubstr("m.ply"));
}

TEST(Ply, RefusesIndicesOutOfRangeAndBrokenHeaders) {
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "0 1 2 3\n", "0 1 2 4\n")),
              HasSubstr("face 0 names vertex 4 of 4"));
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "0 1 2 3\n", "0 1 2 -1\n")),
              HasSubstr("face 0 names vertex -1 of 4"));
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "ascii", "ebcdic")),
              HasSubstr("line 2: unknown format 'ebcdic'"));
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "double x", "double q")), HasSubstr("lack x, y or z"));
  EXPECT_THAT(ply_error(replaced(kPlyAscii, "property float z", "property real z")), HasSubstr("line 5"));
}

// The decoder with its default argument. A pointer to the function itself would lose it.
constexpr auto kPly = [](std::string_view name, std::span<const std::byte> file) {
  return decode_ply(name, file);
};

TEST(Ply, NeverAcceptsATruncatedFile) {
  EXPECT_EQ(test::accepted_truncations(ply_binary(false), kPly), 0);
  EXPECT_EQ(test::accepted_truncations(ply_binary(true), kPly), 0);
  // In a text file, a cut within the last number cannot be detected.
  EXPECT_LE(test::accepted_truncations(kPlyAscii, kPly), 5);
}

TEST(Ply, SurvivesMutations) {
  for (const std::string& file : {kPlyAscii, ply_binary(false), ply_binary(true)})
    test::survive_mutations(file, kPly, expect_sound_mesh);
}

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

TEST(Serialized, DoesNotReadBeyondTheFile) {
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

TEST(Serialized, ReportsOtherFilesAndVersions) {
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

TEST(Obj, BackslashContinuesAStatement) {
  const std::string joined = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  const auto plain = decode_obj("m.obj", bytes_of(joined));
  ASSERT_TRUE(plain);
  for (const std::string& text :
       {std::string("v 0 0 0\nv 1 \\\n0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n  3 \\\n4\n"),
        std::string("v 0 0 0\r\nv 1 \\\r\n0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 \\\r\n3 4\r\n")}) {
    const auto m = decode_obj("m.obj", bytes_of(text));
    ASSERT_TRUE(m) << m.error().message;
    EXPECT_EQ(m->positions, plain->positions);
    EXPECT_EQ(m->indices, plain->indices);
  }
  // A name may end in a backslash; the line after it is a statement of its own.
  EXPECT_TRUE(decode_obj("m.obj", bytes_of("# a comment \\\nusemtl wood\\\n" + joined)));
}

TEST(Obj, FacesOfOneOrTwoCornersAreLeftOut) {
  const auto m = decode_obj("m.obj", bytes_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1\nf 1 2\nf 1 2 3\n"));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_EQ(m->triangle_count(), 1u);
  // Where the line has no end, the rest of the face may be missing.
  EXPECT_THAT(obj_error("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 2"), HasSubstr("at least three corners"));
}

TEST(Obj, AcceptsCarriageReturnsAndAByteOrderMark) {
  const auto m = decode_obj("m.obj", bytes_of("\xef\xbb\xbf# old\rv 0 0 0\rv 1 0 0\rv 1 1 0\rf 1 2 3\r"));

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_EQ(m->triangle_count(), 1u);
  EXPECT_THAT(obj_error(std::string("\xff\xfev\0 \0", 6)), HasSubstr("'m.obj': is text in UTF-16"));
  EXPECT_THAT(obj_error(std::string("v\0 \0000\0", 6)), HasSubstr("UTF-16"));
}

// ---- PLY files of other programs ----

const std::string kPlyVertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
std::string header_of(const std::string& faces, bool faces_first = false, int count = 4) {
  const std::string vertices =
      "element vertex " + std::to_string(count) + "\nproperty float x\nproperty float y\nproperty float z\n";
  return "ply\nformat ascii 1.0\n" + (faces_first ? faces + vertices : vertices + faces) + "end_header\n";
}
Result<MeshData> ply_of(const std::string& text) { return decode_ply("m.ply", bytes_of(text)); }

TEST(Ply, TriangleStripsFlipEverySecondTriangleAndEndAtMinusOne) {
  const auto m = ply_of(header_of("element tristrips 1\nproperty list int int vertex_indices\n") +
                        kPlyVertices + "8 0 1 3 2 -1 0 2 3\n");

  ASSERT_TRUE(m) << m.error().message;
  // 0 1 3, then 1 3 2 turned round; both face +z, as does the triangle of the second strip.
  EXPECT_THAT(m->indices, ElementsAre(0, 1, 3, 3, 1, 2, 0, 2, 3));
  const auto wrong = ply_of(header_of("element tristrips 1\nproperty list int int vertex_indices\n") +
                            kPlyVertices + "3 0 1 9\n");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("tristrips 0 names vertex 9 of 4"));
}

TEST(Ply, FacesMayPrecedeTheirVertices) {
  const auto m = ply_of(header_of("element face 1\nproperty list uchar int vertex_indices\n", true) +
                        "4 0 1 2 3\n" + kPlyVertices);

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_THAT(m->indices, ElementsAre(0, 1, 2, 0, 2, 3));
}

TEST(Ply, TextureCoordinatesOfCornersSplitVertices) {
  const auto m = ply_of(header_of("element face 2\nproperty list uchar int vertex_indices\n"
                                  "property list uchar float texcoord\nproperty int texnumber\n") +
                        kPlyVertices + "3 0 1 2 6 0 0 .5 0 .5 1 0\n3 0 2 3 6 .25 0 .5 1 0 1 0\n");

  ASSERT_TRUE(m) << m.error().message;
  ASSERT_EQ(m->vertex_count(), 5u);  // vertex 0 has two pairs of coordinates, vertex 2 the same twice
  EXPECT_THAT(m->indices, ElementsAre(0, 1, 2, 4, 2, 3));
  EXPECT_THAT(m->uvs, ElementsAre(0, 0, .5f, 0, .5f, 1, 0, 1, .25f, 0));
  EXPECT_THAT(std::vector(m->positions.begin() + 12, m->positions.end()), ElementsAre(0, 0, 0));
  EXPECT_EQ(m->wrong_uv_faces, 0u);
}

TEST(Ply, WrongNumberOfTextureCoordinatesDropsThemWithACount) {
  const std::string faces = "3 0 1 2 6 0 0 .5 0 .5 1\n3 0 2 3 5 .25 0 .5 1 0\n3 0 1 3 8 0 0 0 0 0 0 0 0\n";
  const std::string lists =
      "element face 3\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n";

  const auto bare = ply_of(header_of(lists) + kPlyVertices + faces);
  const auto laid_out = ply_of(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property float s\nproperty float t\n" +
      lists + "end_header\n0 0 0 .1 .2\n1 0 0 .3 .4\n1 1 0 .5 .6\n0 1 0 .7 .8\n" + faces);

  for (const auto* m : {&bare, &laid_out}) {
    ASSERT_TRUE(*m) << m->error().message;
    EXPECT_EQ((*m)->wrong_uv_faces, 2u);
    EXPECT_EQ((*m)->vertex_count(), 4u);
    EXPECT_THAT((*m)->indices, ElementsAre(0, 1, 2, 0, 2, 3, 0, 1, 3));
  }
  EXPECT_TRUE(bare->uvs.empty());
  EXPECT_THAT(laid_out->uvs, ElementsAre(.1f, .2f, .3f, .4f, .5f, .6f, .7f, .8f));
}

// MeshLab writes empty lists for faces without a texture of their own.
TEST(Ply, EmptyFaceTextureCoordinatesKeepThoseOfTheVertices) {
  const auto m = ply_of(
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nproperty float s\nproperty float t\nelement face 1\n"
      "property list uchar int vertex_indices\nproperty list uchar float texcoord\n"
      "end_header\n0 0 0 .1 .2\n1 0 0 .3 .4\n0 1 0 .5 .6\n3 0 1 2 0\n");

  ASSERT_TRUE(m) << m.error().message;
  EXPECT_THAT(m->uvs, ElementsAre(.1f, .2f, .3f, .4f, .5f, .6f));
}

TEST(Ply, SplitVerticesKeepTheirNormalsAndAttributes) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\nproperty float heat_x\n"
      "element face 2\nproperty list uchar float texcoord\nproperty list uchar int "
      "vertex_indices\nend_header\n"
      "0 0 0 0 0 1 7\n1 0 0 0 1 0 8\n0 1 0 1 0 0 9\n6 0 0 1 0 0 1 3 0 1 2\n6 .5 0 1 0 0 1 3 0 1 2\n";
  const std::vector<std::string> wanted{"vertex_heat"};

  const auto m = decode_ply("m.ply", bytes_of(text), wanted);

  ASSERT_TRUE(m) << m.error().message;
  ASSERT_EQ(m->vertex_count(), 4u);
  EXPECT_THAT(std::vector(m->normals.begin() + 9, m->normals.end()), ElementsAre(0, 0, 1));
  ASSERT_EQ(m->attributes.size(), 1u);
  EXPECT_THAT(m->attributes[0].values, ElementsAre(7, 8, 9, 7));
}

TEST(Ply, AcceptsAByteOrderMarkAndCarriageReturnsInItsHeader) {
  const std::string text =
      header_of("element face 1\nproperty list uchar int vertex_indices\n") + kPlyVertices + "4 0 1 2 3\n";
  std::string old = text;
  std::replace(old.begin(), old.end(), '\n', '\r');
  std::string joined = text;
  joined.insert(text.find("end_header\n") + 11, "\xef\xbb\xbf");
  for (const std::string& file : {"\xef\xbb\xbf" + text, joined, old}) {
    const auto m = ply_of(file);
    ASSERT_TRUE(m) << m.error().message;
    EXPECT_EQ(m->triangle_count(), 2u);
  }
}

TEST(Ply, SurvivesDamagedStripsAndCorners) {
  for (const std::string& file :
       {header_of("element tristrips 1\nproperty list int int vertex_indices\n", true) +
            "8 0 1 3 2 -1 0 2 3\n" + kPlyVertices,
        header_of(
            "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n") +
            kPlyVertices + "3 0 1 2 6 0 0 .5 0 .5 1\n3 0 2 3 6 .25 0 .5 1 0 1\n"})
    test::survive_mutations(
        file, [](std::string_view name, std::span<const std::byte> bytes) { return decode_ply(name, bytes); },
        expect_sound_mesh);
}

TEST(Serialized, ChecksumDetectsAChangedByte) {
  const std::string file = file_of({mesh()});
  for (std::size_t at = 4; at < mesh().size(); ++at) {
    std::string changed = file;
    changed[at] = static_cast<char>(changed[at] ^ 0x11);
    const auto m = decode_mesh(changed), whole = decode_mesh(file);
    ASSERT_TRUE(whole);
    EXPECT_TRUE(!m || (m->positions == whole->positions && m->indices == whole->indices)) << at;
  }
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
