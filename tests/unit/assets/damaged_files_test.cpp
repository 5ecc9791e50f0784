// What becomes of files of every format that are cut short, or of which bytes were changed: they are refused
// by name, or read as the whole file is, or (formats without marks and checksums) what was done cannot be
// known. The table of docs/reference/odd-files.md is made here.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfTiledOutputFile.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <jpeglib.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>

#include "core/assets/grid_files.h"
#include "core/assets/image.h"
#include "core/assets/mesh.h"
#include "core/base/file_form.h"
#include "core/image/exr/memory.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::append;
using test::bytes_of;

constexpr std::uint32_t kWidth = 24, kHeight = 16;

// What a reader makes of a file, as comparable numbers; nullopt: it refuses the file.
using Content = std::optional<std::vector<float>>;
using Reader = std::function<Content(std::string_view name, std::span<const std::byte>)>;

Content content(const Result<ImageData>& image) {
  if (!image) return std::nullopt;
  std::vector<float> all{static_cast<float>(image->width), static_cast<float>(image->channels)};
  all.insert(all.end(), image->u8.begin(), image->u8.end());
  all.insert(all.end(), image->f32.begin(), image->f32.end());
  return all;
}
Content content(const Result<MeshData>& mesh) {
  if (!mesh) return std::nullopt;
  std::vector<float> all(mesh->indices.begin(), mesh->indices.end());
  for (const auto* part : {&mesh->positions, &mesh->normals, &mesh->uvs})
    all.insert(all.end(), part->begin(), part->end());
  return all;
}
Content content(const Result<GridData>& grid) {
  if (!grid) return std::nullopt;
  std::vector<float> all{static_cast<float>(grid->nx), static_cast<float>(grid->ny)};
  all.insert(all.end(), grid->bbox_min.begin(), grid->bbox_min.end());
  all.insert(all.end(), grid->bbox_max.begin(), grid->bbox_max.end());
  all.insert(all.end(), grid->values.begin(), grid->values.end());
  return all;
}

const Reader kImage = [](std::string_view name, std::span<const std::byte> file) {
  return content(decode_image(name, file));
};
const Reader kObj = [](std::string_view name, std::span<const std::byte> file) {
  return content(decode_obj(name, file));
};
const Reader kPly = [](std::string_view name, std::span<const std::byte> file) {
  return content(decode_ply(name, file));
};
const Reader kSerialized = [](std::string_view name, std::span<const std::byte> file) {
  return content(decode_serialized(name, file, 0));
};
const Reader kVol = [](std::string_view name, std::span<const std::byte> file) {
  return content(decode_vol(name, file));
};
const Reader kBin = [](std::string_view name, std::span<const std::byte> file) {
  return content(decode_raw_grid(name, file, GridOrder::x_fastest));
};
// As read_asset() does with a file packed by gzip.
Reader packed(const Reader& inner) {
  return [inner](std::string_view name, std::span<const std::byte> file) -> Content {
    const auto plain = plain_bytes(name, std::vector(file.begin(), file.end()));
    return plain ? inner(name, *plain) : std::nullopt;
  };
}

// A picture without a repetition, so that no lost byte goes unseen.
std::uint8_t code(std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  return static_cast<std::uint8_t>((x * 37 + y * 101 + c * 59 + x * y * 7) % 251 + 2);
}
std::vector<std::uint8_t> codes(std::uint32_t channels) {
  std::vector<std::uint8_t> all;
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < kWidth; ++x)
      for (std::uint32_t c = 0; c < channels; ++c) all.push_back(code(x, y, c));
  return all;
}

