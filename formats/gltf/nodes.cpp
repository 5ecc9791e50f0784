// Walks the hierarchy of a glTF file's nodes. Collects the uses of meshes, the cameras and the lights, each
// with its transform to the world.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/scene/limits.h"
#include "formats/gltf/translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

class NodeReader {
 public:
  NodeReader(Translation& t, const Poses& poses) : t_(t), poses_(poses), nodes_(t.root["nodes"]) {}

  Stage run() {
    for (const Item& root : roots()) visit(root, Transform{}, 0, false);
    for (Meshes::Use& use : stage_.meshes)
      if (const Item skin = use.node["skin"].in(t_.root["skins"]); skin.given() && !t_.report.full())
        use.joints = &joints_of(skin);
    return std::move(stage_);
  }

 private:
  // Returns the root nodes of the file's scene; if it has no scenes, all nodes without a parent.
  std::vector<Item> roots() {
    std::vector<Item> out;
    const std::vector<Item> scenes = t_.root["scenes"].list();
    if (!scenes.empty()) {
      const Item chosen = t_.root["scene"];
      const Item scene = chosen.given() ? chosen.in(t_.root["scenes"]) : scenes[0];
      for (const Item& index : scene["nodes"].list()) out.push_back(index);
      return out;
    }
    std::set<const Value*> within;
    for (const Item& node : nodes_.list())
      for (const Item& child : node["children"].list()) within.insert(child.in(nodes_).identity());
    for (const Item& node : nodes_.list())
      if (!within.contains(node.identity())) top_.push_back(node);
    for (const Item& node : top_) enter(node, Transform{}, 0, false);
    return {};
  }

  // `hidden`: an ancestor is invisible (KHR_node_visibility), so this node is invisible too. The transform of
  // an invisible node is recorded all the same, since the node may be a joint of a visible mesh.
  void visit(const Item& index, const Transform& outer, std::size_t depth, bool hidden) {
    const Item node = index.in(nodes_);
    if (!node.given() || t_.report.full()) return;
    if (visited_.contains(node.identity()))
      return index.error(
          "this node stands in the scene already: a node has one parent, and does not hold itself");
    enter(node, outer, depth, hidden);
  }

  void enter(const Item& node, const Transform& outer, std::size_t depth, bool hidden) {
    visited_.insert(node.identity());
    if (depth >= kMaxGltfNodes)
      return node.error(fmt::format("nodes are nested more than {} deep", kMaxGltfNodes));
    hidden = !node.extension("KHR_node_visibility")["visible"].is_true(true) || hidden;
    const Transform to_world = multiply(outer, local_transform(node, pose_of(node)));
    to_world_.emplace(node.identity(), to_world);
    if (!hidden) show(node, to_world);
    for (const Item& child : node["children"].list()) visit(child, to_world, depth + 1, hidden);
  }

  void show(const Item& node, const Transform& to_world) {
    if (node["mesh"].given()) add_mesh(node, to_world);
    if (node["camera"].given()) stage_.cameras.push_back({node, to_world});
    if (node.extension("KHR_lights_punctual").given()) stage_.lights.push_back({node, to_world});
  }

  void add_mesh(const Item& node, const Transform& to_world) {
    const Item mesh = node["mesh"].in(t_.root["meshes"]);
    if (!mesh.given()) return;
    Meshes::Use use{mesh, node, to_world, weights_of(mesh, node)};
    const Item instancing = node.extension("EXT_mesh_gpu_instancing");
    if (node["skin"].given()) {
      // The joints of the skin alone place the vertices in the world. The transform of the mesh's own node
      // has no effect.
      use.to_world = {};
      stage_.meshes.push_back(use);
    } else if (instancing.given()) {
      add_instances(instancing["attributes"], use);
    } else {
      add_use(use);
    }
  }

  void add_instances(const Item& attributes, const Meshes::Use& whole) {
    Numbers<float> move{3, {}}, turn{4, {}}, scale{3, {}};
    std::size_t count = 0;
    for (const auto& [name, type, numbers] :
         {std::tuple{"TRANSLATION", "VEC3", &move}, {"ROTATION", "VEC4", &turn}, {"SCALE", "VEC3", &scale}}) {
      if (!attributes[name].given()) continue;
      auto read = t_.buffers.floats(attributes[name], {type});
      if (!read) return;
      if (count > 0 && read->count() != count)
        return attributes[name].error(
            fmt::format("{} instances, but another attribute has {}", read->count(), count));
      count = read->count();
      *numbers = std::move(*read);
    }
    if (count > kMaxElements)
      return attributes.error(fmt::format("{} instances: at most {} are read", count, kMaxElements));
    for (std::size_t i = 0; i < count; ++i) {
      Transform own;
      std::array<double, 4> q{0, 0, 0, 1};
      Vec3 by{{1, 1, 1}}, at{{0, 0, 0}};
      for (std::size_t k = 0; k < 4 && !turn.values.empty(); ++k) q[k] = double{turn.values[4 * i + k]};
      for (std::size_t k = 0; k < 3; ++k) {
        if (!scale.values.empty()) by[k] = double{scale.values[3 * i + k]};
        if (!move.values.empty()) at[k] = double{move.values[3 * i + k]};
      }
      Meshes::Use use = whole;
      use.to_world = multiply(whole.to_world, composed(at, q, by));
      add_use(use);
    }
  }

