// Translates meshes: writes their triangles to mesh files, and adds the shapes and instances that use these
// files to the scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/scene/limits.h"
#include "formats/gltf/translation.h"
#include "formats/made_files.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

constexpr std::size_t kTriangles = 4, kStrip = 5, kFan = 6;

// Returns the vertex indices of all triangles, three for each. `order` are the indices of the primitive,
// `mode` says how they form triangles (list, strip or fan). In a strip, two indices of every second triangle
// are swapped, so that all triangles have the same winding.
std::vector<std::uint32_t> triangles(const std::vector<std::uint32_t>& order, std::size_t mode) {
  std::vector<std::uint32_t> out;
  const std::size_t count =
      mode == kTriangles ? order.size() / 3 : order.size() - std::min<std::size_t>(order.size(), 2);
  out.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t a = mode == kTriangles ? 3 * i : mode == kStrip ? i : i + 1;
    const std::size_t b = mode == kTriangles ? 3 * i + 1 : mode == kStrip ? i + 1 + i % 2 : i + 2;
    const std::size_t c = mode == kTriangles ? 3 * i + 2 : mode == kStrip ? i + 2 - i % 2 : 0;
    const std::uint32_t x = order[a], y = order[b], z = order[c];
    if (x != y && y != z && z != x) out.insert(out.end(), {x, y, z});
  }
  return out;
}

}  // namespace

std::optional<Meshes::Surface> Meshes::read_primitive(const Item& primitive, const Use& use) {
  const Item attributes = primitive["attributes"], position = attributes["POSITION"];
  if (!position.given())
    return primitive.refuse(
        primitive.extension("KHR_draco_mesh_compression").given()
            ? "Draco's packed meshes are not read: unpack them, as by `gltf-transform copy`"
            : "a primitive needs the attribute POSITION");
  const std::size_t mode = primitive["mode"].whole(0, kFan).value_or(kTriangles);
  if (mode < kTriangles) {
    t_.warn_once(primitive, "points and lines are not rendered: only triangles are");
    return std::nullopt;
  }
  const Item material = primitive["material"];
  const std::size_t uv_set = materials_.uv_set(material);
  const Item uv = attributes[fmt::format("TEXCOORD_{}", uv_set)], colour = attributes["COLOR_0"];
  MeshKind kind{colour.given(), colour.given() && materials_.uses_opacity(material)};

  MadeMesh mesh;
  auto positions = t_.buffers.floats(position, {"VEC3"});
  if (!positions) return std::nullopt;
  mesh.positions = std::move(positions->values);
  for (const auto& [item, type, list] :
       {std::tuple{attributes["NORMAL"], "VEC3", &mesh.normals}, {uv, "VEC2", &mesh.uvs}}) {
    if (!item.given()) continue;
    auto read = t_.buffers.floats(item, {type});
    if (!read) return std::nullopt;
    if (read->count() != mesh.corners())
      return item.error(fmt::format("{} elements, but POSITION has {}", read->count(), mesh.corners())),
             std::nullopt;
    *list = std::move(read->values);
  }
  std::vector<std::uint32_t> order;
  if (primitive["indices"].given()) {
    auto read = t_.buffers.indices(primitive["indices"]);
    if (!read) return std::nullopt;
    order = std::move(*read);
    const auto most = *std::max_element(order.begin(), order.end());
    if (most >= mesh.corners())
      return primitive["indices"].error(
                 fmt::format("there is no corner {}: POSITION has {}, counted from 0", most, mesh.corners())),
             std::nullopt;
  } else {
    for (std::size_t i = 0; i < mesh.corners(); ++i) order.push_back(static_cast<std::uint32_t>(i));
  }
  mesh.indices = triangles(order, mode);
  if (mesh.indices.empty()) return std::nullopt;
  if (use.weights && !add_targets(t_, primitive, *use.weights, mesh)) return std::nullopt;
  if (use.joints && !add_skin(t_, primitive, *use.joints, mesh)) return std::nullopt;
  for (const auto* list : {&mesh.positions, &mesh.normals})
    if (!std::all_of(list->begin(), list->end(), [](float x) { return std::isfinite(x); }))
      return primitive.error(
                 "its skin or its morph targets carry corners out of the range of numbers, or their normals"),
             std::nullopt;
  if (kind.colours) {
    const auto read = t_.buffers.floats(colour, {"VEC3", "VEC4"});
    if (!read) return std::nullopt;
    if (read->count() != mesh.corners())
      return colour.error(fmt::format("{} elements, but POSITION has {}", read->count(), mesh.corners())),
             std::nullopt;
    kind.opacities = kind.opacities && read->width == 4;
    for (std::size_t i = 0; i < read->values.size(); ++i)
      if (i % read->width < 3)
        mesh.colours.push_back(std::clamp(read->values[i], 0.f, 1.f));
      else if (kind.opacities)
        mesh.opacities.push_back(std::clamp(read->values[i], 0.f, 1.f));
  }
  bytes_ += mesh.bytes();
  if (bytes_ > kMaxGltfMeshBytes)
    return primitive.error(fmt::format("the meshes take more than {} MiB as files: split the scene",
                                       kMaxGltfMeshBytes >> 20)),
           std::nullopt;

  Surface out;
  out.at = primitive.at();
  out.flat = mesh.normals.empty();
  out.material = materials_.of(material, kind);
  for (std::size_t i = 0; i < mesh.corners(); ++i) {
    const float* p = &mesh.positions[3 * i];
    out.box.include(Vec3{{double{p[0]}, double{p[1]}, double{p[2]}}});
  }
  auto file = keep_made(t_.assets, mesh);
  if (!file) return primitive.error(file.error().message), std::nullopt;
  out.file = std::move(*file);
  return out;
}

