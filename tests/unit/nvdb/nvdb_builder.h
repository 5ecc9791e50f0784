// A small NanoVDB file, byte by byte: one upper node, one lower node with a constant child, two leaves.
#pragma once

#include <Imath/half.h>
#include <blosc.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

namespace ls::test {

struct NvdbBuilder {
  std::uint32_t type = 1, grid_class = 2, version = 32u << 21 | 4u << 10;
  std::uint16_t codec = 0;
  std::string name = "density";
  // Of the node that holds everything: a multiple of 4096 in each coordinate.
  std::array<std::int32_t, 3> origin{-4096, 0, 8192};
  std::array<std::int32_t, 3> lo{0, 0, 0}, hi{23, 7, 7};  // the active voxels, from the origin on
  float background = .25f, tile = 2.5f;
  std::array<double, 9> matrix{.5, 0, 0, 0, 2, 0, 0, 0, 1};
  std::array<double, 3> offset{1, 2, 3};
  float first = 0;  // added to all voxels

  // Of voxel (x, y, z) from the origin on. Whole numbers below 256, for every type to hold.
  float value(int x, int y, int z) const {
    if (x >= 16 && x < 24) return tile;
    return first + static_cast<float>(x + 2 * y + 16 * z);
  }

  bool doubles() const { return type == 2 || type == 7; }
  std::uint64_t channels() const { return type == 6 || type == 7 ? 3 : 1; }
  // Of a channel: the first one's, twice and three times that.
  static float of_channel(float value, std::uint64_t c) { return value * static_cast<float>(c + 1); }
  std::uint64_t value_bytes() const { return doubles() ? 8 : type == 9 ? 2 : 4; }
  std::uint64_t leaf_table() const { return type == 7 ? 160 : channels() == 3 || type == 2 ? 128 : 96; }
  std::uint64_t table_step() const { return type == 7 ? 24 : type == 6 ? 16 : 8; }
  std::uint64_t upper_table() const { return type == 7 ? 8288 : 8256; }
  std::uint64_t lower_table() const { return type == 7 ? 1120 : 1088; }
  std::uint64_t root_tile() const { return type == 7 ? 64 : 32; }
  std::uint64_t leaf_bytes() const {
    switch (type) {
      case 2:
        return 128 + 8 * 512;
      case 9:
        return 96 + 2 * 512;
      case 13:
        return 96 + 256;
      case 14:
        return 96 + 512;
      case 15:
        return 96 + 1024;
      case 16:
        return 96 + 512;  // codes of 8 bits
      default:
        return leaf_table() + value_bytes() * channels() * 512;
    }
  }
  static constexpr std::uint64_t kRoot = 672 + 64;
  std::uint64_t upper() const {
    return kRoot + (type == 7 ? 192 : channels() == 3 || type == 2 ? 96 : 64) + root_tile();
  }
  std::uint64_t lower() const { return upper() + upper_table() + 32768 * table_step(); }
  std::uint64_t leaf(int i) const {
    return lower() + lower_table() + 4096 * table_step() + static_cast<std::uint64_t>(i) * leaf_bytes();
  }

  template <class T>
  static void put(std::string& b, std::uint64_t at, const T& v) {
    std::memcpy(b.data() + at, &v, sizeof v);
  }
  void put_number(std::string& b, std::uint64_t at, float v) const {
    if (channels() == 3)
      for (std::uint64_t c = 0; c < 3; ++c)
        type == 7 ? put(b, at + 8 * c, double{of_channel(v, c)}) : put(b, at + 4 * c, of_channel(v, c));
    else if (type == 2)
      put(b, at, double{v});
    else if (type == 9)
      put(b, at, Imath::half(v).bits());
    else
      put(b, at, v);
  }