  void add_use(const Meshes::Use& use) {
    if (invertible(use.to_world))
      stage_.meshes.push_back(use);
    else
      t_.warn_once(use.node, "a mesh is left out, as its transform flattens it to nothing");
  }

  const Pose& pose_of(const Item& node) const {
    static const Pose kStill;
    const auto found = poses_.find(node.identity());
    return found == poses_.end() ? kStill : found->second;
  }

  // Returns the weights of the mesh's morph targets. nullptr: no weights are given, all are 0, or their
  // number is wrong, which has been reported.
  const std::vector<double>* weights_of(const Item& mesh, const Item& node) {
    const auto& moved = pose_of(node).weights;
    const Item given = node["weights"].given() ? node["weights"] : mesh["weights"];
    if (!moved && !given.given()) return nullptr;
    const void* source = given.identity();
    if (moved) source = moved.get();
    const auto [known, is_new] = weights_.try_emplace(source);
    if (is_new) known->second = kept(moved ? *moved : numbers_in(given));
    const std::vector<double>* out = known->second;
    if (!out || out->size() == targets_of(mesh)) return out;
    (moved ? node : given)
        .error(fmt::format("{} morph targets, but {} weights", targets_of(mesh), out->size()));
    return nullptr;
  }

  std::vector<double> numbers_in(const Item& weights) {
    const std::vector<Item> all = weights.list();
    std::vector<double> out;
    if (all.size() > kMaxGltfTargets)
      return weights.error(fmt::format("{} weights: at most {} are read", all.size(), kMaxGltfTargets)), out;
    for (const Item& weight : all) out.push_back(weight.number(0));
    return out;
  }

  const std::vector<double>* kept(std::vector<double> weights) {
    if (std::all_of(weights.begin(), weights.end(), [](double x) { return x == 0; })) return nullptr;
    return &*stage_.weights.insert(std::move(weights)).first;
  }

  // Returns the number of morph targets of the mesh, which its first primitive determines (see
  // add_targets()).
  std::size_t targets_of(const Item& mesh) {
    const auto [known, is_new] = targets_.try_emplace(mesh.identity());
    if (!is_new) return known->second;
    const std::vector<Item> primitives = mesh["primitives"].list();
    return known->second = primitives.empty() ? 0 : primitives[0]["targets"].list().size();
  }

  const std::vector<Transform>& joints_of(const Item& skin) {
    const auto [known, is_new] = stage_.skins.try_emplace(skin.identity());
    std::vector<Transform>& out = known->second;
    if (!is_new) return out;
    const std::vector<Item> joints = skin["joints"].list();
    const Item inverse = skin["inverseBindMatrices"];
    Numbers<float> bind{16, {}};
    if (inverse.given()) {
      auto read = t_.buffers.floats(inverse, {"MAT4"});
      if (!read) return out;
      if (read->count() < joints.size())
        return inverse.error(fmt::format("{} matrices for {} joints", read->count(), joints.size())), out;
      bind = std::move(*read);
    }
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const Item node = joints[i].in(nodes_);
      if (!node.given()) return out;
      const auto stands = to_world_.find(node.identity());
      if (stands == to_world_.end())
        return joints[i].error("this joint is not in the scene, so that it holds no place there"), out;
      out.push_back(stands->second);
      if (bind.values.empty()) continue;
      std::array<double, 16> m;
      for (std::size_t k = 0; k < 16; ++k) m[k] = double{bind.values[16 * i + k]};
      out.back() = multiply(out.back(), matrix_of(m));
    }
    return out;
  }

  Translation& t_;
  const Poses& poses_;
  const Item nodes_;
  std::map<const Value*, Transform> to_world_;  // transform of each node of the scene
  // Weights of morph targets that were read so far; nullptr: all are 0. The key is their source: the member
  // "weights" of a node or mesh, or the list in a Pose.
  std::map<const void*, const std::vector<double>*> weights_;
  std::map<const Value*, std::size_t> targets_;  // number of morph targets of each mesh
  Stage stage_;
  std::vector<Item> top_;
  std::set<const Value*> visited_;
};

}  // namespace

Stage read_nodes(Translation& t, const Poses& poses) {
  Stage stage = NodeReader(t, poses).run();
  if (stage.meshes.empty() && !t.report.has_errors()) t.root.warning("the scene shows no mesh");
  return stage;
}

}  // namespace ls::scene::gltf
