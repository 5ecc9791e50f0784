#include "worker/render/lights/local_lights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ls::render {
namespace {

// The share of the choices that the table of all lights makes; learned probabilities make the others.
constexpr double kTablePart = .25;
// A cell (node of the k-d tree) is divided if it has more visits (vertices of learning paths) than this.
constexpr std::ptrdiff_t kVisitsOfCell = 32;
// A cell's mean is smoothed: it also includes the mean of its parent cell, with the weight of this many
// visits.
constexpr double kVisitsOfParent = 16;
constexpr std::size_t kSides = 7, kInMedia = 6;

// The class of a point by the side to which its normal faces. It is given by the axis along which the normal
// is longest and by the sign of the normal's component along this axis. Points in media, which have no
// normal, are a class of their own.
std::size_t side_of(const V3& n) {
  if (n == V3(0)) return kInMedia;
  const V3 size(std::abs(n.x), std::abs(n.y), std::abs(n.z));
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  return static_cast<std::size_t>(2 * axis + (n[axis] < 0 ? 1 : 0));
}

}  // namespace

void LightVisits::add(const V3& p, const V3& n, std::span<const float> found) {
  double all = 0;
  for (const float v : found) all += double{v};
  if (!(all > 0) || !std::isfinite(all) || !is_finite(p)) return;
  places.push_back({p, n});
  for (const float v : found) values.push_back(static_cast<float>(double{v} / all));
}

void LightVisits::add(const LightVisits& more) {
  places.insert(places.end(), more.places.begin(), more.places.end());
  values.insert(values.end(), more.values.begin(), more.values.end());
}

struct LocalLights::Builder {
  using Index = std::uint32_t;
  using Means = std::vector<double>;  // for each light, the mean square of its share in the arriving light

  LocalLights& of;
  const LightVisits& visits;
  std::span<const double> table;

  Means means(std::span<const Index> some, const Means& around) const {
    Means sums(of.lights_, 0.);
    for (const Index i : some)
      for (std::size_t l = 0; l < of.lights_; ++l) {
        const double v = double{visits.values[i * of.lights_ + l]};
        sums[l] += v * v;
      }
    const double of_parent = around.empty() ? 0 : kVisitsOfParent;
    const double count = static_cast<double>(some.size()) + of_parent;
    for (std::size_t l = 0; l < of.lights_; ++l)
      sums[l] = count > 0 ? (sums[l] + (around.empty() ? 0 : of_parent * around[l])) / count : 0;
    return sums;
  }

  void add_leaf(std::size_t node, const Means& squares) {
    double sum = 0;
    for (const double s : squares) sum += std::sqrt(s);
    std::vector<double> p(of.lights_);
    for (std::size_t l = 0; l < of.lights_; ++l)
      p[l] = kTablePart * table[l] + (1 - kTablePart) * (sum > 0 ? std::sqrt(squares[l]) / sum : table[l]);
    of.nodes_[node].next = static_cast<std::uint32_t>(of.tables_.size());
    append_light_table(p, of.tables_);
  }

  void build(std::size_t node, std::span<Index> some, const Means& around) {
    const Means squares = means(some, around);
    V3 low(kInfinity), high(-kInfinity);
    for (const Index i : some)
      for (int c = 0; c < 3; ++c) {
        low[c] = std::min(low[c], visits.places[i].p[c]);
        high[c] = std::max(high[c], visits.places[i].p[c]);
      }
    const V3 extent = high - low;
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    if (std::ssize(some) <= kVisitsOfCell || !(extent[axis] > 0) || !std::isfinite(extent[axis]))
      return add_leaf(node, squares);
    std::vector<float> coordinates;
    for (const Index i : some) coordinates.push_back(visits.places[i].p[axis]);
    const auto middle = coordinates.begin() + std::ssize(coordinates) / 2;
    std::ranges::nth_element(coordinates, middle);
    // Points on the plane count as above it. If at least half of the points have the lowest coordinate, the
    // plane is at the next higher one, so that all other points are above it.
    float plane = *middle;
    if (!(plane > low[axis])) {
      plane = high[axis];
      for (const float x : coordinates)
        if (x > low[axis]) plane = std::min(plane, x);
    }
    // The partition is stable, so that means() always adds in the same order, on which the last bits of its
    // sums depend.
    const auto above = std::ranges::stable_partition(some, [&](Index i) {
                         return visits.places[i].p[axis] < plane;
                       }).begin();
    const std::size_t first = of.nodes_.size();
    of.nodes_.resize(first + 2);
    of.nodes_[node] = {plane, static_cast<std::uint32_t>(first), static_cast<std::uint8_t>(axis)};
    build(first, {some.begin(), above}, squares);
    build(first + 1, {above, some.end()}, squares);
  }
};

LocalLights::LocalLights(const LightVisits& visits, std::span<const double> table) : lights_(table.size()) {
  Builder builder{*this, visits, table};
  std::array<std::vector<Builder::Index>, kSides> sides;
  for (std::size_t i = 0; i < visits.places.size(); ++i)
    sides[side_of(visits.places[i].n)].push_back(static_cast<Builder::Index>(i));
  std::vector<Builder::Index> all(visits.places.size());
  std::iota(all.begin(), all.end(), Builder::Index{0});
  const Builder::Means means = builder.means(all, {});
  in_media_ = !sides[kInMedia].empty();
  nodes_.resize(kSides);
  for (std::size_t side = 0; side < kSides; ++side) builder.build(side, sides[side], means);
}

std::span<const std::uint32_t> LocalLights::table_at(const V3& p, const V3& n) const {
  const Node* node = &nodes_[side_of(n)];
  while (node->axis != kLeaf) node = &nodes_[node->next + (p[node->axis] < node->plane ? 0 : 1)];
  return {tables_.data() + node->next, lights_};
}

DrawnLight LocalLights::draw(std::uint32_t word, const V3& p, const V3& n) const {
  const auto last = table_at(p, n);
  const std::uint32_t light = light_of_word(last, word);
  return {light, probability_in_table(last, light)};
}

float LocalLights::probability(std::uint32_t light, const V3& p, const V3& n) const {
  return probability_in_table(table_at(p, n), light);
}

std::uint64_t LocalLights::bytes() const {
  return nodes_.size() * sizeof(Node) + tables_.size() * sizeof(tables_[0]);
}

}  // namespace ls::render
