// Images, meshes and volumes as scenes name them.
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <jpeglib.h>

#include "core/assets/grid_files.h"
#include "core/assets/image.h"
#include "core/assets/mesh.h"
#include "core/image/exr/exr_file.h"
#include "core/image/exr/final_image.h"
#include "tests/fuzz/all_targets.h"
#include "tests/unit/nvdb/nvdb_builder.h"
#include "worker/fake/fake_pixels.h"
#include "worker/render/media/vdb_reply.h"
#include "worker/render/vdb/nvdb.h"

namespace ls::fuzz {
namespace {

constexpr std::uint64_t kMostPixels = 1 << 20,
                        kMostGridBytes = 1 << 22;  // what is refused above is quick and costs nothing

template <class T>
void put(std::string& to, const T& v) {
  to.append(reinterpret_cast<const char*>(&v), sizeof v);
}
std::string text_of(const std::vector<std::byte>& b) {
  return {reinterpret_cast<const char*>(b.data()), b.size()};
}

void check(const GridData& g) {
  must(g.channels == 1 || g.channels == 3, "a grid has 1 or 3 channels");
  must(g.values.size() == std::size_t{g.nx} * g.ny * g.nz * g.channels, "a grid has all of its values");
  for (const float v : g.values)
    must(std::isfinite(v) && v >= 0, "a grid's values are finite and not negative");
}

// Looks every value up, of grids that are not too large for that.
void check(const render::Bricks& bricks) {
  const render::Position n = bricks.size();
  if (double{1} * n[0] * n[1] * n[2] > double{1 << 16}) return;
  for (const float v : bricks.dense())
    must(std::isfinite(v) && v >= 0, "a grid's values are finite and not negative");
}

std::string jpeg() {
  jpeg_compress_struct c{};
  jpeg_error_mgr error{};
  c.err = jpeg_std_error(&error);
  jpeg_create_compress(&c);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&c, &out, &size);
  c.image_width = 9, c.image_height = 5, c.input_components = 3, c.in_color_space = JCS_RGB;
  jpeg_set_defaults(&c);
  jpeg_start_compress(&c, TRUE);
  unsigned char row[27];
  for (int y = 0; y < 5; ++y) {
    for (int i = 0; i < 27; ++i) row[i] = static_cast<unsigned char>(i * 9 + y);
    unsigned char* rows[] = {row};
    jpeg_write_scanlines(&c, rows, 1);
  }
  jpeg_finish_compress(&c);
  jpeg_destroy_compress(&c);
  std::string bytes(reinterpret_cast<char*>(out), size);
  std::free(out);
  return bytes;
}

std::string bmp() {
  std::string b = "BM";
  for (const std::uint32_t v : {54u + 16u, 0u, 54u, 40u, 2u, 2u}) put(b, v);
  put(b, std::uint16_t{1}), put(b, std::uint16_t{24});
  for (int i = 0; i < 6; ++i) put(b, std::uint32_t{0});
  return b + std::string(16, '\x55');
}

// 2 x 2 pixels: of three bytes, plain and in runs, and numbers of a map.
std::vector<std::string> tgas() {
  const auto tga = [](char type, std::uint16_t map, char bits, const std::string& rest) {
    std::string b{'\0', static_cast<char>(map > 0), type};
    put(b, std::uint16_t{0}), put(b, map), put(b, static_cast<std::uint8_t>(map > 0 ? 24 : 0));
    put(b, std::uint32_t{0}), put(b, std::uint16_t{2}), put(b, std::uint16_t{2});
    return b + bits + '\x20' + rest;
  };
  return {tga(2, 0, 24, std::string(12, '\x55')), tga(2, 0, 16, std::string(8, '\x55')),
          tga(10, 0, 32,
              "\x82"
              "abcd"
              "\x01"
              "efgh"),
          tga(3, 0, 8, "abcd"), tga(9, 2, 8, std::string("abcdef\x81\0\x81\1", 10))};
}

std::string deflated(const std::string& raw) {
  uLongf n = compressBound(raw.size());
  std::string z(n, '\0');
  compress(reinterpret_cast<Bytef*>(z.data()), &n, reinterpret_cast<const Bytef*>(raw.data()), raw.size());
  z.resize(n);
  return z;
}

std::string serialized(std::uint16_t version) {
  std::string raw;
  put(raw, std::uint32_t{0x1003});  // single precision, normals and uvs
  if (version == 4) raw += std::string("mesh\0", 5);
  put(raw, std::uint64_t{3}), put(raw, std::uint64_t{1});
  for (int i = 0; i < 3 * 8; ++i) put(raw, static_cast<float>(i % 5));
  for (const std::uint32_t i : {0u, 1u, 2u}) put(raw, i);
  std::string file;
  put(file, std::uint16_t{0x041c}), put(file, version);
  file += deflated(raw);
  version == 4 ? put(file, std::uint64_t{0}) : put(file, std::uint32_t{0});
  put(file, std::uint32_t{1});
  return file;
}

std::string vol(std::int32_t type, std::int32_t channels, std::size_t value_bytes) {
  std::string b = "VOL\3";
  for (const std::int32_t v : {type, 3, 2, 2, channels}) put(b, v);
  for (const float v : {0.f, 0.f, 0.f, 1.f, 1.f, 1.f}) put(b, v);
  return b + std::string(12 * static_cast<std::size_t>(channels) * value_bytes, '\x3c');
}

std::string raw_grid() {
  std::string b;
  for (const std::int32_t v : {3, 2, 2}) put(b, v);
  for (const float v : {0.f, 0.f, 0.f, 1.f, 1.f, 1.f}) put(b, v);
  for (int i = 0; i < 12; ++i) put(b, static_cast<float>(i) - 1);
  return b;
}

// A whole NanoVDB file, most of it zeros, with what the input says written over it: rows of an offset and a
// value, four bytes each.
std::string patched(std::string bytes, Bytes patches) {
  for (; patches.size() >= 8; patches = patches.subspan(8)) {
    std::uint32_t at = 0;
    std::memcpy(&at, patches.data(), 4);
    if (at <= bytes.size() - 4) std::memcpy(bytes.data() + at, patches.data() + 4, 4);
  }
  return bytes;
}

void nvdb(std::string_view file, bool whole) {
  const auto bytes = std::as_bytes(std::span(file));
  try {
    const render::VdbVoxels grid = whole ? render::decode_nvdb(bytes, "", kMostGridBytes)
                                         : render::read_nvdb_grid("fuzz", bytes, kMostGridBytes);
    must(grid.shape.channels == 1 || grid.shape.channels == 3, "a grid has 1 or 3 channels");
    for (int c = 0; c < grid.shape.channels; ++c) {
      auto bricks = render::make_bricks(grid.tree, c, kMostGridBytes);
      if (!bricks) return must(!bricks.error().message.empty(), "what is refused is told why");
      must(render::Bricks::sound(grid.shape.size_of_box(), grid.shape.lead_of_box(), *bricks),
           "bricks that were made are sound");
      check({grid.shape.size_of_box(), grid.shape.lead_of_box(), std::move(*bricks)});
    }
  } catch (const render::Refused& refused) {
    must(!refused.text.empty(), "what is refused is told why");
  }
}

// Reads the data as a reply of lightshaft-vdb: the head without its padding, then the bricks.
void vdb_reply(Bytes input) {
  std::vector<std::byte> reply(input.size() <= sizeof(render::VdbReply)
                                   ? input.size()
                                   : render::kVdbBricksAt + input.size() - sizeof(render::VdbReply));
  const std::size_t head = std::min(input.size(), sizeof(render::VdbReply));
  std::copy_n(bytes_of(input).begin(), head, reply.begin());
  if (reply.size() >= render::kVdbBricksAt)
    std::copy(bytes_of(input).begin() + head, bytes_of(input).end(), reply.begin() + render::kVdbBricksAt);
  const auto grid = render::validated_grid(reply, kMostGridBytes);
  if (!grid) return must(!grid.error().message.empty(), "what is refused is told why");
  for (const render::BrickTables& bricks : grid->channels)
    check({grid->shape.size_of_box(), grid->shape.lead_of_box(), bricks, nullptr});
}

std::string vdb_reply_seed() {
  render::VdbReply reply{};
  reply.magic = render::kVdbMagic;
  for (std::int32_t& n : reply.shape.size) n = 2;
  reply.shape.channels = 1;
  for (int i = 0; i < 16; i += 5) reply.shape.index_to_scene[i] = 1;
  std::vector<float> values;
  for (int i = 0; i < 8; ++i) values.push_back(static_cast<float>(i) / 7);
  const auto bricks = render::make_bricks(render::tree_of({2, 2, 2}, values), 0, kMostGridBytes).value();
  reply.counts[0] = {bricks.nodes.size() / render::kNodeEntries, bricks.floats.size() / render::kBrickValues,
                     0};
  std::string bytes;
  put(bytes, reply);
  for (const std::uint32_t n : bricks.table) put(bytes, n);
  for (const std::uint32_t n : bricks.nodes) put(bytes, n);
  for (const float v : bricks.floats) put(bytes, v);
  return bytes;
}

// Of six types of values: the buffer of a grid, and a file with it.
const std::string& grid_of(std::uint8_t choice, bool whole_file) {
  static const auto made = [] {
    std::vector<std::string> all;
    for (const std::uint32_t type : {1, 2, 9, 13, 15, 16}) {
      test::NvdbBuilder builder;
      builder.type = type;
      all.push_back(builder.buffer());
      all.push_back(builder.file());
    }
    return all;
  }();
  return made[2 * (choice % (made.size() / 2)) + (whole_file ? 1 : 0)];
}

}  // namespace

