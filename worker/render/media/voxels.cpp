#include "worker/render/media/voxels.h"

#include <algorithm>
#include <utility>

#include "worker/render/bricks/bricks.h"

namespace ls::render {
namespace {

// Values are one array, which is faster to look up, unless bricks take less than kFewBricks of its memory and
// the array takes more than kSmallArray bytes.
constexpr double kFewBricks = .75;
constexpr std::uint64_t kSmallArray = 64 << 20;

std::uint64_t nodes_of(const Position& size) {
  return static_cast<std::uint64_t>(size[0]) * static_cast<std::uint64_t>(size[1]) *
         static_cast<std::uint64_t>(size[2]);
}
bool better_as_bricks(std::uint64_t brick_bytes, const Position& size) {
  const std::uint64_t array = nodes_of(size) * sizeof(float);
  return array > kSmallArray && static_cast<double>(brick_bytes) < kFewBricks * static_cast<double>(array);
}

}  // namespace

Voxels::Voxels(const Position& size, std::vector<float> values) {
  if (values.size() * sizeof(float) > kSmallArray) {
    const VoxelTree tree = tree_of(size, values);
    // Bricks take more memory than leaves, so that those of a full grid need not be made.
    const std::uint64_t each = all_halves(tree, 0) ? sizeof(std::uint16_t) : sizeof(float);
    if (better_as_bricks(tree.leaves.size() * each, size))
      if (auto bricks = make_bricks(tree, 0, values.size() * sizeof(float));
          bricks && better_as_bricks(BrickTables(*bricks).bytes(), size)) {
        *this = as_bricks({size, tree.lead, std::move(*bricks)});
        return;
      }
  }
  *this = as_array(size, std::move(values));
}

Voxels::Voxels(Bricks bricks)
    : Voxels(better_as_bricks(bricks.bytes(), bricks.size()) ? as_bricks(std::move(bricks))
                                                             : as_array(bricks.size(), bricks.dense())) {}

Voxels Voxels::as_array(const Position& size, std::vector<float> values) {
  Voxels v;
  v.size_ = size;
  v.values_ = std::make_shared<const std::vector<float>>(std::move(values));
  v.array_ = v.values_->data();
  const auto row = static_cast<std::size_t>(size[0]);
  v.steps_ = {size[0] > 1 ? std::size_t{1} : 0, size[1] > 1 ? row : 0,
              size[2] > 1 ? row * static_cast<std::size_t>(size[1]) : 0};
  return v;
}

Voxels Voxels::as_bricks(Bricks bricks) {
  Voxels v;
  v.size_ = bricks.size();
  v.bricks_ = std::make_shared<const Bricks>(std::move(bricks));
  return v;
}

std::array<float, 8> Voxels::corners_in_bricks(int x, int y, int z) const {
  return bricks_->corners(x, y, z);
}
float Voxels::in_bricks(int x, int y, int z) const { return bricks_->at(x, y, z); }
bool Voxels::halves() const { return bricks_ && bricks_->halves(); }

ValueSums Voxels::sums(const Position& a, const Position& b) const {
  if (bricks_) return bricks_->sums(a, b);
  ValueSums s;
  for (int z = a[2]; z <= b[2]; ++z)
    for (int y = a[1]; y <= b[1]; ++y) {
      const float* row = node(0, y, z);
      for (int x = a[0]; x <= b[0]; ++x) {
        s.lo = std::min(s.lo, row[x]);
        s.hi = std::max(s.hi, row[x]);
        s.sum += row[x];
      }
    }
  return s;
}

std::uint64_t Voxels::count_above(float limit, const Position& a, const Position& b) const {
  if (bricks_) return bricks_->count_above(limit, a, b);
  std::uint64_t n = 0;
  for (int z = a[2]; z <= b[2]; ++z)
    for (int y = a[1]; y <= b[1]; ++y) {
      const float* row = node(0, y, z);
      n += static_cast<std::uint64_t>(
          std::count_if(row + a[0], row + b[0] + 1, [&](float v) { return v > limit; }));
    }
  return n;
}

float Voxels::largest() const {
  if (bricks_) return bricks_->largest();
  float largest = 0;
  if (values_)
    for (const float v : *values_) largest = std::max(largest, v);
  return largest;
}

std::uint64_t Voxels::count() const { return nodes_of(size_); }
std::uint64_t Voxels::stored() const { return bricks_ ? bricks_->brick_count() * kLeafValues : count(); }
std::uint64_t Voxels::bytes() const { return bricks_ ? bricks_->bytes() : count() * sizeof(float); }

bool Voxels::operator==(const Voxels& other) const {
  if (size_ != other.size_ || !bricks_ != !other.bricks_ || !values_ != !other.values_) return false;
  return bricks_ ? *bricks_ == *other.bricks_ : !values_ || *values_ == *other.values_;
}

Voxels Voxels::mean(const Voxels& a, const Voxels& b, const Voxels& c) {
  if (a.bricks_ && b.bricks_ && c.bricks_) return as_bricks(Bricks::mean(*a.bricks_, *b.bricks_, *c.bricks_));
  std::vector<float> values;
  values.reserve(a.count());
  for (int z = 0; z < a.size_[2]; ++z)
    for (int y = 0; y < a.size_[1]; ++y)
      for (int x = 0; x < a.size_[0]; ++x)
        values.push_back(static_cast<float>((double{a.at(x, y, z)} + b.at(x, y, z) + c.at(x, y, z)) / 3));
  return as_array(a.size_, std::move(values));
}

}  // namespace ls::render
