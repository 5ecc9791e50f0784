#include "tests/property/random_assets.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <vector>

#include "core/image/exr/exr_file.h"
#include "tests/support/scene_builder.h"

namespace ls::test {
namespace {

template <class T>
void put(std::string& s, T v) {
  s.append(reinterpret_cast<const char*>(&v), sizeof v);
}

// What files hold that nobody meant. NaN and infinity are refused by the loaders.
float odd_value(Dice& dice, bool refusable) {
  constexpr std::array<float, 10> kOdd{0, -0.f, -.5f, 1e-45f, 1e-38f, 1e-30f, 65504, 1e6f, 1e20f, 1e38f};
  if (refusable && dice.chance(.03))
    return dice.chance(.5) ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
  return kOdd[dice.below(kOdd.size())];
}

int side(Dice& dice) { return dice.chance(.15) ? 1 : 2 + static_cast<int>(dice.below(6)); }

std::string hdr(Dice& dice, int w, int h) {
  std::string s = fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", h, w);
  for (int i = 0; i < w * h; ++i) {
    for (int c = 0; c < 3; ++c) s += static_cast<char>(dice.below(128) + 64);
    s += static_cast<char>(126 + dice.below(4));
  }
  return s;
}

std::string exr(Dice& dice, RandomAssets& assets, int w, int h, double wild) {
  ExrPicture p;
  p.size = {w, h};
  for (const char* name : {"R", "G", "B"}) {
    ExrFloat plane;
    for (int i = 0; i < w * h; ++i)
      plane.values.push_back(dice.chance(wild) ? odd_value(dice, true) : static_cast<float>(dice.unit()));
    for (const float v : plane.values) assets.note(static_cast<double>(v));
    p.channels[name] = plane;
  }
  const auto bytes = write_exr(p);
  if (!bytes) throw std::runtime_error(bytes.error().message);
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

std::string bmp(Dice& dice, int w, int h) {
  const int row = (3 * w + 3) / 4 * 4;
  std::string s = "BM";
  put<std::uint32_t>(s, static_cast<std::uint32_t>(54 + row * h));
  put<std::uint32_t>(s, 0);
  put<std::uint32_t>(s, 54);
  put<std::uint32_t>(s, 40);
  put<std::int32_t>(s, w);
  put<std::int32_t>(s, h);
  put<std::uint16_t>(s, 1);
  put<std::uint16_t>(s, 24);
  for (int i = 0; i < 6; ++i) put<std::uint32_t>(s, 0);
  for (int i = 0; i < row * h; ++i)
    s += static_cast<char>(dice.chance(.2) ? 255 * dice.below(2) : dice.below(256));
  return s;
}

struct Mesh {
  std::vector<std::array<double, 3>> points, normals;
  std::vector<std::array<double, 2>> uvs;  // as many as points, or none
  std::vector<std::array<int, 3>> faces;
};

// A bent sheet, or triangles in any order: about half of them share vertices.
Mesh random_mesh(Dice& dice, double wild) {
  Mesh m;
  const int n = 3 + static_cast<int>(dice.below(12));
  const bool uvs = dice.chance(.6), normals = dice.chance(.5);
  for (int i = 0; i < n; ++i) {
    std::array<double, 3> p{dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1)};
    if (dice.chance(wild)) p[dice.below(3)] = dice.extreme({-1e6, 1e6});
    if (i > 0 && dice.chance(wild)) p = m.points.back();
    m.points.push_back(p);
    if (uvs) {
      std::array<double, 2> t{dice.between(-1, 2), dice.between(-1, 2)};
      if (dice.chance(wild)) t[dice.below(2)] = dice.extreme({-1e9, 1e9});
      m.uvs.push_back(t);
    }
    if (normals) {
      std::array<double, 3> v{dice.gauss(), dice.gauss(), dice.gauss()};
      if (dice.chance(wild)) v = {0, 0, dice.extreme({-1e30, 1e30})};
      m.normals.push_back(v);
    }
  }
  const auto vertex = [&] { return static_cast<int>(dice.below(static_cast<std::size_t>(n))); };
  for (int i = 0; i < n + 2; ++i) {
    const int a = vertex();
    m.faces.push_back(dice.chance(wild) ? std::array{a, a, vertex()}
                                        : std::array{a, (a + 1) % n, (a + 2) % n});
  }
  return m;
}

std::vector<float> grid_values(Dice& dice, RandomAssets& assets, std::size_t count, double wild,
                               GridKind kind) {
  std::vector<float> values(count);
  const bool sparse = dice.chance(.4);
  for (float& v : values) {
    v = sparse && dice.chance(.7) ? 0.f : static_cast<float>(dice.unit());
    if (kind == GridKind::density) v *= 2;
    if (kind == GridKind::temperature) v = static_cast<float>(v * 4000);
    if (dice.chance(wild / 10)) v = odd_value(dice, true);
    assets.note(static_cast<double>(v));
  }
  return values;
}

}  // namespace

Asset RandomAssets::add(const std::string& ending, const std::string& bytes) {
  static const ScratchFolder folder;
  Asset asset{fmt::format("file{}{}", named_.size(), ending), sha256(bytes), bytes.size()};
  const auto path = folder.path() / asset.digest.hex();
  if (!std::filesystem::exists(path)) std::ofstream(path, std::ios::binary) << bytes;
  files_[asset.digest] = path;
  named_[asset.name] = asset;
  return asset;
}

Result<Asset> RandomAssets::find(std::string_view name) {
  const auto it = named_.find(name);
  if (it == named_.end()) return fail(Errc::not_found, fmt::format("there is no file \"{}\"", name));
  return it->second;
}

Result<std::string> RandomAssets::text(std::string_view name) {
  return fail(Errc::not_found, fmt::format("there is no file \"{}\"", name));
}

Asset random_image(Dice& dice, RandomAssets& assets, double wild) {
  const int w = side(dice), h = side(dice);
  switch (dice.below(3)) {
    case 0:
      return assets.add(".hdr", hdr(dice, w, h));
    case 1:
      return assets.add(".bmp", bmp(dice, w, h));
    default:
      return assets.add(".exr", exr(dice, assets, w, h, wild));
  }
}

Asset random_environment(Dice& dice, RandomAssets& assets, double wild, SkyMapping mapping) {
  const int w = 2 + static_cast<int>(dice.below(6)), other = 3 + static_cast<int>(dice.below(5));
  const int h = mapping == SkyMapping::equal_area ? w : other;
  if (dice.chance(.4)) return assets.add(".hdr", hdr(dice, w, h));
  return assets.add(".exr", exr(dice, assets, w, h, wild));
}

Asset random_obj(Dice& dice, RandomAssets& assets, double wild) {
  const Mesh m = random_mesh(dice, wild);
  std::string s;
  for (const auto& p : m.points) s += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
  for (const auto& t : m.uvs) s += fmt::format("vt {} {}\n", t[0], t[1]);
  for (const auto& v : m.normals) s += fmt::format("vn {} {} {}\n", v[0], v[1], v[2]);
  for (const auto& f : m.faces) {
    s += "f";
    for (const int i : f)
      s += m.uvs.empty()
               ? (m.normals.empty() ? fmt::format(" {}", i + 1) : fmt::format(" {0}//{0}", i + 1))
               : (m.normals.empty() ? fmt::format(" {0}/{0}", i + 1) : fmt::format(" {0}/{0}/{0}", i + 1));
    s += '\n';
  }
  return assets.add(".obj", s);
}

Asset random_ply(Dice& dice, RandomAssets& assets, double wild) {
  const Mesh m = random_mesh(dice, wild);
  std::string s = fmt::format("ply\nformat ascii 1.0\nelement vertex {}\n", m.points.size());
  for (const char* axis : {"x", "y", "z"}) s += fmt::format("property float {}\n", axis);
  if (!m.normals.empty())
    for (const char* axis : {"nx", "ny", "nz"}) s += fmt::format("property float {}\n", axis);
  if (!m.uvs.empty()) s += "property float u\nproperty float v\n";
  s += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", m.faces.size());
  for (std::size_t i = 0; i < m.points.size(); ++i) {
    s += fmt::format("{} {} {}", m.points[i][0], m.points[i][1], m.points[i][2]);
    if (!m.normals.empty()) s += fmt::format(" {} {} {}", m.normals[i][0], m.normals[i][1], m.normals[i][2]);
    if (!m.uvs.empty()) s += fmt::format(" {} {}", m.uvs[i][0], m.uvs[i][1]);
    s += '\n';
  }
  for (const auto& f : m.faces) s += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]);
  return assets.add(".ply", s);
}

