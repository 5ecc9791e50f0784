// Evaluates animations: the transforms and morph weights of nodes at one moment.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/suggest.h"
#include "common/scene/gltf/translation.h"
#include "common/scene/limits.h"

namespace ls::scene::gltf {
namespace {

using Values = std::vector<double>;

// Returns the spherical linear interpolation (slerp) between the quaternions `a` (s = 0) and `b` (s = 1),
// along the shorter arc.
Values turned(const Values& a, Values b, double s) {
  double cosine = 0;
  for (std::size_t i = 0; i < 4; ++i) cosine += a[i] * b[i];
  if (cosine < 0)
    for (double& x : b) x = -x;
  const double angle = std::acos(std::min(std::abs(cosine), 1.)), sine = std::sin(angle);
  // For quaternions that are nearly equal, the difference of linear interpolation from slerp is below the
  // rounding of a double.
  const double of_a = sine > 1e-6 ? std::sin((1 - s) * angle) / sine : 1 - s,
               of_b = sine > 1e-6 ? std::sin(s * angle) / sine : s;
  for (std::size_t i = 0; i < 4; ++i) b[i] = of_a * a[i] + of_b * b[i];
  return b;
}

class Sampler {
 public:
  Sampler(Translation& t, double seconds) : t_(t), seconds_(seconds) {}

  // Returns the value of a sampler, an item of an animation's "samplers", at the moment. All nodes that the
  // sampler animates share this value. `is_rotation`: the value is a quaternion. Empty: the sampler is wrong,
  // which has been reported.
  std::shared_ptr<const Values> at(const Item& sampler, bool is_rotation) {
    const auto [known, is_new] = known_.try_emplace({sampler.identity(), is_rotation});
    if (!is_new) return known->second;
    Values values = read(sampler, is_rotation);
    numbers_ += values.size();
    // The values of the file's JSON have the same limit.
    if (numbers_ > kMaxGltfValues)
      values = wrong(sampler, fmt::format("animations give more than {} numbers at a time: split the scene",
                                          kMaxGltfValues));
    return known->second = std::make_shared<const Values>(std::move(values));
  }

 private:
  Values read(const Item& sampler, bool is_rotation) {
    const auto times = t_.buffers.floats(sampler["input"], {"SCALAR"});
    const auto values = t_.buffers.floats(sampler["output"], {"SCALAR", "VEC3", "VEC4"});
    if (!times || !values) {
      if (!sampler["input"].given() || !sampler["output"].given())
        sampler.error("a sampler needs the accessors input and output");
      return {};
    }
    const std::string way = sampler["interpolation"].text("LINEAR");
    const bool is_cubic = way == "CUBICSPLINE";
    if (!is_cubic && way != "LINEAR" && way != "STEP")
      return wrong(sampler["interpolation"], "interpolation is LINEAR, STEP or CUBICSPLINE");
    const std::size_t keys = times->count(), parts = is_cubic ? 3 : 1;
    if (!std::is_sorted(times->values.begin(), times->values.end()))
      return wrong(sampler["input"], "the times of a sampler must ascend");
    if (values->values.size() % (keys * parts) != 0)
      return wrong(sampler["output"], fmt::format("{} values do not fit {} times", values->count(), keys));
    const std::size_t width = values->values.size() / keys / parts;
    if (width > kMaxGltfTargets)
      return wrong(sampler["output"],
                   fmt::format("{} numbers a time: at most {} are read", width, kMaxGltfTargets));
    if (is_rotation && width != 4) return wrong(sampler["output"], "a rotation is a quaternion of 4 numbers");
    const auto part = [&](std::size_t key, std::size_t which) {
      const auto begin = values->values.begin() + static_cast<std::ptrdiff_t>((key * parts + which) * width);
      return Values(begin, begin + static_cast<std::ptrdiff_t>(width));
    };
    const std::size_t middle = is_cubic ? 1 : 0;
    const auto after = std::upper_bound(times->values.begin(), times->values.end(), seconds_,
                                        [](double s, float key) { return s < double{key}; });
    if (after == times->values.begin()) return part(0, middle);
    const auto next = static_cast<std::size_t>(after - times->values.begin());
    if (next == keys) return part(keys - 1, middle);
    const double from = double{times->values[next - 1]}, step = double{times->values[next]} - from;
    const double s = (seconds_ - from) / step;
    if (way == "STEP") return part(next - 1, 0);
    if (is_cubic) {
      // Cubic Hermite spline; its tangents are per second.
      const Values a = part(next - 1, 1), leaving = part(next - 1, 2), arriving = part(next, 0);
      Values b = part(next, 1);
      const double s2 = s * s, s3 = s2 * s;
      for (std::size_t i = 0; i < width; ++i)
        b[i] = (2 * s3 - 3 * s2 + 1) * a[i] + step * (s3 - 2 * s2 + s) * leaving[i] +
               (3 * s2 - 2 * s3) * b[i] + step * (s3 - s2) * arriving[i];
      return b;
    }
    const Values a = part(next - 1, 0);
    Values b = part(next, 0);
    if (is_rotation) return turned(a, std::move(b), s);
    for (std::size_t i = 0; i < width; ++i) b[i] = (1 - s) * a[i] + s * b[i];
    return b;
  }

