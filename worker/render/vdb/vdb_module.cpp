#include "worker/render/media/vdb_reply.h"

#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <new>
#include <string>
#include <vector>

#include "worker/render/vdb/nvdb.h"

namespace {

using ls::render::Refused;

constexpr std::uintmax_t kSmallFile = 16 << 20;

void initialize_once() {
  static std::once_flag flag;
  std::call_once(flag, [] { openvdb::initialize(); });
}

template <class T>
float component(const T& value, int) {
  return static_cast<float>(value);
}
template <class T>
float component(const openvdb::math::Vec3<T>& value, int k) {
  return static_cast<float>(value[k]);
}

template <class GridType>
void copy_values(const GridType& grid, const openvdb::CoordBBox& box, LsVdbGrid& out) {
  auto access = grid.getConstAccessor();
  const openvdb::Coord lo = box.min();
  std::size_t i = 0;
  openvdb::Coord c;
  for (int z = 0; z < out.size[2]; ++z) {
    for (int y = 0; y < out.size[1]; ++y) {
      for (int x = 0; x < out.size[0]; ++x, ++i) {
        c.reset(lo.x() + x, lo.y() + y, lo.z() + z);
        const auto value = access.getValue(c);
        for (int k = 0; k < out.channels; ++k) {
          const float v = component(value, k);
          if (!std::isfinite(v)) {
            throw Refused{1, "voxel (" + std::to_string(c.x()) + ", " + std::to_string(c.y()) + ", " +
                                 std::to_string(c.z()) + ") of grid '" + grid.getName() +
                                 "' is not a finite number"};
          }
          out.negatives += v < 0;
          out.values[i * static_cast<std::size_t>(out.channels) + static_cast<std::size_t>(k)] =
              v < 0 ? 0.f : v;
        }
      }
    }
  }
}

void place(const openvdb::GridBase& grid, const openvdb::Coord& lo, LsVdbGrid& out) {
  const auto& map = grid.transform();
  if (!map.isLinear())
    throw Refused{
        1, "grid '" + grid.getName() + "' has a perspective transform; only linear ones can be rendered"};
  const openvdb::Vec3d o = map.indexToWorld(lo.asVec3d());
  for (int k = 0; k < 3; ++k) {
    openvdb::Vec3d e = lo.asVec3d();
    e[k] += 1;
    const openvdb::Vec3d axis = map.indexToWorld(e) - o;
    for (int r = 0; r < 3; ++r) out.index_to_scene[4 * r + k] = axis[r];
  }
  for (int r = 0; r < 3; ++r) out.index_to_scene[4 * r + 3] = o[r];
  out.index_to_scene[15] = 1;
}

template <class GridType>
void convert(const openvdb::GridBase::Ptr& base, std::uint64_t max_values, LsVdbGrid& out) {
  const auto grid = openvdb::gridPtrCast<GridType>(base);
  openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  if (box.empty()) throw Refused{1, "grid '" + grid->getName() + "' is empty: it has no active voxel"};
  box.expand(1);
  out.channels = openvdb::VecTraits<typename GridType::ValueType>::IsVec ? 3 : 1;
  std::array<std::int64_t, 3> size;
  for (int k = 0; k < 3; ++k) size[k] = static_cast<std::int64_t>(box.max()[k]) - box.min()[k] + 1;
  ls::render::set_size(grid->getName(), size, max_values, out);
  place(*grid, box.min(), out);
  out.values = ls::render::room_for(ls::render::values_of(out));
  copy_values(*grid, box, out);
}

void read(const char* path, const std::string& wanted, std::uint64_t max_values, LsVdbGrid& out) {
  initialize_once();
  openvdb::io::File file(path);
  // `false` disables delayed loading, so that errors in the file occur here and not when values are used.
  file.open(false);
  // A file of a newer format version is rejected here; OpenVDB would only warn.
  if (file.fileVersion() > openvdb::OPENVDB_FILE_VERSION)
    throw Refused{1, "it is of version " + std::to_string(file.fileVersion()) +
                         " of the OpenVDB format; versions up to " +
                         std::to_string(openvdb::OPENVDB_FILE_VERSION) + " can be read"};
  std::vector<std::string> names;
  for (auto it = file.beginName(); it != file.endName(); ++it) names.push_back(it.gridName());
  const openvdb::GridBase::Ptr base = file.readGrid(names[ls::render::choose_grid(names, wanted)]);
  if (!base) throw Refused{1, "the grid cannot be read"};
  if (base->getGridClass() == openvdb::GRID_LEVEL_SET) {
    throw Refused{1,
                  "grid '" + base->getName() + "' is a level set, not a density; convert it to a fog volume"};
  }
  if (base->getGridClass() == openvdb::GRID_STAGGERED) {
    throw Refused{1, "grid '" + base->getName() +
                         "' is staggered: its values are flows through the faces of voxels, not a density"};
  }
  if (base->isType<openvdb::FloatGrid>()) return convert<openvdb::FloatGrid>(base, max_values, out);
  if (base->isType<openvdb::DoubleGrid>()) return convert<openvdb::DoubleGrid>(base, max_values, out);
  if (base->isType<openvdb::Vec3SGrid>()) return convert<openvdb::Vec3SGrid>(base, max_values, out);
  if (base->isType<openvdb::Vec3DGrid>()) return convert<openvdb::Vec3DGrid>(base, max_values, out);
  if (base->type().find("ptdataidx") != std::string::npos ||
      base->type().find("ptidx") != std::string::npos) {
    throw Refused{1,
                  "grid '" + base->getName() +
                      "' holds points, not a density; convert it to a fog volume, or give another grid_name"};
  }
  throw Refused{1, "grid '" + base->getName() + "' has values of type " + base->valueType() +
                       "; a density is float or double, one number or three"};
}

}  // namespace

extern "C" {

int ls_vdb_read(const char* path, const char* grid_name, std::uint64_t max_values, LsVdbGrid* out,
                char* error, std::uint64_t error_size) {
  *out = LsVdbGrid{};
  constexpr char kDamaged[] = "not a readable OpenVDB or NanoVDB file: damaged, or cut short";
  const auto say = [&](int code, const std::string& text) {
    std::snprintf(error, error_size, "%s", text.c_str());
    ls_vdb_free(out);
    return code;
  };
  try {
    if (ls::render::is_nvdb(path))
      ls::render::read_nvdb(path, grid_name, max_values, *out);
    else
      read(path, grid_name, max_values, *out);
    return 0;
  } catch (const Refused& r) {
    return say(r.code, r.text);
  } catch (const std::bad_alloc&) {
    // If memory runs out while a file smaller than kSmallFile is read, the file is damaged: the sizes that it
    // claims are wrong.
    std::error_code unknown;
    const auto bytes = std::filesystem::file_size(path, unknown);
    if (!unknown && bytes < kSmallFile) return say(1, kDamaged);
    return say(2, "the grid does not fit into memory");
  } catch (const std::exception& e) {
    return say(1, std::string("not a readable OpenVDB file: ") + e.what());
  } catch (...) {
    return say(1, "not a readable OpenVDB file");
  }
}

void ls_vdb_free(LsVdbGrid* grid) {
  delete[] grid->values;
  grid->values = nullptr;
}
}
