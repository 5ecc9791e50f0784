#include <blosc.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <string_view>
#include <vector>

#include "worker/render/vdb/nvdb.h"

namespace ls::render {
namespace {

constexpr std::uint64_t kFileBytes = std::uint64_t{8} << 30;
constexpr std::size_t kMaxGrids = 4096;
constexpr std::uint32_t kMaxName = 1 << 16;
constexpr std::uint32_t kAbi = 32;
// The largest number of bytes to which one compressed byte can expand: an upper bound for zlib (at most 1032)
// and for Blosc's codecs. A grid that claims to expand more is damaged.
constexpr std::uint64_t kMaxExpansion = 1100;
// NanoVDB compresses a buffer by Blosc in pieces of kBloscPiece bytes.
constexpr std::uint64_t kBloscPiece = std::uint64_t{1} << 30;

enum Codec : std::uint16_t { kPlain, kZip, kBlosc };

bool is_magic(std::string_view m) { return m == "NanoVDB0" || m == "NanoVDB2"; }

struct Entry {
  std::string name;
  // The grid's buffer: its offset and size in the file, and its decompressed size, in bytes
  std::uint64_t at = 0, stored = 0, bytes = 0;
  std::uint16_t codec = kPlain;
};

// Returns the table of all grids in the file. A file is a sequence of segments: 16 bytes of header, then for
// each grid 176 bytes of metadata and its name, then the grids themselves.
std::vector<Entry> table_of(const NvdbBytes& file) {
  std::vector<Entry> all;
  for (std::uint64_t at = 0; at < file.size();) {
    const auto magic = file.part(at, 8);
    if (!is_magic({reinterpret_cast<const char*>(magic.data()), 8}))
      throw Refused{1, "not a readable NanoVDB file: damaged at byte " + std::to_string(at)};
    const std::uint32_t version = file.get<std::uint32_t>(at + 8), major = version >> 21;
    if (major != kAbi)  // early files have a plain number in place of major, minor and patch
      throw Refused{1,
                    "a NanoVDB file of version " +
                        (major == 0 ? std::to_string(version)
                                    : std::to_string(major) + "." + std::to_string(version >> 10 & 0x7ff)) +
                        "; known is version 32"};
    const auto count = file.get<std::uint16_t>(at + 12), codec = file.get<std::uint16_t>(at + 14);
    if (codec > kBlosc) throw Refused{1, "a NanoVDB file of unknown compression " + std::to_string(codec)};
    at += 16;
    const std::size_t first = all.size();
    for (int i = 0; i < count; ++i) {
      if (all.size() == kMaxGrids)
        throw Refused{2, "the file holds more than " + std::to_string(kMaxGrids) + " grids"};
      Entry& e = all.emplace_back();
      e.bytes = file.get<std::uint64_t>(at);
      e.stored = file.get<std::uint64_t>(at + 8);
      e.codec = codec;
      const auto length = file.get<std::uint32_t>(at + 136);
      if (length > kMaxName) throw Refused{1, "not a readable NanoVDB file: a grid's name is too long"};
      const auto name = file.part(at + 176, length);
      e.name.assign(reinterpret_cast<const char*>(name.data()), length);
      e.name.resize(std::min(e.name.size(), e.name.find('\0')));
      at += 176 + length;
    }
    for (std::size_t i = first; i < all.size(); ++i) {
      all[i].at = at;
      file.part(at, all[i].stored);
      at += all[i].stored;
    }
  }
  return all;
}

[[noreturn]] void damaged(const Entry& e) {
  throw Refused{1, "not a readable NanoVDB file: the data of grid '" + e.name + "' is damaged"};
}

void unzip(const Entry& e, const NvdbBytes& file, std::span<std::byte> to) {
  const auto packed = file.get<std::uint64_t>(e.at);
  if (packed > e.stored - 8) damaged(e);
  uLongf n = to.size();
  const int rc = uncompress(reinterpret_cast<Bytef*>(to.data()), &n,
                            reinterpret_cast<const Bytef*>(file.part(e.at + 8, packed).data()), packed);
  if (rc != Z_OK || n != to.size()) damaged(e);
}

void unblosc(const Entry& e, const NvdbBytes& file, std::span<std::byte> to) {
  std::uint64_t at = e.at;
  while (!to.empty()) {
    const std::size_t piece = std::min<std::uint64_t>(to.size(), kBloscPiece);
    const auto packed = file.get<std::uint64_t>(at);
    if (packed > e.stored || at + 8 + packed > e.at + e.stored) damaged(e);
    const auto from = file.part(at + 8, packed);
    std::size_t whole = 0;
    if (blosc_cbuffer_validate(from.data(), from.size(), &whole) != 0 || whole != piece) damaged(e);
    if (blosc_decompress_ctx(from.data(), to.data(), piece, 1) != static_cast<int>(piece)) damaged(e);
    to = to.subspan(piece);
    at += 8 + packed;
  }
}

}  // namespace

std::size_t choose_grid(const std::vector<std::string>& names, const std::string& wanted) {
  if (names.empty()) throw Refused{1, "the file holds no grid"};
  if (wanted.empty() && names.size() == 1) return 0;
  const auto found = std::ranges::find(names, wanted.empty() ? "density" : wanted);
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "'" : ", '") + name + "'";
  if (wanted.empty())
    throw Refused{1,
                  "the file holds several grids and no single one is called 'density'; name one of " + all};
  throw Refused{1, "it has no grid '" + wanted + "'; there are " + all};
}