std::vector<Meshes::Surface> Meshes::read(const Use& use) {
  std::vector<Surface> out;
  const std::vector<Item> primitives = use.mesh["primitives"].list();
  parts_ += primitives.size() * (1 + (use.weights ? use.weights->size() : 0));
  if (parts_ > kMaxElements)
    return use.mesh.error(fmt::format("more than {} primitives and morph targets are read, those of a mesh "
                                      "again for each skin and each weights: split the scene",
                                      kMaxElements)),
           out;
  for (const Item& primitive : primitives) {
    if (t_.report.full()) break;
    auto surface = read_primitive(primitive, use);
    if (!surface) continue;
    surface->label = use.mesh["name"].text("mesh");
    out.push_back(std::move(*surface));
  }
  return out;
}

Element Meshes::shape(const Surface& s) {
  Element out = made("shape", "ply", s.at);
  set(out, "id", t_.fresh_id(s.label), s.at);
  scene::add(out, "string", "filename", s.file, s.at);
  if (s.flat) scene::add(out, "boolean", "face_normals", "true", s.at);
  Element ref = made("ref", "", s.at);
  set(ref, "id", s.material.id, s.at);
  scene::add(out, std::move(ref));
  if (s.material.interior.empty()) return out;
  Element within = made("ref", "", s.at);
  set(within, "name", "interior", s.at);
  set(within, "id", s.material.interior, s.at);
  scene::add(out, std::move(within));
  return out;
}

// Adds the meshes for all their uses. A mesh with several uses becomes a group with instances. But surfaces
// that emit light cannot be instanced, so they are added once for each use.
void Meshes::add(const std::vector<Use>& uses) {
  using Form = std::tuple<const Value*, const std::vector<double>*, const std::vector<Transform>*>;
  const auto form_of = [](const Use& use) { return Form{use.mesh.identity(), use.weights, use.joints}; };
  std::vector<const Use*> order;
  std::map<Form, std::vector<const Use*>> by_form;
  for (const Use& use : uses) {
    auto& of_mesh = by_form[form_of(use)];
    if (of_mesh.empty()) order.push_back(&use);
    of_mesh.push_back(&use);
  }
  for (const Use* first : order) {
    if (t_.report.full() || parts_ > kMaxElements) return;
    const std::vector<const Use*>& of_mesh = by_form[form_of(*first)];
    const std::vector<Surface> surfaces = read(*first);
    for (const Use* use : of_mesh)
      for (const Surface& s : surfaces) box_.include(s.box, use->to_world);
    const auto placed = [&](const Surface& s, const Use& use) {
      Element e = shape(s);
      place(e, use.to_world, s.at);
      // In glTF the front stays the front under a mirroring transform. Normals of the file do so by
      // themselves; those of flat triangles follow the winding, which the transform reverses, so they are
      // flipped.
      if (s.flat && determinant3(use.to_world) < 0) scene::add(e, "boolean", "flip_normals", "true", s.at);
      if (s.material.light) scene::add(e, *s.material.light);
      t_.add(std::move(e));
    };
    Element group = made("shape", "shapegroup", of_mesh[0]->mesh.at());
    for (const Surface& s : surfaces) {
      if (of_mesh.size() == 1 || s.material.light)
        for (const Use* use : of_mesh) placed(s, *use);
      else
        scene::add(group, shape(s));
    }
    if (group.children.empty()) continue;
    const std::string id = t_.fresh_id(of_mesh[0]->mesh["name"].text("mesh"));
    set(group, "id", id, group.at);
    const Span at = group.at;
    t_.add(std::move(group));
    for (const Use* use : of_mesh) {
      Element instance = made("shape", "instance", use->node.at());
      set(instance, "id", t_.fresh_id(use->node["name"].text("instance")), instance.at);
      Element ref = made("ref", "", at);
      set(ref, "id", id, at);
      scene::add(instance, std::move(ref));
      place(instance, use->to_world, instance.at);
      t_.add(std::move(instance));
    }
  }
}

}  // namespace ls::scene::gltf