std::string png(int type, int depth) {
  std::string out;
  png_structp p = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(p);
  png_set_write_fn(
      p, &out,
      [](png_structp w, png_bytep data, png_size_t n) {
        static_cast<std::string*>(png_get_io_ptr(w))->append(reinterpret_cast<char*>(data), n);
      },
      [](png_structp) {});
  png_set_IHDR(p, info, kWidth, kHeight, depth, type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  std::vector<png_color> palette(256);
  std::vector<png_byte> opacity(256);
  for (std::size_t i = 0; i < 256; ++i) {
    palette[i] = {static_cast<png_byte>(i), static_cast<png_byte>(255 - i), 7};
    opacity[i] = static_cast<png_byte>(i);
  }
  if (type == PNG_COLOR_TYPE_PALETTE) {
    png_set_PLTE(p, info, palette.data(), 256);
    png_set_tRNS(p, info, opacity.data(), 256, nullptr);
  }
  png_write_info(p, info);
  const std::uint32_t channels = type == PNG_COLOR_TYPE_RGB_ALPHA ? 4 : type == PNG_COLOR_TYPE_RGB ? 3 : 1;
  std::vector<std::uint8_t> bytes = codes(channels * static_cast<std::uint32_t>(depth / 8));
  for (std::uint32_t y = 0; y < kHeight; ++y) png_write_row(p, bytes.data() + y * bytes.size() / kHeight);
  png_write_end(p, nullptr);
  png_destroy_write_struct(&p, &info);
  return out;
}

std::string jpeg(bool progressive) {
  jpeg_compress_struct c{};
  jpeg_error_mgr errors;
  c.err = jpeg_std_error(&errors);
  jpeg_create_compress(&c);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&c, &bytes, &size);
  c.image_width = kWidth;
  c.image_height = kHeight;
  c.input_components = 3;
  c.in_color_space = JCS_RGB;
  jpeg_set_defaults(&c);
  if (progressive) jpeg_simple_progression(&c);
  jpeg_start_compress(&c, TRUE);
  std::vector<std::uint8_t> all = codes(3);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    unsigned char* row = all.data() + y * kWidth * 3;
    jpeg_write_scanlines(&c, &row, 1);
  }
  jpeg_finish_compress(&c);
  std::string out(reinterpret_cast<char*>(bytes), size);
  jpeg_destroy_compress(&c);
  std::free(bytes);
  return out;
}