// One mesh, version 4, double precision; the format is told in core/assets/serialized.cpp.
Asset random_serialized(Dice& dice, RandomAssets& assets, double wild) {
  const Mesh m = random_mesh(dice, wild);
  std::string plain;
  put<std::uint32_t>(plain, (m.normals.empty() ? 0u : 1u) | (m.uvs.empty() ? 0u : 2u) | 0x2000u);
  plain += "mesh";
  plain += '\0';
  put<std::uint64_t>(plain, m.points.size());
  put<std::uint64_t>(plain, m.faces.size());
  for (const auto& p : m.points)
    for (const double x : p) put(plain, x);
  for (const auto& n : m.normals)
    for (const double x : n) put(plain, x);
  for (const auto& t : m.uvs)
    for (const double x : t) put(plain, x);
  for (const auto& f : m.faces)
    for (const int i : f) put(plain, static_cast<std::uint32_t>(i));
  std::string packed(compressBound(plain.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
           plain.size());
  packed.resize(size);
  std::string s;
  put<std::uint16_t>(s, 0x041c);
  put<std::uint16_t>(s, 4);
  s += packed;
  put<std::uint64_t>(s, 0);
  put<std::uint32_t>(s, 1);
  return assets.add(".serialized", s);
}

Asset random_vol(Dice& dice, RandomAssets& assets, double wild, GridKind kind) {
  const int channels = kind != GridKind::temperature && dice.chance(.4) ? 3 : 1;
  const int n[3] = {side(dice), side(dice), side(dice)};
  std::string s = "VOL\3";
  for (const std::int32_t v : {1, n[0], n[1], n[2], channels}) put(s, v);
  for (const float v : {-1.f, -1.f, -1.f, 1.f, 1.f, 1.f}) put(s, v);
  for (const float v :
       grid_values(dice, assets, static_cast<std::size_t>(n[0] * n[1] * n[2] * channels), wild, kind))
    put(s, v);
  return assets.add(".vol", s);
}

Asset random_bin(Dice& dice, RandomAssets& assets, double wild, GridKind kind) {
  const int n[3] = {1 + side(dice), 1 + side(dice), 1 + side(dice)};
  std::string s;
  for (const std::int32_t v : n) put(s, v);
  for (const float v : {-1.f, -1.f, -1.f, 1.f, 1.f, 1.f}) put(s, v);
  for (const float v : grid_values(dice, assets, static_cast<std::size_t>(n[0] * n[1] * n[2]), wild, kind))
    put(s, v);
  return assets.add(".bin", s);
}

}  // namespace ls::test
