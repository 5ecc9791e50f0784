#include "formats/made_files.h"

#include <fmt/format.h>

#include <bit>

#include "core/base/digest.h"

namespace ls::scene {
namespace {

void put(std::string& out, std::uint32_t x) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(x >> shift & 0xff);
}
void put(std::string& out, float x) { put(out, std::bit_cast<std::uint32_t>(x)); }
void put(std::string& out, int x) { put(out, static_cast<std::uint32_t>(x)); }

// The values of a vertex attribute, such as normals, and the names of its components in the PLY file.
struct Part {
  const std::vector<float>& values;
  std::vector<std::string_view> names;
};
std::vector<Part> parts_of(const MadeMesh& mesh) {
  std::vector<Part> parts{{mesh.positions, {"x", "y", "z"}}};
  for (const Part& p : {Part{mesh.normals, {"nx", "ny", "nz"}},
                        {mesh.uvs, {"u", "v"}},
                        {mesh.colours, {"r", "g", "b"}},
                        {mesh.opacities, {"opacity_x"}}})
    if (!p.values.empty()) parts.push_back(p);
  return parts;
}

Result<std::string> kept(AssetSource& assets, const std::string& name, const std::string& bytes) {
  const auto asset = assets.keep(name, bytes);
  if (!asset) return tl::unexpected<Error>(asset.error());
  return name;
}

}  // namespace

std::size_t MadeMesh::bytes() const {
  const std::size_t numbers =
      positions.size() + normals.size() + uvs.size() + colours.size() + opacities.size();
  return 512 + 4 * numbers + 13 * (indices.size() / 3);
}

Result<std::string> keep_made(AssetSource& assets, std::string_view kind, std::string_view ending,
                              const std::string& bytes) {
  return kept(assets, fmt::format("{}-{}{}", kind, sha256(bytes).hex().substr(0, 16), ending), bytes);
}

Result<std::string> keep_made(AssetSource& assets, const MadeMesh& mesh) {
  const std::vector<Part> parts = parts_of(mesh);
  std::string out = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.corners());
  for (const Part& p : parts)
    for (const std::string_view name : p.names) out += fmt::format("property float {}\n", name);
  out += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                     mesh.indices.size() / 3);
  out.reserve(mesh.bytes());
  for (std::size_t i = 0; i < mesh.corners(); ++i)
    for (const Part& p : parts)
      for (std::size_t k = 0; k < p.names.size(); ++k) put(out, p.values[p.names.size() * i + k]);
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    if (i % 3 == 0) out += '\3';
    put(out, mesh.indices[i]);
  }
  return keep_made(assets, "mesh", ".ply", out);
}

namespace {

std::string bytes_of(const MadeGrid& grid) {
  std::string out("VOL\3", 4);
  put(out, 1);  // the code of the value type float32 in Mitsuba's volume format
  for (const int n : grid.sides) put(out, n);
  put(out, grid.channels);
  for (const float x : {0.f, 0.f, 0.f, 1.f, 1.f, 1.f}) put(out, x);
  out.reserve(out.size() + 4 * grid.values.size());
  for (const float x : grid.values) put(out, x);
  return out;
}

}  // namespace

Result<std::string> keep_made(AssetSource& assets, const MadeGrid& grid) {
  return keep_made(assets, "grid", ".vol", bytes_of(grid));
}

}  // namespace ls::scene
