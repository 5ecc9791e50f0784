// How a light is chosen: by the table of all lights or, for a known point, also by the tree.
#include <algorithm>
#include <cmath>

#include "worker/render/lights/lights.h"
#include "worker/render/media/medium.h"

namespace ls::render {
namespace {

// The smallest number of lights with a position for which the tree is used; with fewer, only the table is
// (docs/decisions/0008-many-lights.md).
constexpr std::ptrdiff_t kTreeFrom = 32;
// Of the words that choose lights in the tree, every kTableShare-th chooses by the table. So the tree cannot
// make any light rarer than 1/16 of its share in the table.
constexpr std::uint64_t kTableShare = 16;

float probability(std::uint64_t words) { return static_cast<float>(static_cast<double>(words) * 0x1p-32); }

}  // namespace

// Moves the lights with a position to the front of the list. Area lights have a position and come first
// already, so their order does not change.
void Lights::sort_places_first() {
  const auto placed = [](const Light& l) { return has_place(l.kind); };
  if (std::count_if(lights_.begin(), lights_.end(), placed) < kTreeFrom) return;
  std::stable_partition(lights_.begin(), lights_.end(), placed);
  suns_.clear();
  for (std::uint32_t i = 0; i < lights_.size(); ++i)
    if (lights_[i].kind == Kind::sun) suns_.push_back(i);
}

void Lights::build_tree() {
  std::vector<LightBounds> all;
  for (const Light& l : lights_) {
    if (!has_place(l.kind)) break;
    all.push_back(bounds(l));
  }
  if (static_cast<std::ptrdiff_t>(all.size()) < kTreeFrom || all.size() > LightTree::kMaxLights) return;
  tree_ = LightTree::build(all);
  tree_words_ = std::uint64_t{last_[all.size() - 1]} + 1;
  table_words_ = (tree_words_ + kTableShare - 1) / kTableShare;
}

LightBounds Lights::mesh_bounds(const Light& l) const {
  LightBounds b;
  b.low = V3(kInfinity);
  b.high = V3(-kInfinity);
  const auto triangles = static_cast<std::uint32_t>(l.cdf.size());
  const auto normal = [&](std::uint32_t k) {
    const V3d v0(geometry_->vertex(l.primitive + k, 0));
    return (V3d(geometry_->vertex(l.primitive + k, 1)) - v0)
        .cross(V3d(geometry_->vertex(l.primitive + k, 2)) - v0);
  };
  V3d sum(0, 0, 0);
  for (std::uint32_t k = 0; k < triangles; ++k) {
    sum += normal(k);
    for (int corner = 0; corner < 3; ++corner) {
      const V3 p = geometry_->vertex(l.primitive + k, corner);
      for (int c = 0; c < 3; ++c) b.low[c] = std::min(b.low[c], p[c]), b.high[c] = std::max(b.high[c], p[c]);
    }
  }
  if (!(sum.length() > 0)) return b;
  const V3d axis = sum.normalized();
  double spread = 1;
  for (std::uint32_t k = 0; k < triangles; ++k) spread = std::min(spread, axis.dot(normal(k).normalized()));
  b.axis = V3(axis) * l.sign;
  b.cos_spread = static_cast<float>(std::max(-1., spread));
  return b;
}

// The bounds of a light's shape and of its emission directions. Without further information, axis and cone
// are those of a point that emits in all directions.
LightBounds Lights::shape_bounds(const Light& l) const {
  LightBounds b;
  const auto absolute = [](const V3& v) { return V3(std::abs(v.x), std::abs(v.y), std::abs(v.z)); };
  const auto box = [&](const V3& middle, const V3& half) { b.low = middle - half, b.high = middle + half; };
  switch (l.kind) {
    case Kind::parallelogram:
      box(l.position + (l.axis_u + l.axis_v) * .5f, (absolute(l.axis_u) + absolute(l.axis_v)) * .5f);
      break;
    case Kind::disk:
      box(l.position, absolute(l.axis_u) + absolute(l.axis_v));
      break;
    case Kind::sphere: {
      const Sphere& s = geometry_->spheres[l.primitive];
      box(V3(s.center), V3(static_cast<float>(s.radius)));
      break;
    }
    case Kind::cylinder: {
      const Cylinder& c = geometry_->cylinders[l.primitive];
      box(V3(c.p0 + c.axis * (c.length / 2)), absolute(V3(c.axis * (c.length / 2))) +
                                                  absolute(V3(c.u * c.radius)) +
                                                  absolute(V3(c.v * c.radius)));
      break;
    }
    case Kind::mesh:
      return mesh_bounds(l);
    default:
      box(l.position, V3(0));
  }
  if (l.kind == Kind::parallelogram || l.kind == Kind::disk) {
    b.axis = l.normal;
    b.cos_spread = 1;
  }
  return b;
}

LightBounds Lights::bounds(const Light& l) const {
  LightBounds b = shape_bounds(l);
  C3 colour = l.value;
  if (l.kind == Kind::spot) {
    const float sine = safe_sqrt(1 - l.cos_beam * l.cos_beam) * safe_sqrt(1 - l.cos_cutoff * l.cos_cutoff);
    b.axis = l.normal;
    b.cos_spread = l.cos_beam;
    b.cos_reach = l.cos_beam * l.cos_cutoff + sine;
  } else if (l.kind == Kind::projector) {
    b.axis = l.normal;
    b.cos_spread = 1 / std::sqrt(1 + l.tan_x * l.tan_x + l.tan_y * l.tan_y);
    b.cos_reach = 1;
    colour *= textures_->mean(l.radiance);
  } else if (l.area > 0) {
    colour = textures_->mean(l.radiance) * static_cast<float>(l.area);
    if (l.beam) b.cos_reach = l.cos_cutoff;
  }
  const double intensity = luminance(colour);
  b.intensity = std::isfinite(intensity) ? std::clamp(intensity, 1e-30, 1e30) : 1e30;
  return b;
}

std::uint64_t Lights::table_bytes() const {
  std::uint64_t n = lights_.size() * sizeof(Light) + last_.size() * sizeof(last_[0]);
  for (const Light& l : lights_) n += l.cdf.size() * sizeof(double);
  return n;
}

Lights::Drawn Lights::by_table(std::uint32_t word) const {
  const auto i =
      static_cast<std::uint32_t>(std::lower_bound(last_.begin(), last_.end() - 1, word) - last_.begin());
  return {i, lights_[i].probability};
}

// How many of the words below table_words_ choose the light i by the table. Of these words, w stands for the
// table's word kTableShare * w.
std::uint64_t Lights::table_words(std::uint32_t i) const {
  const std::uint64_t first = i == 0 ? 0 : std::uint64_t{last_[i - 1]} + 1, end = std::uint64_t{last_[i]} + 1;
  return (end + kTableShare - 1) / kTableShare - (first + kTableShare - 1) / kTableShare;
}

Lights::Drawn Lights::draw(std::uint32_t word, const V3& x, const V3& n) const {
  return by_tree(n) ? from_tree(word, x, n) : by_table(word);
}

Lights::Drawn Lights::from_tree(std::uint32_t word, const V3& x, const V3& n) const {
  if (word >= tree_words_) return draw(word);
  const std::uint64_t words = tree_words_ - table_words_;
  if (word >= table_words_) {
    const LightTree::Found found = tree_.find(word - table_words_, words, x, n);
    return {found.light, probability(found.words + table_words(found.light))};
  }
  const std::uint32_t i = draw(static_cast<std::uint32_t>(word * kTableShare)).light;
  return {i, probability(tree_.words_of(i, words, x, n) + table_words(i))};
}

float Lights::probability_at(std::uint32_t i, const V3& x, const V3& n) const {
  return probability(tree_.words_of(i, tree_words_ - table_words_, x, n) + table_words(i));
}

}  // namespace ls::render