std::string bmp() {
  std::string s = "BM";
  for (const std::uint32_t v :
       {54 + kWidth * kHeight * 3, 0u, 54u, 40u, kWidth, kHeight, 24u << 16 | 1, 0u, 0u, 0u, 0u, 0u, 0u})
    append(s, v);
  for (const std::uint8_t v : codes(3)) append(s, v);
  return s;
}
std::string tga(bool runs) {
  std::string s("\0\0\2\0\0\0\0\0\0\0\0\0", 12);
  if (runs) s[2] = 10;
  append(s, static_cast<std::uint16_t>(kWidth));
  append(s, static_cast<std::uint16_t>(kHeight));
  s += std::string("\x18\x20", 2);
  const std::vector<std::uint8_t> all = codes(3);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    if (runs) append(s, static_cast<std::uint8_t>(kWidth - 1));  // a packet of plain pixels
    s.append(reinterpret_cast<const char*>(all.data()) + y * kWidth * 3, std::size_t{kWidth} * 3);
  }
  return s;
}
std::string qoi() {
  std::string s = "qoif";
  for (const std::uint32_t v : {kWidth, kHeight})
    for (int k = 3; k >= 0; --k) append(s, static_cast<std::uint8_t>(v >> (8 * k)));
  s += std::string("\3\0", 2);
  const std::vector<std::uint8_t> all = codes(3);
  for (std::size_t i = 0; i < all.size(); i += 3)
    s += '\xfe' + std::string(reinterpret_cast<const char*>(all.data()) + i, 3);
  return s + std::string("\0\0\0\0\0\0\0\1", 8);
}
std::string hdr() {
  std::string s = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + fmt::format("-Y {} +X {}\n", kHeight, kWidth);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    s += std::string("\2\2\0", 3) + static_cast<char>(kWidth);
    for (std::uint32_t c = 0; c < 4; ++c) {
      s += static_cast<char>(kWidth);  // plain bytes
      for (std::uint32_t x = 0; x < kWidth; ++x) append(s, c == 3 ? std::uint8_t{129} : code(x, y, c));
    }
  }
  return s;
}
std::string pfm() {
  std::string s = fmt::format("PF\n{} {}\n-1\n", kWidth, kHeight);
  for (const std::uint8_t v : codes(3)) append(s, static_cast<float>(v));
  return s;
}
std::string exr(Imf::Compression compression, bool tiled) {
  exr::MemoryWriter out;
  Imf::Header header(kWidth, kHeight, 1, {0, 0}, 1, Imf::INCREASING_Y, compression);
  if (tiled) header.setTileDescription(Imf::TileDescription(8, 8, Imf::ONE_LEVEL));
  Imf::FrameBuffer buffer;
  std::vector<std::vector<float>> planes;
  planes.reserve(4);
  for (const char* name : {"A", "B", "G", "R"}) {
    auto& plane = planes.emplace_back();
    for (std::uint32_t i = 0; i < kWidth * kHeight; ++i)
      plane.push_back(
          static_cast<float>(code(i % kWidth, i / kWidth, static_cast<std::uint32_t>(planes.size()))));
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    buffer.insert(name, Imf::Slice::Make(Imf::FLOAT, plane.data(), {0, 0}, kWidth, kHeight));
  }
  if (tiled) {
    Imf::TiledOutputFile file(out, header, 0);
    file.setFrameBuffer(buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
  } else {
    Imf::OutputFile file(out, header, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(kHeight);
  }
  const auto bytes = out.take();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

constexpr int kSide = 9;  // vertices along a side of the mesh, which is a hilly square
std::array<float, 3> vertex(int i) {
  const int x = i % kSide, y = i / kSide;
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>((x * 7 + y * 13) % 10) / 4};
}
template <class Use>
void for_each_quad(Use use) {
  for (int y = 0; y + 1 < kSide; ++y)
    for (int x = 0; x + 1 < kSide; ++x) {
      const int a = y * kSide + x;
      use(std::array{a, a + 1, a + kSide + 1, a + kSide});
    }
}
std::string obj() {
  std::string s = "# a square\n";
  for (int i = 0; i < kSide * kSide; ++i)
    s += fmt::format("v {} {} {}\n", vertex(i)[0], vertex(i)[1], vertex(i)[2]);
  for_each_quad(
      [&](const auto& q) { s += fmt::format("f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1); });
  return s;
}
std::string ply(std::string_view format) {
  std::string s = fmt::format(
      "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      format, kSide * kSide, (kSide - 1) * (kSide - 1));
  const bool ascii = format == "ascii";
  for (int i = 0; i < kSide * kSide; ++i)
    if (ascii)
      s += fmt::format("{} {} {}\n", vertex(i)[0], vertex(i)[1], vertex(i)[2]);
    else
      append(s, vertex(i));
  for_each_quad([&](const auto& q) {
    if (ascii)
      s += fmt::format("4 {} {} {} {}\n", q[0], q[1], q[2], q[3]);
    else
      append(s, std::uint8_t{4}), append(s, q);
  });
  return s;
}
std::string deflated(const std::string& bytes, int window) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, 6, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&z, bytes.size()) + 32, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}
std::string serialized() {
  std::string body;
  append(body, std::uint32_t{0x1000});
  body += std::string("square\0", 7);
  append(body, std::uint64_t{kSide * kSide});
  append(body, std::uint64_t{2 * (kSide - 1) * (kSide - 1)});
  for (int i = 0; i < kSide * kSide; ++i) append(body, vertex(i));
  for_each_quad([&](const auto& q) {
    append(body, std::array{q[0], q[1], q[2]});
    append(body, std::array{q[0], q[2], q[3]});
  });
  std::string s("\x1c\x04\x04\x00", 4);
  s += deflated(body, 15);
  append(s, std::uint64_t{0});
  append(s, std::uint32_t{1});
  return s;
}
std::string ies() {
  std::string s = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 13 9 1 2 0 0 0\n1 1 50\n";
  for (int v = 0; v <= 12; ++v) s += fmt::format("{} ", 7.5 * v);
  s += "\n0 45 90 135 180 225 270 315 360\n";
  for (int h = 0; h < 9; ++h)
    for (int v = 0; v <= 12; ++v) s += fmt::format("{}{}", 100 + 7 * v + 11 * h % 88, v < 12 ? ' ' : '\n');
  return s;
}
std::string vol() {
  std::string s = "VOL\3";
  for (const std::int32_t v : {1, 8, 8, 8, 1}) append(s, v);
  for (const float v : {-1.f, -1.f, -1.f, 1.f, 1.f, 1.f}) append(s, v);
  for (int i = 0; i < 512; ++i) append(s, static_cast<float>(i + 1));
  return s;
}
std::string bin() {
  std::string s;
  for (const std::int32_t v : {8, 8, 8}) append(s, v);
  for (const float v : {-1.f, -1.f, -1.f, 1.f, 1.f, 1.f}) append(s, v);
  for (int i = 0; i < 512; ++i) append(s, static_cast<float>(i + 1));
  return s;
}

enum class Answer {
  refused,           // always refused
  refused_or_whole,  // refused, or read as the whole file is
  warned,            // as above, or a warning
  told,              // as above, but a cut between lines of faces can't be told
  pixels_checked,    // as refused_or_whole in the second half: the headers before it have no checksum
  unknown            // the format has no checksum: what was changed is read as it stands, if it can be
};
std::string_view words(Answer a, bool cut) {
  switch (a) {
    case Answer::refused:
      return "refused";
    case Answer::refused_or_whole:
      return "refused, or read as the whole file";
    case Answer::warned:
      return "refused, or a warning";
    case Answer::told:
      return "refused, or a warning; a cut at the end of a face's line can't be known";
    case Answer::pixels_checked:
      return "refused, or read as the whole file; its header alone has no checksum";
    case Answer::unknown:
      break;
  }
  return cut ? "can't be known" : "refused, or read as it stands: the format has no checksum";
}

struct Kind {
  std::string name;  // as the table says it
  std::string file_name;
  std::string bytes;
  Reader read;
  Answer cut, changed;
};

std::vector<Kind> kinds() {
  using enum Answer;
  std::vector<Kind> all = {
      {"PNG of 8 bits", "a.png", png(PNG_COLOR_TYPE_RGB, 8), kImage, refused, refused_or_whole},
      {"PNG of 16 bits with opacity", "a.png", png(PNG_COLOR_TYPE_RGB_ALPHA, 16), kImage, refused,
       refused_or_whole},
      {"PNG with a palette and opacities", "a.png", png(PNG_COLOR_TYPE_PALETTE, 8), kImage, refused,
       refused_or_whole},
      {"JPEG", "a.jpg", jpeg(false), kImage, refused_or_whole, unknown},
      {"JPEG, progressive", "a.jpg", jpeg(true), kImage, refused_or_whole, unknown},
      {"BMP", "a.bmp", bmp(), kImage, refused, unknown},
      {"TGA", "a.tga", tga(false), kImage, refused, unknown},
      {"TGA, run-length coded", "a.tga", tga(true), kImage, refused, unknown},
      {"QOI", "a.qoi", qoi(), kImage, refused_or_whole, unknown},
      {"Radiance HDR", "a.hdr", hdr(), kImage, refused, unknown},
      {"PFM", "a.pfm", pfm(), kImage, refused, unknown}};
  const std::pair<Imf::Compression, const char*> compressions[] = {{Imf::NO_COMPRESSION, "uncompressed"},
                                                                   {Imf::RLE_COMPRESSION, "RLE"},
                                                                   {Imf::ZIPS_COMPRESSION, "ZIPS"},
                                                                   {Imf::ZIP_COMPRESSION, "ZIP"},
                                                                   {Imf::PIZ_COMPRESSION, "PIZ"}};
  for (const bool tiled : {false, true})
    for (const auto& [compression, name] : compressions)
      all.push_back({fmt::format("OpenEXR, {}, {}", name, tiled ? "tiles" : "lines"), "a.exr",
                     exr(compression, tiled), kImage, refused,
                     compression == Imf::ZIP_COMPRESSION || compression == Imf::ZIPS_COMPRESSION
                         ? pixels_checked
                         : unknown});
  all.push_back({"OBJ", "a.obj", obj(), kObj, told, unknown});
  all.push_back({"PLY, ascii", "a.ply", ply("ascii"), kPly, warned, unknown});
  all.push_back({"IES", "a.ies", ies(), kImage, warned, unknown});
  all.push_back({"PLY, binary", "a.ply", ply("binary_little_endian"), kPly, refused, unknown});
  all.push_back(
      {"`.serialized`", "a.serialized", serialized(), kSerialized, refused_or_whole, refused_or_whole});
  all.push_back({"`.vol`", "a.vol", vol(), kVol, refused, unknown});
  all.push_back({"`.bin`", "a.bin", bin(), kBin, refused, unknown});
  all.push_back({"any of these packed by gzip", "a.vol.gz", deflated(vol(), 15 + 16), packed(kVol), refused,
                 refused_or_whole});
  return all;
}

constexpr std::size_t kTries = 200;

TEST(DamagedFiles, TruncatedFileIsRefusedOrReportedOrComplete) {
  for (const Kind& k : kinds()) {
    SCOPED_TRACE(k.name);
    const Content whole = k.read(k.file_name, bytes_of(k.bytes));
    ASSERT_TRUE(whole);
    std::size_t read_as_whole = 0;
    for (std::size_t i = 0; i <= kTries; ++i) {
      const std::size_t size = std::min(k.bytes.size() * i / kTries, k.bytes.size() - 1);
      const std::string cut = k.bytes.substr(0, size);  // a copy, so that a read past its end is found
      const Content got = k.read(k.file_name, bytes_of(cut));
      if (!got) continue;
      ASSERT_NE(k.cut, Answer::refused) << "read although cut to " << size << " of " << k.bytes.size();
      read_as_whole += got == whole;
      if (k.cut == Answer::told || k.cut == Answer::warned) {
        EXPECT_TRUE((k.cut == Answer::told && cut.ends_with('\n')) ||
                    !why_perhaps_cut(k.file_name, cut, cut).empty())
            << size;
      } else {
        EXPECT_TRUE(got == whole) << "read otherwise when cut to " << size << " of " << k.bytes.size();
      }
    }
    if (k.cut == Answer::refused_or_whole) {
      EXPECT_GT(read_as_whole, 0u) << "the table could say `refused`";
    }
    EXPECT_EQ(why_perhaps_cut(k.file_name, k.bytes, k.bytes), "");
  }
}

// The vertices of a second object that was cut off before its first face are told; a file of which each
// vertex is followed by faces is not.
TEST(DamagedFiles, ObjThatEndsInVerticesMayBeCut) {
  const std::string one = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const std::string& end :
       {std::string("v 5 5 5\n"), std::string("v 5 5 5\nvt 0 1\n"), std::string("v 5 5 5\nvn 0 0 1\r\n"),
        std::string("v 5 5 5\n# ten of them\n\n")})
    EXPECT_THAT(why_perhaps_cut("a.OBJ", one + end, one + end), testing::HasSubstr("ends in vertices"))
        << end;
  for (const std::string& end : {std::string(), std::string("v 5 5 5\nf 1 2 4\n"), std::string("# v 5 5 5\n"),
                                 std::string("vp 1 1\n"), std::string("g v\n"), std::string("\n\n")})
    EXPECT_EQ(why_perhaps_cut("a.obj", one + end, one + end), "") << end;
  EXPECT_EQ(why_perhaps_cut("a.obj", "v 0 0 0\n", "v 0 0 0\n"), "") << "a file without faces is refused";
  EXPECT_EQ(why_perhaps_cut("a.ies", one + "v 1 1 1\n", "v 1 1 1\n"), "");
}

TEST(DamagedFiles, ChangedByteIsRefusedOrHarmlessInFormatsWithAChecksum) {
  std::mt19937 rng(11);
  for (const Kind& k : kinds()) {
    SCOPED_TRACE(k.name);
    const Content whole = k.read(k.file_name, bytes_of(k.bytes));
    std::size_t otherwise = 0;
    for (std::size_t i = 0; i < kTries; ++i) {
      std::string changed = k.bytes;
      const std::size_t at = changed.size() * i / kTries;
      changed[at] = static_cast<char>(changed[at] ^ (1 + rng() % 255));
      const Content got = k.read(k.file_name, bytes_of(changed));
      otherwise += got && got != whole;
      if (k.changed == Answer::refused_or_whole ||
          (k.changed == Answer::pixels_checked && at >= changed.size() / 2)) {
        EXPECT_TRUE(!got || got == whole) << "byte " << at;
      }
    }
    if (k.changed == Answer::unknown) {
      EXPECT_GT(otherwise, 0u) << "the table could promise more";
    }
  }
}

TEST(DamagedFiles, PageMatchesTheTable) {
  constexpr std::string_view kBegin = "<!-- Made by DamagedFiles in assets_test; do not edit. -->\n",
                             kEnd = "<!-- End of what DamagedFiles made. -->\n";
  std::string table = "\n| format | cut short | a byte changed |\n|---|---|---|\n";
  for (const Kind& k : kinds())
    table += fmt::format("| {} | {} | {} |\n", k.name, words(k.cut, true), words(k.changed, false));
  table += "\n";
  const std::string path = LS_SOURCE_DIR "/docs/reference/odd-files.md";
  std::ifstream in(path, std::ios::binary);
  std::string page{std::istreambuf_iterator<char>(in), {}};
  const std::size_t begin = page.find(kBegin), end = page.find(kEnd);
  ASSERT_TRUE(begin != page.npos && end != page.npos && begin < end);
  const std::size_t first = begin + kBegin.size();

  if (std::getenv("LIGHTSHAFT_UPDATE_DOCS"))
    std::ofstream(path, std::ios::binary) << page.replace(first, end - first, table);
  else
    EXPECT_EQ(page.substr(first, end - first), table)
        << "run LIGHTSHAFT_UPDATE_DOCS=1 assets_test --gtest_filter='DamagedFiles.*' and commit the page";
}

}  // namespace
}  // namespace ls