void set_box(const Coord& lo, const Coord& end, VdbVoxels& out) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int64_t n = end[k] - lo[k], lead = lo[k] & (kNodeSide - 1);
    if (n <= 0 || n > kMaxVdbSide)
      throw Refused{1, "grid '" + out.name + "' spans " + std::to_string(n) +
                           " voxels along an axis; the limit is " + std::to_string(kMaxVdbSide)};
    out.shape.size[k] = out.tree.size[k] = static_cast<std::int32_t>(n);
    out.shape.lead[k] = out.tree.lead[k] = static_cast<std::int32_t>(lead);
  }
}

Refused too_large(const VdbVoxels& grid, std::uint64_t max_bytes) {
  std::string size;
  for (const std::int32_t n : grid.shape.size) size += (size.empty() ? "" : " x ") + std::to_string(n);
  return {2, "grid '" + grid.name + "' of " + size + " voxels takes more than " +
                 std::to_string(max_bytes >> 20) +
                 " MiB of memory, which is the limit; resample it to larger voxels, or cut off a part"};
}

bool is_nvdb(std::string_view head) { return is_magic(head.substr(0, 8)); }

std::vector<std::byte> file_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const auto size = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in.tellg()));
  if (!in) throw Refused{1, "the file cannot be read"};
  if (size > kFileBytes) throw Refused{2, "a file of " + std::to_string(size) + " bytes; the limit is 8 GiB"};
  std::vector<std::byte> bytes(size);
  in.seekg(0);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw Refused{1, "the file cannot be read"};
  return bytes;
}

VdbVoxels decode_nvdb(std::span<const std::byte> bytes, const std::string& wanted, std::uint64_t max_bytes) {
  const NvdbBytes file(bytes, "a file");
  const std::vector<Entry> all = table_of(file);
  std::vector<std::string> names;
  for (const Entry& entry : all) names.push_back(entry.name);
  const Entry& e = all[choose_grid(names, wanted)];
  if (e.codec == kPlain) {
    if (e.stored != e.bytes) damaged(e);
    return read_nvdb_grid(e.name, file.part(e.at, e.bytes), max_bytes);
  }
  if (e.stored < 8 || e.bytes / kMaxExpansion > e.stored) damaged(e);
  std::vector<std::byte> buffer(e.bytes);
  if (e.codec == kZip)
    unzip(e, file, buffer);
  else
    unblosc(e, file, buffer);
  return read_nvdb_grid(e.name, buffer, max_bytes);
}

}  // namespace ls::render
