#include "worker/render/lights/light_vertices.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "worker/render/math/random.h"

namespace ls::render {
namespace {

// The share of the sun map's rays (SunMap) that is uniform over the whole scene. Because of it there are
// light vertices also where no learning path (a camera path traced before the first sample) found the sun.
constexpr double kSceneShare = .05;
// Smallest margin of the map's rectangle, as a share of the scene's radius.
constexpr float kSmallestMargin = 1e-4f;
// The largest |g| for which towards() evaluates the Henyey-Greenstein phase function; sharper ones are
// clamped to it, because rounding errors would dominate the estimate.
constexpr float kSharpest = .98f;
constexpr float kTiny = 1e-30f;
// A glossy surface may reflect much light that arrives at a grazing angle, so towards() adds this constant to
// the cosines.
constexpr float kGrazing = .1f;
// This share of the mean estimate of a block is added to each positive estimate. It bounds the weight of
// vertices that contribute more than estimated.
constexpr float kAnyShare = .1f;

}  // namespace

SunMap::SunMap(const V3& direction, float radius) : direction_(direction), radius_(radius) {
  const Frame frame(direction);
  u_ = frame.to_world({1, 0, 0});
  v_ = frame.to_world({0, 1, 0});
}

void SunMap::finish() {
  found_.finish(radius_ * kSmallestMargin, kSceneShare);
  everywhere_ = static_cast<float>(found_.outside_share() / (4 * double{radius_} * double{radius_}));
}

SunMap::Ray SunMap::sample(const std::array<std::uint32_t, 4>& bits) const {
  const V2 u(unit_float(bits[1]), unit_float(bits[2]));
  const V2 at = found_.sample(bits[0], u).value_or((u * 2 - V2(1)) * radius_);
  return {u_ * at.x + v_ * at.y - direction_ * (2 * radius_), density_at(at)};
}

void LightVertices::add(const LightVertex& vertex, const Look& look) {
  const std::size_t lane = vertices_.size() % kCandidates;
  if (lane == 0) blocks_.emplace_back();
  vertices_.push_back(vertex);
  Block& b = blocks_.back();
  b.x[lane] = vertex.p.x, b.y[lane] = vertex.p.y, b.z[lane] = vertex.p.z;
  b.nx[lane] = look.n.x, b.ny[lane] = look.n.y, b.nz[lane] = look.n.z;
  b.ax[lane] = look.axis.x, b.ay[lane] = look.axis.y, b.az[lane] = look.axis.z;
  b.other_side[lane] = look.both_sides ? 1.f : 0.f;
  b.round[lane] = vertex.medium == kNone ? 0.f : 1.f;
  b.g[lane] = std::clamp(look.g, -kSharpest, kSharpest);
  b.even[lane] = look.even;
  b.lobe[lane] = look.lobe;
  b.density[lane] = look.density;
}

void LightVertices::finish() {
  vertices_.shrink_to_fit();
  blocks_.shrink_to_fit();
}

// Estimates the contributions of a block's light vertices y to the receiver x, without visibility and
// transmittance, and stores them in `target`. Up to a common factor they are L_y * f_x * c / (c r^2 + p_x
// cos_y). L_y is the radiance times cosine that y's Look describes, c is Look::density, r the distance, and
// cos_y the cosine at y (1 in media). f_x is the BSDF times cosine or the phase function at x, and p_x its
// density. Surfaces at x count as diffuse. Entries of the block without a vertex have a radiance of 0.
void LightVertices::towards(const Block& b, const Receiver& x, Lane& target) {
  const float other_side = x.both_sides ? 1.f : 0.f;
  const auto phase = [](float g, float cosine) {
    const float q = std::max(1 + g * g - 2 * g * cosine, kTiny);
    return (1 - g * g) / (q * std::sqrt(q));
  };
  Lane cos_y, scale, wx, wy, wz, r2;
  for (std::size_t k = 0; k < kCandidates; ++k) {
    const float fx = b.x[k] - x.p.x, fy = b.y[k] - x.p.y, fz = b.z[k] - x.p.z;
    r2[k] = fx * fx + fy * fy + fz * fz + kTiny;
    const float inverse = 1 / std::sqrt(r2[k]);
    wx[k] = fx * inverse, wy[k] = fy * inverse, wz[k] = fz * inverse;
    const float cosine = -(b.nx[k] * wx[k] + b.ny[k] * wy[k] + b.nz[k] * wz[k]);
    cos_y[k] = std::max(std::max(cosine, -cosine * b.other_side[k]), b.round[k]);
    const float lobe = b.lobe[k] * phase(b.g[k], wx[k] * b.ax[k] + wy[k] * b.ay[k] + wz[k] * b.az[k]);
    scale[k] = (b.even[k] * cos_y[k] + (cos_y[k] > 0 ? lobe : 0.f)) * b.density[k];
  }
  if (x.in_medium) {
    for (std::size_t k = 0; k < kCandidates; ++k) {
      const float p_x =
          phase(std::clamp(x.g, -kSharpest, kSharpest), wx[k] * x.d.x + wy[k] * x.d.y + wz[k] * x.d.z) *
          kInvFourPi;
      target[k] = scale[k] * p_x / (b.density[k] * r2[k] + p_x * cos_y[k] + kTiny);
    }
  } else {
    for (std::size_t k = 0; k < kCandidates; ++k) {
      const float cosine = wx[k] * x.n.x + wy[k] * x.n.y + wz[k] * x.n.z;
      const float cos_x = std::max(cosine, -cosine * other_side);
      const float f_x = cos_x > 0 ? (cos_x + kGrazing) * kInvPi : 0.f;
      target[k] = scale[k] * f_x / (b.density[k] * r2[k] + f_x * cos_y[k] + kTiny);
    }
  }
}

void LightVertices::prefetch(std::uint32_t block) const {
  constexpr std::size_t kLine = 64;
  if (blocks_.empty()) return;
  const auto* at = reinterpret_cast<const char*>(&blocks_[index_of(block)]);
  for (std::size_t i = 0; i < sizeof(Block); i += kLine) __builtin_prefetch(at + i);
}

LightVertices::Choice LightVertices::choose(const Receiver& x, std::uint32_t block, float u) const {
  if (blocks_.empty()) return {};
  const std::size_t i = index_of(block);
  Lane target;
  towards(blocks_[i], x, target);
  float sum = 0;
  for (const float t : target) sum += t;
  if (!(sum > 0) || !std::isfinite(sum)) return {};
  const float any = kAnyShare * sum / kCandidates;
  sum = 0;
  for (float& t : target) {
    if (t > 0) t += any;
    sum += t;
  }
  float left = u * sum;
  std::size_t k = kCandidates;
  for (std::size_t j = 0; j < kCandidates; ++j) {
    if (!(target[j] > 0)) continue;
    k = j;
    left -= target[j];
    if (left < 0) break;
  }
  CHECK(k < kCandidates, "a sum of nothing is positive");
  return {&vertices_[i * kCandidates + k], sum / target[k] * static_cast<float>(blocks_.size())};
}

std::shared_ptr<const LightVertices> LightVertexCache::get(std::uint64_t set, const Build& build) {
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    const auto it = std::find_if(kept_.begin(), kept_.end(), [&](const auto& k) { return k.first == set; });
    if (it != kept_.end())
      kept_.splice(kept_.begin(), kept_, it);
    else
      kept_.emplace_front(set, std::make_shared<Slot>());
    if (kept_.size() > kKept) kept_.pop_back();
    slot = kept_.front().second;
  }
  std::call_once(slot->once, [&] { slot->vertices = std::make_shared<const LightVertices>(build(set)); });
  return slot->vertices;
}

}  // namespace ls::render
