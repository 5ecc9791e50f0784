// Meshes that skins and morph targets deform.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/scene/gltf/translation.h"
#include "common/scene/limits.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

std::optional<Numbers<float>> read_like(Translation& t, const Item& accessor, std::string_view type,
                                        std::size_t count) {
  auto read = t.buffers.floats(accessor, {type});
  if (read && read->count() != count) {
    accessor.error(fmt::format("{} elements, but POSITION has {}", read->count(), count));
    return std::nullopt;
  }
  return read;
}

// Normalises a vector unless it is 0. Uses double, since the square of a float may overflow.
void put_unit(float* out, const Vec3& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  for (std::size_t k = 0; k < 3; ++k) out[k] = static_cast<float>(length > 0 ? v[k] / length : v[k]);
}

// Transforms the normal n by m, and normalises it. A normal transforms by the inverse transpose of m's
// linear part. This is the cofactor matrix, whose columns are cross products of the linear part's columns,
// divided by the determinant. Of the determinant only the sign is applied, since the result is normalised.
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
  if (targets.size() != weights.size()) {
    primitive.error(fmt::format("{} morph targets, but {} weights", targets.size(), weights.size()));
    return false;
  }
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
  std::vector<std::pair<std::vector<float>, std::vector<float>>> sets;  // four joints and weights per corner
  for (;;) {
    const Item which = attributes[fmt::format("JOINTS_{}", sets.size())],
               shares = attributes[fmt::format("WEIGHTS_{}", sets.size())];
    if (!which.given() && !shares.given() && !sets.empty()) break;
    if (sets.size() == kMaxGltfJointSets) {
      which.error(fmt::format("at most {} sets of joints are read: export fewer influences a corner",
                              kMaxGltfJointSets));
      return false;
    }
    if (!which.given() || !shares.given()) {
      primitive.error(
          fmt::format("a mesh with a skin needs the attributes JOINTS_{0} and WEIGHTS_{0}", sets.size()));
      return false;
    }
    auto index = read_like(t, which, "VEC4", mesh.corners());
    auto weight = read_like(t, shares, "VEC4", mesh.corners());
    if (!index || !weight) return false;
    const auto is_wrong = [&](float x) {
      return !(x >= 0 && x < static_cast<float>(joints.size())) || x != std::floor(x);
    };
    const auto wrong = std::find_if(index->values.begin(), index->values.end(), is_wrong);
    if (wrong != index->values.end()) {
      which.error(
          fmt::format("there is no joint {}: the skin has {}, counted from 0", *wrong, joints.size()));
      return false;
    }
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
    if (total == 0) continue;  // no joint moves this corner
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