  std::string buffer() const {
    std::string b(leaf(2), '\0');
    std::memcpy(b.data(), "NanoVDB0", 8);
    put(b, 16, version);
    put(b, 32, std::uint64_t{b.size()});
    for (std::size_t i = 0; i < 9; ++i) put(b, 296 + 88 + 8 * i, matrix[i]);
    for (std::size_t i = 0; i < 3; ++i) put(b, 296 + 232 + 8 * i, offset[i]);
    put(b, 632, grid_class);
    put(b, 636, type);
    put(b, 672 + 24, std::uint64_t{64});  // of the root, from the tree on
    for (std::size_t k = 0; k < 3; ++k) {
      put(b, kRoot + 4 * k, origin[k] + lo[k]);
      put(b, kRoot + 12 + 4 * k, origin[k] + hi[k]);
    }
    put(b, kRoot + 24, std::uint32_t{1});
    put_number(b, kRoot + (doubles() ? 32 : 28), background);
    const std::uint64_t tile_at = upper() - root_tile();
    std::uint64_t key = 0;
    for (std::size_t k = 0; k < 3; ++k)
      key |= std::uint64_t{static_cast<std::uint32_t>(origin[k]) >> 12} << 21 * (2 - k);
    put(b, tile_at, key);
    put(b, tile_at + 8, upper() - kRoot);
    put_number_all(b, upper() + upper_table(), 32768, background);
    put(b, upper() + 4128, std::uint8_t{1});  // child 0
    put(b, upper() + upper_table(), lower() - upper());
    put_number_all(b, lower() + lower_table(), 4096, background);
    for (int i = 0; i < 2; ++i) {  // along x, child (i, 0, 0) is number 256 i
      put(b, lower() + 544 + 32 * static_cast<std::uint64_t>(i), std::uint8_t{1});
      put(b, lower() + lower_table() + table_step() * 256 * static_cast<std::uint64_t>(i), leaf(i) - lower());
      put_leaf(b, i);
    }
    put_number(b, lower() + lower_table() + table_step() * 512, tile);
    return b;
  }
  void put_number_all(std::string& b, std::uint64_t at, int n, float v) const {
    for (int i = 0; i < n; ++i) put_number(b, at + table_step() * static_cast<std::uint64_t>(i), v);
  }
  void put_leaf(std::string& b, int i) const {
    const std::uint64_t at = leaf(i), table = at + leaf_table();
    const bool coded = type >= 13 && type <= 16;
    // value = minimum + code * quantum; of 4 bits only the multiples of 16 remain.
    const float quantum = type == 13 ? 16.f : 1.f;
    if (coded) {
      put(b, at + 80, first);
      put(b, at + 84, quantum);
    }
    if (type == 16) put(b, at + 12, std::uint32_t{3} << 29);
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z) {
          const auto n = static_cast<std::uint64_t>((x * 8 + y) * 8 + z);
          const float v = value(8 * i + x, y, z);
          if (!coded) {
            put_number(b, table + value_bytes() * channels() * n, v);
            continue;
          }
          const auto code = static_cast<std::uint32_t>((v - first) / quantum);
          if (type == 13)
            b[table + n / 2] =
                static_cast<char>(b[table + n / 2] | static_cast<char>((code & 15) << n % 2 * 4));
          else if (type == 15)
            put(b, table + 2 * n, static_cast<std::uint16_t>(code));
          else
            put(b, table + n, static_cast<std::uint8_t>(code));
        }
  }

  std::string packed(const std::string& b) const {
    const auto sized = [](const std::string& s) {
      std::string n(8, '\0');
      put(n, 0, std::uint64_t{s.size()});
      return n + s;
    };
    if (codec == 1) {
      uLongf n = compressBound(b.size());
      std::string z(n, '\0');
      compress(reinterpret_cast<Bytef*>(z.data()), &n, reinterpret_cast<const Bytef*>(b.data()), b.size());
      z.resize(n);
      return sized(z);
    }
    if (codec == 2) {
      std::string z(b.size() + BLOSC_MAX_OVERHEAD, '\0');
      z.resize(static_cast<std::size_t>(blosc_compress_ctx(5, 1, 4, b.size(), b.data(), z.data(), z.size(),
                                                           BLOSC_LZ4_COMPNAME, 1 << 18, 1)));
      return sized(z);
    }
    return b;
  }
  // A file of one grid; `b` to put another buffer into it.
  std::string file() const { return file(buffer()); }
  std::string file(const std::string& b) const {
    const std::string data = packed(b);
    std::string f(16 + 176, '\0');
    std::memcpy(f.data(), "NanoVDB0", 8);
    put(f, 8, version);
    put(f, 12, std::uint16_t{1});
    put(f, 14, codec);
    put(f, 16, std::uint64_t{b.size()});
    put(f, 24, std::uint64_t{data.size()});
    put(f, 16 + 32, type);
    put(f, 16 + 36, grid_class);
    put(f, 16 + 136, static_cast<std::uint32_t>(name.size() + 1));
    put(f, 16 + 168, codec);
    return f + name + '\0' + data;
  }
};

}  // namespace ls::test
