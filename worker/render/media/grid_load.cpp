#include "worker/render/media/grid_load.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "core/assets/grid_files.h"
#include "core/base/file_form.h"
#include "core/base/overloaded.h"
#include "worker/render/base/build_stop.h"
#include "worker/render/media/field_build.h"
#include "worker/render/media/vdb_process.h"

namespace ls::render {
namespace {

bool is_vdb(std::string_view name) {
  return without_gz(name).ends_with(".vdb") || without_gz(name).ends_with(".nvdb");
}
bool is_raw(std::string_view name) { return without_gz(name).ends_with(".bin"); }

// Returns the map from world to index coordinates for a given map from scene to index coordinates.
Affine from_world(const Affine& scene_to_index, V3d center, double scale) {
  return scene_to_index * Affine::scale_translate(1 / scale, center);
}

Result<LoadedVolume> constant_volume(const ConstVolume& v, V3d center, double scale, double to_sigma) {
  // A volume without a file fills the unit cube transformed by to_world, as in Mitsuba.
  LoadedVolume out;
  for (int c = 0; c < 3; ++c) {
    out.channels.emplace_back(std::array<int, 3>{1, 1, 1}, std::vector<float>{static_cast<float>(v.value[c])},
                              from_world(Affine(v.to_world).inverse(), center, scale), V3d(0, 0, 0),
                              V3d(1, 1, 1), to_sigma);
  }
  if (v.value[0] == v.value[1] && v.value[1] == v.value[2]) out.channels.resize(1);
  return out;
}

std::vector<float> channel(std::span<const float> interleaved, std::size_t c, std::size_t of) {
  std::vector<float> values(interleaved.size() / of);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = interleaved[of * i + c];
  return values;
}

// Loads a .vol file or a raw grid. The values of a raw grid are at nodes, the outermost of which are on the
// faces of the file's box.
Result<LoadedVolume> vol_file(const GridVolume& v, const AssetLoader& files, V3d center, double scale,
                              double to_sigma) {
  auto path = files.path(v.file);
  if (!path) return tl::unexpected(path.error());
  const bool raw = is_raw(files.name(v.file));
  auto data = raw ? load_raw_grid(*path, files.name(v.file), v.order) : load_vol(*path, files.name(v.file));
  if (!data) return tl::unexpected(data.error());
  const bool node_centred = v.node_centred || raw;
  // The file's values are at the cell centres of the unit cube or, if node_centred is true, at nodes, the
  // outermost of which are on the cube's faces. The cube is first mapped to the file's box, if this is
  // requested, and then transformed by to_world.
  Affine unit_to_scene(v.to_world);
  if (v.use_grid_bbox || raw) {
    const V3d lo(data->bbox_min[0], data->bbox_min[1], data->bbox_min[2]),
        hi(data->bbox_max[0], data->bbox_max[1], data->bbox_max[2]);
    Affine box;
    box.a = {hi.x - lo.x, 0, 0, 0, hi.y - lo.y, 0, 0, 0, hi.z - lo.z};
    box.b = lo;
    unit_to_scene = unit_to_scene * box;
  }
  if (!unit_to_scene.invertible()) {
    return fail(Errc::invalid_argument, fmt::format("{}: the grid's transform (to_world, and the file's "
                                                    "bounding box if it is used) cannot be inverted",
                                                    files.name(v.file)));
  }
  const int n[3] = {static_cast<int>(data->nx), static_cast<int>(data->ny), static_cast<int>(data->nz)};
  if (node_centred && std::min({n[0], n[1], n[2]}) < 2) {
    return fail(
        Errc::invalid_argument,
        fmt::format("{}: {} x {} x {} values can't be nodes from face to face of a box: that takes two "
                    "along each axis",
                    files.name(v.file), n[0], n[1], n[2]));
  }
  if (v.border && (node_centred || v.wrap != Wrap::clamp || std::min({n[0], n[1], n[2]}) < 3))
    return fail(Errc::invalid_argument,
                fmt::format("{}: a grid with a border has three voxels or more along each axis, their values "
                            "at their centres, and does not wrap",
                            files.name(v.file)));
  // How far the box reaches beyond the outermost values, in voxels. It is negative if the outermost values
  // are a border outside of the box.
  const double margin = node_centred ? 0 : v.border ? -.5 : .5;
  const V3d last(n[0] - 1, n[1] - 1, n[2] - 1), steps = last + V3d(2 * margin);
  Affine to_nodes;
  to_nodes.a = {steps.x, 0, 0, 0, steps.y, 0, 0, 0, steps.z};
  to_nodes.b = V3d(-margin);
  const Affine world_to_index = from_world(to_nodes * unit_to_scene.inverse(), center, scale);
  LoadedVolume out;
  out.clamped = data->negatives;
  for (std::uint32_t c = 0; c < data->channels; ++c)
    out.channels.emplace_back(
        std::array<int, 3>{n[0], n[1], n[2]},
        data->channels == 1 ? std::move(data->values) : channel(data->values, c, data->channels),
        world_to_index, V3d(-margin), last + V3d(margin), to_sigma, v.filter, v.wrap);
  return out;
}

Result<LoadedVolume> vdb_file(const GridVolume& v, const AssetLoader& files, V3d center, double scale,
                              double to_sigma) {
  auto path = files.path(v.file);
  if (!path) return tl::unexpected(path.error());
  const std::string& name = files.name(v.file);
  if (v.border) return fail(Errc::invalid_argument, fmt::format("{}: only a `.vol` has a border", name));
  if (auto ok = BuildStop::go_on(); !ok) return tl::unexpected(ok.error());
  const auto file = VdbFile::read(*path, v.grid_name, kMaxGridBytes);
  if (!file) return fail(file.error().code, fmt::format("{}: {}", name, file.error().message));
  const VdbShape& shape = file->shape();
  Transform t;
  std::copy(std::begin(shape.index_to_scene), std::end(shape.index_to_scene), t.m.begin());
  const Affine nodes_to_scene = Affine(v.to_world) * Affine(t);
  if (!nodes_to_scene.invertible()) {
    return fail(
        Errc::invalid_argument,
        fmt::format("{}: the grid's transform (to_world times the file's own) cannot be inverted", name));
  }
  LoadedVolume out;
  out.clamped = shape.negatives;
  // Values are at nodes. From the active voxels to the next nodes outwards the values fall to the background
  // value, and there the grid ends, so wrapping has no effect.
  for (int c = 0; c < shape.channels; ++c)
    out.channels.emplace_back(Voxels(file->channel(c)), from_world(nodes_to_scene.inverse(), center, scale),
                              V3d(0), V3d(shape.size[0] - 1, shape.size[1] - 1, shape.size[2] - 1), to_sigma,
                              v.filter);
  return out;
}

}  // namespace

Result<LoadedVolume> load_volume(const Volume& volume, const AssetLoader& files, V3d center, double scale,
                                 double to_sigma) {
  return std::visit(
      overloaded{[&](const ConstVolume& v) { return constant_volume(v, center, scale, to_sigma); },
                 [&](const GridVolume& v) {
                   return is_vdb(files.name(v.file)) ? vdb_file(v, files, center, scale, to_sigma)
                                                     : vol_file(v, files, center, scale, to_sigma);
                 },
                 [&](const auto&) -> Result<LoadedVolume> {
                   auto built = build_field(volume, files, center, scale);
                   if (!built) return tl::unexpected(built.error());
                   LoadedVolume out;
                   out.channels.push_back(std::move(built->grid));
                   out.clamped = built->clamped;
                   out.field = std::move(built->field);
                   return out;
                 }},
      volume);
}

}  // namespace ls::render
