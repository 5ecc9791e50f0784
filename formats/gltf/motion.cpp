// Evaluates animations at one moment, and deforms meshes by skins and morph targets.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "formats/gltf/translation.h"
#include "formats/xml/transform_element.h"

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
  // If the quaternions are nearly equal, they are interpolated linearly. The difference from slerp is then
  // smaller than the rounding error of a double.
  const double of_a = sine > 1e-6 ? std::sin((1 - s) * angle) / sine : 1 - s,
               of_b = sine > 1e-6 ? std::sin(s * angle) / sine : s;
  for (std::size_t i = 0; i < 4; ++i) b[i] = of_a * a[i] + of_b * b[i];
  return b;
}

class Sampler {
 public:
  Sampler(Translation& t, double seconds) : t_(t), seconds_(seconds) {}

  // Returns the value of `sampler`, an item of an animation's "samplers", at the time `seconds_`. All nodes
  // that the sampler animates share this value. `is_rotation`: the value is a quaternion. The result is empty
  // if the sampler is wrong; an error has been reported.
  std::shared_ptr<const Values> at(const Item& sampler, bool is_rotation) {
    const auto [known, is_new] = known_.try_emplace({sampler.identity(), is_rotation});
    if (!is_new) return known->second;
    Values values = read(sampler, is_rotation);
    numbers_ += values.size();
    // kMaxGltfValues limits the number of animated values, and separately the number of values in the file's
    // JSON.
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
      // Evaluates a cubic Hermite spline. Its tangents are per second, so they are multiplied by the seconds
      // between the keys (`step`).
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
  std::size_t numbers_ = 0;  // how many numbers the values in known_ have together
};

// Returns the animations to apply: those that the option `-D animation` chooses, or else the first one if a
// time is given.
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
      if (!node.given()) continue;  // The channel animates no node, but something that an extension defines.
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

namespace {

std::optional<Numbers<float>> read_like(Translation& t, const Item& accessor, std::string_view type,
                                        std::size_t count) {
  auto read = t.buffers.floats(accessor, {type});
  if (read && read->count() != count)
    return accessor.refuse(fmt::format("{} elements, but POSITION has {}", read->count(), count));
  return read;
}

// Normalises a vector unless it is 0. Uses double, since the square of a float may overflow.
void put_unit(float* out, const Vec3& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<float>(length > 0 ? v[k] / length : v[k]);
}

// Transforms the normal n by m, and normalises it. A normal transforms by the inverse transpose of the linear
// part of m. This matrix is the cofactor matrix divided by the determinant. The columns of the cofactor
// matrix are cross products of the columns of the linear part. Only the sign of the determinant is applied,
// since the result is normalised anyway.
void turn_normal(const Transform& m, float* n) {
  const auto column = [&](std::size_t i) { return Vec3{{m.m[i], m.m[4 + i], m.m[8 + i]}}; };
  const Vec3 x = column(0), y = column(1), z = column(2);
  const Vec3 rows[3] = {cross(y, z), cross(z, x), cross(x, y)};
  const double side = determinant3(m) < 0 ? -1 : 1;
  Vec3 out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) out[k] += side * rows[i][k] * double{n[i]};
  put_unit(n, out);
}

}  // namespace

bool add_targets(Translation& t, const Item& primitive, const std::vector<double>& weights, MadeMesh& mesh) {
  const std::vector<Item> targets = primitive["targets"].list();
  if (targets.size() != weights.size())
    return primitive.error(fmt::format("{} morph targets, but {} weights", targets.size(), weights.size())),
           false;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (weights[i] == 0) continue;
    for (const auto& [name, list] : {std::pair{"POSITION", &mesh.positions}, {"NORMAL", &mesh.normals}}) {
      if (!targets[i][name].given() || list->empty()) continue;
      const auto moved = read_like(t, targets[i][name], "VEC3", mesh.corners());
      if (!moved) return false;
      for (std::size_t k = 0; k < list->size(); ++k)
        (*list)[k] += static_cast<float>(weights[i] * double{moved->values[k]});
    }
    for (const char* name : {"TEXCOORD_0", "TEXCOORD_1", "COLOR_0"})
      if (targets[i][name].given())
        t.warn_once(targets[i], fmt::format("morph targets do not change {} here", name));
  }
  for (std::size_t i = 0; i < mesh.normals.size(); i += 3) {
    float* n = &mesh.normals[i];
    put_unit(n, Vec3{{double{n[0]}, double{n[1]}, double{n[2]}}});
  }
  return true;
}

bool add_skin(Translation& t, const Item& primitive, const std::vector<Transform>& joints, MadeMesh& mesh) {
  const Item attributes = primitive["attributes"];
  // For each set of joints: four joint indices and four weights per vertex.
  std::vector<std::pair<std::vector<float>, std::vector<float>>> sets;
  for (;;) {
    const Item which = attributes[fmt::format("JOINTS_{}", sets.size())],
               shares = attributes[fmt::format("WEIGHTS_{}", sets.size())];
    if (!which.given() && !shares.given() && !sets.empty()) break;
    if (sets.size() == kMaxGltfJointSets)
      return which.error(fmt::format("at most {} sets of joints are read: export fewer influences a corner",
                                     kMaxGltfJointSets)),
             false;
    if (!which.given() || !shares.given())
      return primitive.error(fmt::format("a mesh with a skin needs the attributes JOINTS_{0} and WEIGHTS_{0}",
                                         sets.size())),
             false;
    auto index = read_like(t, which, "VEC4", mesh.corners());
    auto weight = read_like(t, shares, "VEC4", mesh.corners());
    if (!index || !weight) return false;
    const auto is_wrong = [&](float x) {
      return !(x >= 0 && x < static_cast<float>(joints.size())) || x != std::floor(x);
    };
    const auto wrong = std::find_if(index->values.begin(), index->values.end(), is_wrong);
    if (wrong != index->values.end())
      return which.error(
                 fmt::format("there is no joint {}: the skin has {}, counted from 0", *wrong, joints.size())),
             false;
    sets.emplace_back(std::move(index->values), std::move(weight->values));
  }
  std::vector<bool> mirrored(mesh.corners());
  for (std::size_t i = 0; i < mesh.corners(); ++i) {
    Transform blended;
    blended.m.fill(0);
    double total = 0;
    for (const auto& [index, weight] : sets)
      for (std::size_t k = 4 * i; k < 4 * i + 4; ++k) {
        if (weight[k] == 0) continue;
        total += double{weight[k]};
        const Transform& joint = joints[static_cast<std::size_t>(index[k])];
        for (std::size_t e = 0; e < 16; ++e) blended.m[e] += double{weight[k]} * joint.m[e];
      }
    if (total == 0) continue;  // No joint moves this vertex.
    for (double& x : blended.m) x /= total;
    mirrored[i] = determinant3(blended) < 0;
    float* p = &mesh.positions[3 * i];
    const Vec3 moved = transform_point(blended, Vec3{{double{p[0]}, double{p[1]}, double{p[2]}}});
    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>(moved[k]);
    if (!mesh.normals.empty()) turn_normal(blended, &mesh.normals[3 * i]);
  }
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    std::uint32_t* corner = &mesh.indices[i];
    if (mirrored[corner[0]] + mirrored[corner[1]] + mirrored[corner[2]] > 1) std::swap(corner[1], corner[2]);
  }
  return true;
}

}  // namespace ls::scene::gltf
