#include "worker/render/lights/light_tree.h"

#include <algorithm>
#include <cmath>

#include "worker/render/base/work_counters.h"

namespace ls::render {
namespace {

// cos_less() returns cos(max(0, a - b)) and cos_more() returns cos(min(pi, a + b)), for angles a and b from 0
// to pi.
float cos_less(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a > cos_b ? 1 : cos_a * cos_b + sin_a * sin_b;
}
float cos_more(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a < -cos_b ? -1 : cos_a * cos_b - sin_a * sin_b;  // -1 if a + b exceeds pi
}
float sine(float cosine) { return safe_sqrt((1 - cosine) * (1 + cosine)); }

}  // namespace

// Builds the tree. Each node's lights are split in two, by bins along each axis. The split minimises the sum
// over both halves of intensity * surface area of the box * (2 - R), where R is 1 for lights that all face
// the same way and 0 for lights that face everywhere.
class LightTree::Builder {
 public:
  Builder(const std::vector<LightBounds>& lights, LightTree& tree) : lights_(lights), tree_(tree) {}

  void run() {
    order_.resize(lights_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    tree_.trails_.resize(lights_.size());
    tree_.nodes_.reserve(2 * lights_.size() - 1);
    // Nodes are made depth first, the left child before the right one. Right children wait on the stack with
    // their parent's index.
    std::vector<Job> jobs{{0, static_cast<std::uint32_t>(order_.size()), 0, 0, kNoParent}};
    while (!jobs.empty()) {
      const Job job = jobs.back();
      jobs.pop_back();
      const auto self = static_cast<std::uint32_t>(tree_.nodes_.size());
      if (job.parent != kNoParent) tree_.nodes_[job.parent].right = self;
      tree_.nodes_.push_back(node_of(job));
      if (job.end - job.begin == 1) {
        tree_.nodes_[self].light = order_[job.begin];
        tree_.trails_[order_[job.begin]] = job.trail;
        continue;
      }
      const std::uint32_t middle = split(job);
      jobs.push_back({middle, job.end, job.depth + 1, job.trail | (std::uint64_t{1} << job.depth), self});
      jobs.push_back({job.begin, middle, job.depth + 1, job.trail, kNoParent});
    }
  }

 private:
  static constexpr std::uint32_t kNoParent = 0xffffffffu;
  static constexpr int kBins = 16;
  // From depth kDeepest on, a node's lights are split into halves of equal size, regardless of cost. So even
  // 2^24 lights, the most allowed, are separated at depth 30 + 24 at the latest, and the turns on the way to
  // a light, one bit each, fit the 64 bits of its trail (trails_).
  static constexpr int kDeepest = 30;
  struct Job {
    std::uint32_t begin, end;
    int depth;
    std::uint64_t trail;
    std::uint32_t parent;  // node whose right child this job makes; kNoParent: a left child or the root
  };
  struct Pile {
    V3 low{1e30f, 1e30f, 1e30f}, high{-1e30f, -1e30f, -1e30f};
    V3d facing{0, 0, 0};
    double intensity = 0;

    void add(const LightBounds& b) {
      grow(b.low, b.high);
      intensity += b.intensity;
      facing += V3d(b.axis) * (b.intensity * std::max(0.f, b.cos_spread));
    }
    void add(const Pile& p) {
      grow(p.low, p.high);
      intensity += p.intensity;
      facing += p.facing;
    }
    void grow(const V3& a, const V3& b) {
      for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], a[k]), high[k] = std::max(high[k], b[k]);
    }
    double cost() const {
      if (!(intensity > 0)) return 0;
      const V3d e = V3d(high) - V3d(low);
      return intensity * (e.x * e.y + e.y * e.z + e.z * e.x) * (2 - facing.length() / intensity);
    }
  };
  V3 middle_of(std::uint32_t light) const { return (lights_[light].low + lights_[light].high) * .5f; }

  Node node_of(const Job& job) const {
    Pile all;
    V3d facing(0, 0, 0);
    for (std::uint32_t i = job.begin; i < job.end; ++i) {
      all.add(lights_[order_[i]]);
      facing += V3d(lights_[order_[i]].axis);
    }
    Node n;
    n.center = (all.low + all.high) * .5f;
    const V3 half = (all.high - all.low) * .5f;
    n.radius2 = dot(half, half);
    n.intensity = static_cast<float>(all.intensity);
    n.axis = facing.length() > 0 ? V3(facing.normalized()) : V3(0, 0, 1);
    n.cos_spread = 1;
    n.cos_reach = 1;
    for (std::uint32_t i = job.begin; i < job.end; ++i) {
      const LightBounds& b = lights_[order_[i]];
      const float between = std::clamp(dot(n.axis, b.axis), -1.f, 1.f);
      n.cos_spread =
          std::min(n.cos_spread, cos_more(sine(between), between, sine(b.cos_spread), b.cos_spread));
      n.cos_reach = std::min(n.cos_reach, b.cos_reach);
    }
    n.sin_spread = sine(n.cos_spread);
    return n;
  }