void image(Bytes input) {
  // A TGA image is told by its name, and all others by their first bytes.
  const auto data = decode_image("fuzz.tga", bytes_of(input), kMostPixels);
  if (!data) return must(!data.error().message.empty(), "what is refused is told why");
  const std::size_t values = std::size_t{data->width} * data->height * data->channels;
  must(data->u8.size() + data->f32.size() == values, "an image has all of its values, in one form");
}

Seeds image_seeds() {
  Film film({{6, 4}, 4});
  for (TileIndex t = 0; t < film.grid().count(); ++t)
    (void)film.fold(t, 0, fake_partial({{}, {}, {}, film.grid().rect(t), {0, 2}}));
  ExrPicture exr{{5, 3}, {}, {}};
  for (const char* c : {"R", "G", "B"}) exr.channels[c] = ExrHalf{std::vector<float>(15, .5f)};
  ExrPicture grey{{5, 3}, {}, {}};
  grey.channels["Y"] = ExrFloat{std::vector<float>(15, .5f)};
  Seeds seeds{text_of(preview_png(film, 0).value()),
              text_of(write_exr(exr).value()),
              text_of(write_exr(grey).value()),
              jpeg(),
              bmp(),
              "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n" + std::string(16, '\x40'),
              "PF\n1 2\n-1.0\n" + std::string(24, '\x40'),
              "Pf\n2 1\n2.5\n" + std::string(8, '\x40'),
              std::string("qoif\0\0\0\3\0\0\0\2\4\0", 14) +
                  "\xfe"
                  "abc"
                  "\x72\xaa\x0f\xc1\xff"
                  "abcd"
                  "\x09"};
  for (std::string& tga : tgas()) seeds.push_back(std::move(tga));
  return seeds;
}