  Values wrong(const Item& at, std::string text) {
    at.error(std::move(text));
    return {};
  }

  Translation& t_;
  const double seconds_;
  std::map<std::pair<const Value*, bool>, std::shared_ptr<const Values>> known_;
  std::size_t numbers_ = 0;  // number of all numbers in known_
};

// Returns the animations that `-D animation` chooses.
std::vector<Item> chosen_of(const Translation& t, const Moment& moment) {
  const std::vector<Item> all = t.root["animations"].list();
  if (all.empty()) {
    if (!moment.animation.empty()) t.root.error("-D animation: the file has no animations");
    return {};
  }
  if (moment.animation == "*") return all;
  std::vector<std::string> names;
  for (const Item& animation : all) {
    names.push_back(animation["name"].text(""));
    if (!moment.animation.empty() && names.back() == moment.animation) return {animation};
  }
  if (!moment.animation.empty()) {
    t.root["animations"].error(
        fmt::format("there is no animation \"{}\"{}", moment.animation, suggestion(moment.animation, names)));
    return {};
  }
  if (!moment.seconds) {
    t.root["animations"].warning(
        "what moves is seen as the nodes themselves say: choose a second by -D time=1.5, or frames");
    return {};
  }
  if (all.size() > 1)
    t.root["animations"].warning(
        fmt::format("of {} animations the first is seen: choose one by -D animation=NAME, or all by "
                    "-D animation=*",
                    all.size()));
  return {all[0]};
}

template <std::size_t N>
void give(std::optional<std::array<double, N>>& member, const Values& values, const Item& sampler) {
  if (values.empty()) return;
  if (values.size() != N)
    return sampler["output"].error(fmt::format("{} numbers a time are wanted for this use", N));
  std::copy(values.begin(), values.end(), member.emplace().begin());
}

}  // namespace

Poses read_poses(Translation& t, const Moment& moment) {
  Poses out;
  Sampler samplers(t, moment.seconds.value_or(0));
  for (const Item& animation : chosen_of(t, moment))
    for (const Item& channel : animation["channels"].list()) {
      if (t.report.full()) return out;
      const Item target = channel["target"], node = target["node"].in(t.root["nodes"]);
      if (!node.given()) continue;  // the channel animates an extension's target, not a node
      const Item sampler = channel["sampler"].in(animation["samplers"]);
      if (!sampler.given()) {
        if (!channel["sampler"].given()) channel.error("a channel needs its sampler");
        continue;
      }
      const std::string path = target["path"].text("");
      const bool is_weights = path == "weights";
      if (!is_weights && node["matrix"].given()) {
        target.error("the node that this moves has a matrix: write it as translation, rotation and scale");
        continue;
      }
      Pose& pose = out[node.identity()];
      if (path == "translation")
        give(pose.translation, *samplers.at(sampler, false), sampler);
      else if (path == "rotation")
        give(pose.rotation, *samplers.at(sampler, true), sampler);
      else if (path == "scale")
        give(pose.scale, *samplers.at(sampler, false), sampler);
      else if (is_weights)
        pose.weights = samplers.at(sampler, false);
      else
        target["path"].error("what moves is translation, rotation, scale or weights");
    }
  return out;
}

}  // namespace ls::scene::gltf
