#include "worker/render/media/field_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/overloaded.h"
#include "worker/render/media/grid_load.h"

namespace ls::render {
namespace {

// The region in which a field is bounded by macro cells. Its index coordinates are the field's coordinates.
struct VolumeFrame {
  Affine world_to_index;
  V3d lo, hi;
  // Voxels along a side of the smallest macro cell: those of stored values, or of a box as divided below.
  int least_cell = 4;
};

// The largest number of boxes in which a field is bounded, kBoxesPerSide^3 for each macro cell. At up to 5
// microseconds for kUsualOctaves of noise each they take about a second at most. For more octaves, in all
// parts together, there are fewer boxes.
constexpr double kMostBoxes = 1 << 18, kUsualOctaves = 16;

// Returns the number of macro cells along each side.
V3d cells_of(const VolumeFrame& f, int cell) {
  V3d n;
  for (int k = 0; k < 3; ++k) n[k] = std::max(1., std::ceil((f.hi[k] - f.lo[k]) / cell));
  return n;
}

class Builder {
 public:
  Builder(const AssetLoader& files, V3d center, double scale)
      : files_(files), center_(center), scale_(scale) {}

  Result<BuiltField> run(const Volume& volume) {
    most_boxes_ = kMostBoxes * std::min(1., kUsualOctaves / octaves_of(volume));
    auto frame = frame_of(volume);
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return fail(Errc::invalid_argument, "a volume that fills no box can't be followed by rays");
    frame_ = **frame;
    if (!frame_.world_to_index.invertible())
      return fail(Errc::invalid_argument,
                  "a volume's box and to_world leave the range of numbers: it can't be inverted");
    if (auto ok = add(volume); !ok) return tl::unexpected(ok.error());
    BuiltField out;
    out.field = std::make_unique<const Field>(std::move(parts_));
    int cell = frame_.least_cell;
    for (V3d n = cells_of(frame_, cell);
         n.x * n.y * n.z * std::pow(Grid::kBoxesPerSide, 3) > most_boxes_ && cell < (1 << 20); cell *= 2)
      n = cells_of(frame_, 2 * cell);
    out.grid = Grid(*out.field, frame_.world_to_index, frame_.lo, frame_.hi, cell);
    out.clamped = clamped_;
    return out;
  }

 private:
  const Volume& volume(VolumeIndex i) const { return files_.scene.volumes.at(i.value); }
  Affine scene_to_world() const { return Affine::scale_translate(scale_, -center_ * scale_); }
  Affine world_to_scene() const { return Affine::scale_translate(1 / scale_, center_); }

  // Returns the number of octaves of noise in all parts of the volume.
  double octaves_of(const Volume& v) const {
    constexpr double kOfCloud = 13;  // with those that move the points
    return std::visit(overloaded{[](const NoiseVolume& n) { return double{1} * n.octaves; },
                                 [](const CloudVolume&) { return kOfCloud; },
                                 [&](const ProductVolume& p) {
                                   return octaves_of(volume(p.first)) + octaves_of(volume(p.second));
                                 },
                                 [&](const RemapVolume& r) { return octaves_of(volume(r.volume)); },
                                 [](const auto&) { return 0.; }},
                      v);
  }

  // Divides the box into about cubic macro cells, as many as may be bounded.
  VolumeFrame box(const Transform& to_world, const Vec3& min, const Vec3& max) const {
    const Affine own_to_world = scene_to_world() * Affine(to_world);
    const V3d lo(min[0], min[1], min[2]), size(max[0] - min[0], max[1] - min[1], max[2] - min[2]);
    V3d length;
    for (int k = 0; k < 3; ++k) {
      V3d edge(0);
      edge[k] = size[k];
      length[k] = own_to_world.vector(edge).length();
    }
    constexpr double kMostPerSide = 256;
    const double most = std::max(1., most_boxes_ / std::pow(Grid::kBoxesPerSide, 3));
    V3d n;
    for (double side = std::cbrt(length.x) * std::cbrt(length.y) * std::cbrt(length.z) / std::cbrt(most);;
         side *= 1.1) {
      for (int k = 0; k < 3; ++k) n[k] = std::clamp(std::floor(length[k] / side), 1., kMostPerSide);
      // A box whose sides overflow or underflow would never end this loop. run() refuses it later.
      if (n.x * n.y * n.z <= most || !(side > 0) || !std::isfinite(side)) break;
    }
    VolumeFrame f;
    f.lo = V3d(0);
    f.hi = n * f.least_cell;
    Affine own_to_index;
    own_to_index.a = {f.hi.x / size.x, 0, 0, 0, f.hi.y / size.y, 0, 0, 0, f.hi.z / size.z};
    own_to_index.b = -own_to_index.vector(lo);
    f.world_to_index = own_to_index * own_to_world.inverse();
    return f;
  }

  // Returns the frame of the first volume, at any depth, that has one.
  Result<std::optional<VolumeFrame>> frame_of(const Volume& v) {
    using Found = Result<std::optional<VolumeFrame>>;
    return std::visit(
        overloaded{[&](const NoiseVolume& n) -> Found { return box(n.to_world, n.min, n.max); },
                   [&](const CloudVolume& c) -> Found { return box(c.to_world, c.min, c.max); },
                   [&](const ProductVolume& p) -> Found {
                     auto first = frame_of(volume(p.first));
                     return first && !*first ? frame_of(volume(p.second)) : std::move(first);
                   },
                   [&](const RemapVolume& r) -> Found { return frame_of(volume(r.volume)); },
                   [&](const GridVolume& g) -> Found {
                     auto loaded = load(g);
                     if (!loaded) return tl::unexpected(loaded.error());
                     const Grid& grid = loaded->channels[0];
                     VolumeFrame f{grid.world_to_index(), V3d(grid.domain_lo()), V3d(grid.domain_hi())};
                     // The grid is needed again, as a part.
                     framed_ = std::move(*loaded);
                     framed_volume_ = &g;
                     return std::optional(f);
                   },
                   [](const auto&) -> Found { return std::nullopt; }},
        v);
  }

