// Reads Mitsuba's `serialized` meshes. Their format is described in the documentation of Mitsuba's
// `serialized` shape. Meshes of version 4 have names, and the table of offsets at the end of the file has
// 64-bit numbers. In version 3 there are no names, and the offsets have 32 bits.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <optional>

#include "core/assets/mesh.h"
#include "core/assets/mesh_parts.h"
#include "core/base/bytes.h"

namespace ls {

namespace {

constexpr std::size_t kMaxNameBytes = 1 << 16;

enum Flags : std::uint32_t {
  kHasNormals = 0x1,
  kHasUvs = 0x2,
  kHasColours = 0x8,
  kFaceNormals = 0x10,
  kDouble = 0x2000  // if absent: single precision
};

// A zlib stream that is unpacked as it is read. So memory is needed only for data that exist, not for the
// size that the file claims.
class Inflater {
 public:
  explicit Inflater(std::span<const std::byte> data) : data_(data) { ok_ = inflateInit(&z_) == Z_OK; }
  ~Inflater() { inflateEnd(&z_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  bool read(void* to, std::size_t bytes) {
    auto* out = static_cast<Bytef*>(to);
    while (bytes > 0 && ok_) {
      const std::size_t step = std::min<std::size_t>(bytes, kStep);
      z_.next_out = out;
      z_.avail_out = static_cast<uInt>(step);
      while (z_.avail_out > 0 && ok_) ok_ = !ended_ && refill() && advance();
      out += step;
      bytes -= step;
    }
    return ok_;
  }
  // Reads on to the end of the stream, where zlib compares its checksum of all data. Returns false if they
  // are damaged, or if the stream does not end.
  bool finish() {
    std::array<Bytef, 256> unused;
    while (ok_ && !ended_) {
      z_.next_out = unused.data();
      z_.avail_out = unused.size();
      ok_ = refill() && advance();
    }
    return ended_;
  }
  template <class T>
  std::optional<T> take() {
    T v;
    return read(&v, sizeof v) ? std::optional<T>(v) : std::nullopt;
  }

 private:
  static constexpr std::size_t kStep = std::size_t{1} << 20;

  bool refill() {
    if (z_.avail_in > 0 || data_.empty()) return true;
    const std::size_t n = std::min(data_.size(), kStep);
    z_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(data_.data()));
    z_.avail_in = static_cast<uInt>(n);
    data_ = data_.subspan(n);
    return true;
  }
  bool advance() {
    const int result = inflate(&z_, Z_NO_FLUSH);
    ended_ = result == Z_STREAM_END;
    return result == Z_OK || ended_;
  }

  std::span<const std::byte> data_;
  z_stream z_{};
  bool ok_ = false, ended_ = false;
};

class SerializedReader {
 public:
  SerializedReader(std::string_view name, std::span<const std::byte> file) : name_(name), file_(file) {}

  Result<MeshData> read(int index) {
    const auto mesh = find(index);
    if (!mesh || !unpack(*mesh)) return bad_argument(fmt::format("'{}': {}", name_, problem_));
    return std::move(mesh_);
  }

 private:
  bool complain(std::string text) {
    problem_ = std::move(text);
    return false;
  }

  // Returns the part of the file that begins with the compressed bytes of mesh number `index`. Sets version_.
  std::optional<std::span<const std::byte>> find(int index) {
    if (!header(file_)) return std::nullopt;
    if (index == 0) return file_.subspan(4);
    const std::size_t width = version_ == 3 ? 4 : 8, size = file_.size();
    ByteReader end(file_.subspan(size - std::min<std::size_t>(size, 4)));
    const std::uint32_t count = end.take<std::uint32_t>().value_or(0);
    const auto number = static_cast<std::uint32_t>(std::max(index, 0));
    if (index < 0 || number >= count || count > (size - 4) / width) {
      complain(fmt::format("has no mesh number {}: {} of them, counted from 0, are listed at its end", index,
                           count));
      return std::nullopt;
    }
    ByteReader entry(file_.subspan(size - 4 - width * (count - number)));
    const std::uint64_t at = width == 4 ? std::uint64_t{entry.take<std::uint32_t>().value_or(0)}
                                        : entry.take<std::uint64_t>().value_or(0);
    if (at > size) {
      complain(fmt::format("mesh {} is said to begin at byte {} of {}", index, at, size));
      return std::nullopt;
    }
    const auto rest = file_.subspan(static_cast<std::size_t>(at));
    if (!header(rest)) return std::nullopt;
    return rest.subspan(4);
  }

  bool header(std::span<const std::byte> at) {
    ByteReader r(at);
    const auto format = r.take<std::uint16_t>(), version = r.take<std::uint16_t>();
    if (!format || !version || *format != 0x041C)
      return complain("is no serialized mesh (no 0x041C at its beginning)");
    if (*version != 3 && *version != 4)
      return complain(fmt::format("is of version {}; 3 and 4 are known", *version));
    version_ = *version;
    return true;
  }