void mesh(Bytes input) {
  if (input.empty()) return;
  const auto file = bytes_of(input);
  const auto data = is_serialized(file) ? decode_serialized("fuzz", file, input.size() % 3 == 2)
                    : text_of(input).starts_with("ply") ? decode_ply("fuzz", file)
                                                        : decode_obj("fuzz", file);
  if (!data) return must(!data.error().message.empty(), "what is refused is told why");
  must(data->positions.size() % 3 == 0 && data->indices.size() % 3 == 0, "vertices and triangles are whole");
  must(data->normals.empty() || data->normals.size() == data->positions.size(),
       "a normal for each vertex, or none");
  must(data->uvs.empty() || data->uvs.size() / 2 == data->vertex_count(), "a uv for each vertex, or none");
  for (const std::uint32_t i : data->indices) must(i < data->vertex_count(), "indices are those of vertices");
}

Seeds mesh_seeds() {
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float z\n"
      "property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) put(binary, static_cast<float>(i == k));
    binary += 'r';
  }
  binary += '\3';
  for (const std::int32_t i : {0, 1, 2}) put(binary, i);
  return {
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/1/1 3//1\nf -4 -3 -2 -1\ng a\nusemtl "
      "b\n",
      "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
      "double z\n"
      "property float u\nproperty float v\nelement face 1\nproperty list uchar uint "
      "vertex_index\nend_header\n"
      "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n",
      binary, serialized(3), serialized(4)};
}

void volume(Bytes input) {
  if (input.empty()) return;
  const Bytes rest = input.subspan(1);
  const auto grid = [](const Result<GridData>& data) {
    data ? check(*data) : must(!data.error().message.empty(), "told why");
  };
  switch (input[0]) {
    case 'v':
      return grid(decode_vol("fuzz", bytes_of(rest)));
    case 'x':
      return grid(decode_raw_grid("fuzz", bytes_of(rest), GridOrder::x_fastest));
    case 'z':
      return grid(decode_raw_grid("fuzz", bytes_of(rest), GridOrder::z_fastest));
    case 'r':
      return vdb_reply(rest);
    case 'n':
      return nvdb(text_of(rest), true);
    case 'b':
      if (!rest.empty()) nvdb(patched(grid_of(rest[0], false), rest.subspan(1)), false);
      return;
    case 'f':
      if (!rest.empty()) nvdb(patched(grid_of(rest[0], true), rest.subspan(1)), true);
      return;
    default:
      return;
  }
}

Seeds volume_seeds() {
  test::NvdbBuilder packed;
  packed.codec = 1;
  Seeds seeds{"v" + vol(1, 1, 4), "v" + vol(1, 3, 4), "v" + vol(2, 1, 2),  "v" + vol(3, 3, 1),
              "x" + raw_grid(),   "z" + raw_grid(),   "n" + packed.file(), "r" + vdb_reply_seed()};
  for (char i = 0; i < 6; ++i) seeds.push_back(std::string("b") + i), seeds.push_back(std::string("f") + i);
  std::string patches = std::string("b") + '\0';
  for (const std::uint32_t at : {16u, 632u, 636u, 696u, 736u, 760u, 816u, 4944u})
    put(patches, at), put(patches, at);
  seeds.push_back(patches);
  return seeds;
}

}  // namespace ls::fuzz