  Result<LoadedVolume> load(const GridVolume& g) const {
    constexpr double kToSigma = 1;  // the sizes of the grid's own macro cells have no effect
    auto loaded = load_volume(g, files_, center_, scale_, kToSigma);
    if (loaded && loaded->channels.size() != 1)
      return fail(Errc::invalid_argument,
                  fmt::format("{}: a grid within another volume has one channel, not {}", files_.name(g.file),
                              loaded->channels.size()));
    return loaded;
  }

  // Adds the parts of a volume, the volume's own last.
  Result<void> add(const Volume& v) {
    const Affine index_to_scene = world_to_scene() * frame_.world_to_index.inverse();
    const auto own = [&](const Transform& to_world) { return Affine(to_world).inverse() * index_to_scene; };
    return std::visit(
        overloaded{
            [&](const ConstVolume& c) -> Result<void> {
              parts_.emplace_back(Field::Constant{static_cast<float>(c.value[0])});
              return {};
            },
            [&](const GridVolume& g) -> Result<void> {
              auto loaded = framed_volume_ == &g ? std::move(framed_) : load(g);
              framed_volume_ = nullptr;
              if (!loaded) return tl::unexpected(loaded.error());
              Grid& grid = loaded->channels[0];
              clamped_ += loaded->clamped;
              const Affine to_own = grid.world_to_index() * frame_.world_to_index.inverse();
              parts_.emplace_back(Field::Stored{to_own, std::move(grid)});
              return {};
            },
            [&](const HeightFogVolume& fog) -> Result<void> {
              auto profile = height_profile(fog, center_, scale_);
              if (!profile) return tl::unexpected(profile.error());
              const Affine index_to_world = frame_.world_to_index.inverse();
              profile->base += profile->rise.dot(index_to_world.b);
              const V3d rise = profile->rise;
              for (int k = 0; k < 3; ++k) {
                V3d axis(0);
                axis[k] = 1;
                profile->rise[k] = rise.dot(index_to_world.vector(axis));
              }
              parts_.emplace_back(Field::Falling{static_cast<float>(fog.value), *profile});
              return {};
            },
            [&](const NoiseVolume& n) -> Result<void> {
              Affine to_cells = Affine::scale_translate(n.scale, V3d(n.offset[0], n.offset[1], n.offset[2])) *
                                own(n.to_world);
              parts_.emplace_back(Field::Noisy{to_cells, FractalNoise(n),
                                               static_cast<float>((n.low + n.high) / 2),
                                               static_cast<float>((n.high - n.low) / 2)});
              return {};
            },
            [&](const CloudVolume& c) -> Result<void> {
              parts_.emplace_back(Field::Cloudy{own(c.to_world), Cloud(c)});
              return {};
            },
            [&](const ProductVolume& p) -> Result<void> {
              if (auto ok = add(volume(p.first)); !ok) return ok;
              const std::size_t first = parts_.size() - 1;
              if (auto ok = add(volume(p.second)); !ok) return ok;
              parts_.emplace_back(Field::Product{first, parts_.size() - 1});
              return {};
            },
            [&](const RemapVolume& r) -> Result<void> {
              if (auto ok = add(volume(r.volume)); !ok) return ok;
              Field::Mapped m{parts_.size() - 1, r.in_low, r.in_high, r.gamma, {}, r.out_low, r.out_high};
              if (!r.positions.empty()) m.curve.emplace_back(r.positions, r.values);
              parts_.emplace_back(std::move(m));
              return {};
            }},
        v);
  }

  const AssetLoader& files_;
  const V3d center_;
  const double scale_;
  double most_boxes_ = kMostBoxes;
  VolumeFrame frame_;
  Result<LoadedVolume> framed_;                // the grid whose frame is that of the field
  const GridVolume* framed_volume_ = nullptr;  // null: none, or it is a part already
  std::vector<Field::Part> parts_;
  std::uint64_t clamped_ = 0;
};

}  // namespace

Result<HeightProfile> height_profile(const HeightFogVolume& fog, V3d center, double scale) {
  // The level, an affine function of the point before to_world, as a function of the world's point
  const Affine own = Affine(fog.to_world).inverse() * Affine::scale_translate(1 / scale, center);
  const V3d up(fog.ground_normal[0], fog.ground_normal[1], fog.ground_normal[2]);
  const V3d ground(fog.ground_point[0], fog.ground_point[1], fog.ground_point[2]);
  // Divided by its largest component first, so that its length neither overflows nor underflows
  const double largest = std::max({std::abs(up.x), std::abs(up.y), std::abs(up.z)});
  const V3d per_height = up / largest / (up / largest).length() / fog.height;
  HeightProfile profile;
  for (int k = 0; k < 3; ++k) {
    V3d axis(0);
    axis[k] = 1;
    profile.rise[k] = per_height.dot(own.vector(axis));
  }
  profile.base = per_height.dot(own.b - ground);
  const V3d& rise = profile.rise;
  if (!std::isfinite(rise.x + rise.y + rise.z + profile.base))
    return fail(Errc::invalid_argument, "the height or to_world of a heightfog leaves the range of numbers");
  return profile;
}

Result<BuiltField> build_field(const Volume& volume, const AssetLoader& files, V3d center, double scale) {
  return Builder(files, center, scale).run(volume);
}

}  // namespace ls::render