  bool unpack(std::span<const std::byte> packed) {
    packed_bytes_ = packed.size();
    Inflater in(packed);
    const auto flags = in.take<std::uint32_t>();
    if (!flags) return damaged("flags");
    if (version_ == 4 && !skip_name(in)) return damaged("name");
    const auto vertices = in.take<std::uint64_t>(), triangles = in.take<std::uint64_t>();
    if (!vertices || !triangles) return damaged("size");
    if (*vertices > kMaxMeshVertices || *triangles > kMaxMeshTriangles)
      return complain(fmt::format("has {} vertices and {} triangles; the limits are {} and {}", *vertices,
                                  *triangles, kMaxMeshVertices, kMaxMeshTriangles));
    if (!plausible(*flags, *vertices, *triangles)) return false;
    const bool wide = *flags & kDouble;
    mesh_.face_normals = *flags & kFaceNormals;
    std::vector<float> unused;
    const struct {
      bool there;
      std::uint64_t width;
      std::vector<float>& values;
      const char* what;
    } parts[] = {{true, 3, mesh_.positions, "positions"},
                 {(*flags & kHasNormals) != 0, 3, mesh_.normals, "normals"},
                 {(*flags & kHasUvs) != 0, 2, mesh_.uvs, "texture coordinates"},
                 {(*flags & kHasColours) != 0, 3, unused, "colours"}};
    for (const auto& part : parts)
      if (part.there && !numbers(in, wide, *vertices * part.width, part.values)) return damaged(part.what);
    if (!faces(in, *triangles)) return false;
    return in.finish() || damaged("data");
  }

  static bool skip_name(Inflater& in) {
    for (std::size_t i = 0; i < kMaxNameBytes; ++i) {
      const auto c = in.take<char>();
      if (!c) return false;
      if (*c == 0) return true;
    }
    return false;
  }

  // Returns true if the packed bytes are enough for the vertices and triangles that the header announces:
  // zlib packs at most 1032 bytes into one. Otherwise the file is rejected before memory is allocated.
  bool plausible(std::uint32_t flags, std::uint64_t vertices, std::uint64_t triangles) {
    const std::uint64_t per_vertex =
        3 + (flags & kHasNormals ? 3 : 0) + (flags & kHasUvs ? 2 : 0) + (flags & kHasColours ? 3 : 0);
    const std::uint64_t bytes = vertices * per_vertex * (flags & kDouble ? 8 : 4) + triangles * 12;
    if (bytes / 1032 <= packed_bytes_) return true;
    return complain(fmt::format("{} vertices and {} triangles are announced, but only {} packed bytes follow",
                                vertices, triangles, packed_bytes_));
  }

  static bool numbers(Inflater& in, bool wide, std::uint64_t count, std::vector<float>& to) {
    to.resize(count);
    if (!wide) return in.read(to.data(), count * sizeof(float));
    std::array<double, 4096> part;
    for (std::uint64_t i = 0; i < count; i += part.size()) {
      const std::size_t n = std::min<std::uint64_t>(part.size(), count - i);
      if (!in.read(part.data(), n * sizeof(double))) return false;
      for (std::size_t k = 0; k < n; ++k) to[i + k] = static_cast<float>(part[k]);
    }
    return true;
  }

  bool faces(Inflater& in, std::uint64_t count) {
    if (count == 0) return complain("has no faces");
    mesh_.indices.reserve(count * 3);
    for (std::uint64_t i = 0; i < count; ++i) {
      std::array<std::uint32_t, 3> corners;
      if (!in.read(corners.data(), sizeof corners)) return damaged("triangles");
      for (const std::uint32_t c : corners)
        if (c >= mesh_.vertex_count())
          return complain(fmt::format("triangle {} names vertex {} of {}", i, c, mesh_.vertex_count()));
      add_polygon(mesh_, corners);
    }
    return true;
  }

  bool damaged(std::string_view what) {
    return complain(fmt::format("cannot be unpacked: its {} end too early or are damaged", what));
  }

  std::string_view name_;
  std::span<const std::byte> file_;
  std::uint16_t version_ = 0;
  std::size_t packed_bytes_ = 0;
  std::string problem_;
  MeshData mesh_;
};

}  // namespace

bool is_serialized(std::span<const std::byte> file) {
  return file.size() >= 2 && file[0] == std::byte{0x1C} && file[1] == std::byte{0x04};
}

Result<MeshData> decode_serialized(std::string_view name, std::span<const std::byte> file, int index) {
  return SerializedReader(name, file).read(index);
}

}  // namespace ls