  // Returns the position, in the order of lights, of the first light of the right half; each half has at
  // least one light.
  std::uint32_t split(const Job& job) {
    const std::uint32_t half = job.begin + (job.end - job.begin) / 2;
    if (job.depth >= kDeepest) return half;
    V3 low(1e30f), high(-1e30f);
    for (std::uint32_t i = job.begin; i < job.end; ++i) {
      const V3 m = middle_of(order_[i]);
      for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], m[k]), high[k] = std::max(high[k], m[k]);
    }
    double least = 0;
    int best_axis = -1, best_bin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(high[axis] > low[axis])) continue;
      const auto [cost, bin] = best_cut(job, axis, low[axis], high[axis]);
      if (best_axis < 0 || cost < least) least = cost, best_axis = axis, best_bin = bin;
    }
    if (best_axis < 0) return half;
    const auto first = order_.begin() + job.begin, last = order_.begin() + job.end;
    const auto right = std::stable_partition(first, last, [&](std::uint32_t i) {
      return bin_of(middle_of(i)[best_axis], low[best_axis], high[best_axis]) < best_bin;
    });
    if (right == first || right == last) return half;
    return static_cast<std::uint32_t>(right - order_.begin());
  }

  struct Cut {
    double cost;
    int bin;  // first bin of the right half
  };
  Cut best_cut(const Job& job, int axis, float low, float high) const {
    Pile bins[kBins], right[kBins];
    for (std::uint32_t i = job.begin; i < job.end; ++i)
      bins[bin_of(middle_of(order_[i])[axis], low, high)].add(lights_[order_[i]]);
    right[kBins - 1] = bins[kBins - 1];
    for (int b = kBins - 2; b > 0; --b) {
      right[b] = bins[b];
      right[b].add(right[b + 1]);
    }
    Cut best{0, 0};
    Pile left;
    for (int b = 1; b < kBins; ++b) {
      left.add(bins[b - 1]);
      const double cost = left.cost() + right[b].cost();
      if (best.bin == 0 || cost < best.cost) best = {cost, b};
    }
    return best;
  }
  static int bin_of(float x, float low, float high) {
    return std::clamp(static_cast<int>((x - low) / (high - low) * kBins), 0, kBins - 1);
  }

  const std::vector<LightBounds>& lights_;
  LightTree& tree_;
  std::vector<std::uint32_t> order_;
};

LightTree LightTree::build(const std::vector<LightBounds>& lights) {
  LightTree tree;
  Builder(lights, tree).run();
  return tree;
}

float LightTree::importance(const Node& node, const V3& x, const V3& n) {
  const V3 f = x - node.center;
  const float d2 = dot(f, f);
  const float base = node.intensity / std::max(std::max(d2, node.radius2), 1e-20f);
  // From inside the ball, a light of the node may be in any direction.
  if (!(d2 > node.radius2)) return base;
  const V3 way = f * (1 / std::sqrt(d2));
  const float sin2_ball = node.radius2 / d2, sin_ball = std::sqrt(sin2_ball),
              cos_ball = safe_sqrt(1 - sin2_ball);
  const float cos_way = std::clamp(dot(node.axis, way), -1.f, 1.f);
  const float beyond = cos_less(sine(cos_way), cos_way, node.sin_spread, node.cos_spread);
  const float cos_a = cos_less(sine(beyond), beyond, sin_ball, cos_ball);
  // The tolerance keeps rounding from excluding points on the rim of the emission range.
  if (cos_a < node.cos_reach - 1e-4f) return 0;
  float value = base * std::max(cos_a, 1.f / 16);
  if (dot(n, n) > 0) {
    const float cos_i = std::min(std::abs(dot(n, way)), 1.f);
    value *= cos_less(sine(cos_i), cos_i, sin_ball, cos_ball);
  }
  return value;
}

std::uint64_t LightTree::left_share(std::uint32_t node, std::uint64_t words, const V3& x, const V3& n) const {
  const double a = importance(nodes_[node + 1], x, n), b = importance(nodes_[nodes_[node].right], x, n);
  if (!(a + b > 0) || !std::isfinite(a + b)) return words - words / 2;
  const auto share = static_cast<std::uint64_t>(std::floor(static_cast<double>(words) * (a / (a + b)) + .5));
  // Every child with positive importance gets at least one word, if there are at least two words.
  const std::uint64_t at_least = a > 0 && words > 1 ? 1 : 0, at_most = b > 0 && words > 1 ? words - 1 : words;
  return std::clamp(share, at_least, at_most);
}

LightTree::Found LightTree::find(std::uint64_t word, std::uint64_t words, const V3& x, const V3& n) const {
  LS_COUNT(light_tree);
  std::uint32_t i = 0;
  while (nodes_[i].right != 0) {
    const std::uint64_t left = left_share(i, words, x, n);
    if (word < left) {
      words = left;
      ++i;
    } else {
      word -= left;
      words -= left;
      i = nodes_[i].right;
    }
  }
  return {nodes_[i].light, words};
}

std::uint64_t LightTree::words_of(std::uint32_t light, std::uint64_t words, const V3& x, const V3& n) const {
  LS_COUNT(light_tree);
  std::uint64_t trail = trails_[light];
  for (std::uint32_t i = 0; nodes_[i].right != 0 && words > 0; trail >>= 1) {
    const std::uint64_t left = left_share(i, words, x, n);
    words = trail & 1 ? words - left : left;
    i = trail & 1 ? nodes_[i].right : i + 1;
  }
  return words;
}

}  // namespace ls::render
