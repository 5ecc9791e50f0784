// Converts scene shapes to arrays of primitives, in the spaces of the world and of the groups. In each
// space opaque primitives precede those that let light pass.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/scene/schema/light_links.h"
#include "core/scene/schema/traits.h"
#include "worker/render/geometry/geometry.h"
#include "worker/render/geometry/shape_import.h"

namespace ls::render {
namespace {

// Returns the sign, +1 or -1, that relates the winding normal of a mesh, or the outward normal of a sphere,
// to the normal that the scene's file format defines (checked against Mitsuba 3.9.1, where a mirrored sphere
// is inside out).
float orientation_of(const Shape& shape, bool vertex_normals) {
  float sign = shape.flip_normals ? -1.f : 1.f;
  // Mirroring reverses the winding, but not the normals of rectangles and cubes, nor those of a mesh with
  // vertex normals. A mirrored sphere is inside out.
  const bool follows = std::holds_alternative<RectangleShape>(shape.geometry) ||
                       std::holds_alternative<CubeShape>(shape.geometry) ||
                       std::holds_alternative<SphereShape>(shape.geometry) || vertex_normals;
  if (follows && Affine(shape.to_world).determinant() < 0) sign = -sign;
  return sign;
}

// True for a closed shape that to_world mirrors and whose normals therefore point inwards, as some do in
// Mitsuba. Such a shape keeps its interior medium inside although its normals say otherwise: mirroring a
// glass of water should not fill the room around it with water.
bool mirrored_inwards(const Shape& shape, float orientation) {
  if (!(Affine(shape.to_world).determinant() < 0)) return false;
  if (std::holds_alternative<SphereShape>(shape.geometry)) return orientation < 0;
  const bool mesh =
      std::holds_alternative<CubeShape>(shape.geometry) || std::holds_alternative<MeshShape>(shape.geometry);
  return mesh && orientation > 0;  // the orientation is relative to the winding, which mirroring reverses
}

// The map from scene coordinates to a space: p' = (p - center) * scale maps a box to unit size about the
// origin. The scale is a power of two.
struct Space {
  V3d center{0, 0, 0};
  double scale = 1;
  V3d operator()(const V3d& p) const { return (p - center) * scale; }
};

Space unit_space(const Box& b) {
  Space s;
  if (b.empty()) return s;
  s.center = (b.lo + b.hi) * .5;
  const V3d half = (b.hi - b.lo) * .5;
  const double extent = std::max(half.x, std::max(half.y, half.z));
  if (extent > 0) {
    int exponent = 0;
    std::frexp(extent, &exponent);  // extent <= 2^exponent
    s.scale = std::ldexp(1., -exponent);
  }
  return s;
}

// Returns the share of float32's resolution that remains for the shape of a mesh with the bounds b if
// coordinates are relative to `origin`: 1 near the origin, and 2^-n if the mesh is so far away that n of the
// 24 bits only encode its position.
double bits_left(const Box& b, const V3d& origin) {
  const V3d half = (b.hi - b.lo) * .5, away = (b.hi + b.lo) * .5 - origin;
  const double size = std::max(half.x, std::max(half.y, half.z)),
               far = std::max(std::abs(away.x), std::max(std::abs(away.y), std::abs(away.z)));
  return size / std::max(size, far);
}

// The space of the world. Its centre is the middle of the box of all shapes. If this leaves some mesh less
// than 8 of the 24 bits of float32 (as in a small scene lit by a sphere of radius 1e5 at 1e7), the centre of
// the mesh with the fewest bits is used instead, provided that afterwards every mesh has more bits than this
// mesh had with the first centre.
Space world_space(const std::vector<Box>& meshes, const Box& all) {
  Space s = unit_space(all);
  constexpr double kFewBits = 0x1p-16;
  const auto worst = [&](const V3d& origin) {
    return std::min_element(meshes.begin(), meshes.end(), [&](const Box& a, const Box& b) {
      return bits_left(a, origin) < bits_left(b, origin);
    });
  };
  const auto m = worst(s.center);
  if (m == meshes.end() || !(bits_left(*m, s.center) < kFewBits)) return s;
  const V3d there = (m->lo + m->hi) * .5;
  if (!(bits_left(*worst(there), there) > bits_left(*m, s.center))) return s;
  Box wide = all;  // enlarged to be symmetric about `there`, the new centre
  for (const V3d& corner : {all.lo, all.hi}) wide.add(there * 2 - corner);
  return unit_space(wide);
}

// True if the area-weighted normals of the mesh do not add up to zero. Such a mesh is a sheet, that is, not
// closed: the normals of a closed mesh add up to zero.
bool is_sheet(const LocalMesh& mesh) {
  V3d sum(0);
  double area = 0;
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const V3d &a = mesh.positions[mesh.indices[i]], &b = mesh.positions[mesh.indices[i + 1]],
              &c = mesh.positions[mesh.indices[i + 2]];
    const V3d n = (b - a).cross(c - a);
    sum += n;
    area += n.length();
  }
  return sum.length() > 1e-6 * area;
}

// Makes the winding of triangles follow the vertex normals, and swaps the media of the two sides with it.
// Normals from a file decide which side of a triangle emits and is lit, even against its winding, but the
// winding decides on which side each medium is. A mesh between different media stays unchanged if only some
// of its triangles wind against their normals.
void follow_normals(const LocalMesh& mesh, SurfaceInfo& info, std::vector<std::uint32_t>& indices) {
  const auto opposes = [&](std::size_t i) {
    const std::uint32_t a = indices[i], b = indices[i + 1], c = indices[i + 2];
    const V3d winding = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
    return winding.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) < 0;
  };
  std::vector<std::size_t> against;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    if (opposes(i)) against.push_back(i);
  }
  if (info.transition && against.size() != indices.size() / 3) return;
  for (const std::size_t i : against) std::swap(indices[i + 1], indices[i + 2]);
  if (!against.empty()) std::swap(info.interior, info.exterior);
}

void append_mesh(Geometry& g, LocalMesh mesh, bool normals_given, std::uint32_t surface, const Space& space) {
  const auto base = static_cast<std::uint32_t>(g.positions.size());
  g.dropped_triangles += mesh.dropped_triangles;
  g.wrong_uv_faces += mesh.wrong_uv_faces;
  SurfaceInfo& info = g.surfaces[surface];
  if (info.transition && !mesh.indices.empty()) info.sheet = is_sheet(mesh);
  for (const V3d& v : mesh.positions) g.positions.push_back(V3(space(v)));
  if (!mesh.normals.empty()) {
    info.normals = true;
    g.normals.resize(base);
    for (const V3d& n : mesh.normals) g.normals.push_back(V3(n));
    if (normals_given) follow_normals(mesh, info, mesh.indices);
  }
  if (!mesh.uvs.empty()) {
    info.uvs = true;
    g.uvs.resize(base);
    g.uvs.insert(g.uvs.end(), mesh.uvs.begin(), mesh.uvs.end());
  }
  const std::uint32_t first_triangle = g.triangle_count();
  std::vector<std::uint32_t> kept;  // indices in `mesh` of the triangles that are kept; needed for attributes
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::uint32_t a = base + mesh.indices[i], b = base + mesh.indices[i + 1],
                        c = base + mesh.indices[i + 2];
    const V3d e1 = V3d(g.positions[b]) - V3d(g.positions[a]), e2 = V3d(g.positions[c]) - V3d(g.positions[a]);
    if (!(e1.cross(e2).length() > 0)) {
      ++g.dropped_triangles;
      continue;
    }
    g.indices.insert(g.indices.end(), {a, b, c});
    g.triangle_surface.push_back(surface);
    if (info.wants_attributes) kept.push_back(static_cast<std::uint32_t>(i / 3));
  }
  for (const MeshAttribute& a : mesh.attributes)
    add_channel(g.attributes, a, surface, a.name.starts_with("face_") ? first_triangle : base, kept);
}

// Precomputes SurfaceInfo::reach and edge for the triangles from `first` on. Otherwise they would be computed
// for every hit.
void note_reach(const Geometry& g, std::uint32_t first, SurfaceInfo& info) {
  float least = std::numeric_limits<float>::infinity(), most = 0;
  for (std::uint32_t i = first; i < g.triangle_count(); ++i) {
    const float reach = g.reach_of(i);
    least = std::min(least, reach);
    most = std::max(most, reach);
  }
  info.reach = least * 16 >= most ? most : 0;
  for (std::uint32_t i = first; i < g.triangle_count(); ++i) {
    const V3d a(g.vertex(i, 0)), e1 = V3d(g.vertex(i, 1)) - a, e2 = V3d(g.vertex(i, 2)) - a;
    const double longest = std::max((e2 - e1).length(), std::max(e1.length(), e2.length()));
    info.edge =
        std::max(info.edge, 0x1p-22 * std::max(info.reach, g.reach_of(i)) * longest / e1.cross(e2).length());
  }
}

void append(Geometry& g, const Placed& p, std::uint32_t surface, const Space& space) {
  const std::uint32_t triangles = g.triangle_count();
  append_mesh(g, p.mesh, p.normals_given, surface, space);
  if (g.triangle_count() > triangles) note_reach(g, triangles, g.surfaces[surface]);
  if (p.sphere) {
    Sphere& s = g.spheres.emplace_back(*p.sphere);
    s.center = space(s.center);
    s.radius *= space.scale;
    s.surface = surface;
  }
  if (p.disk || p.cylinder) g.surfaces[surface].sheet = true;
  if (p.disk) {
    Disk& d = g.disks.emplace_back(*p.disk);
    d.center = space(d.center);
    d.u *= space.scale;
    d.v *= space.scale;
    d.surface = surface;
  }
  if (p.cylinder) {
    Cylinder& c = g.cylinders.emplace_back(*p.cylinder);
    c.p0 = space(c.p0);
    c.radius *= space.scale;
    c.length *= space.scale;
    c.surface = surface;
  }
}

SurfaceInfo surface_info(const Scene& scene, const std::vector<scene::BsdfTraits>& traits, const Shape& s,
                         const scene::LinkLists& links, bool vertex_normals) {
  SurfaceInfo info;
  info.bsdf = s.bsdf;
  info.null = std::holds_alternative<NullBsdf>(scene.bsdfs.at(s.bsdf.value));
  info.null_transmission = !info.null && traits.at(s.bsdf.value).passes;
  info.transition = s.is_medium_transition;
  info.hidden = hidden_from(s);
  info.hidden.set(RayKind::some_shadow, (links.blockers() & ~links.having(s.link_sets)) != 0);
  info.passable = info.null || info.hidden.any();
  info.catcher = catches_shadows(scene, s);
  info.holdout = s.holdout || info.catcher;
  info.crossed = info.null || info.hidden.any() || traits.at(s.bsdf.value).transmits;
  if (s.interior) info.interior = s.interior->value;
  if (s.exterior) info.exterior = s.exterior->value;
  info.orientation = orientation_of(s, vertex_normals);
  if (mirrored_inwards(s, info.orientation)) std::swap(info.interior, info.exterior);
  return info;
}

bool finite(const Box& b) {
  return b.empty() || (std::isfinite(b.lo.x + b.lo.y + b.lo.z) && std::isfinite(b.hi.x + b.hi.y + b.hi.z));
}

// The shapes of a scene as placed by their to_world, the bounds of the world (including instances), and the
// bounds of each group. A shape that moves has a group of its own, behind those of the scene.
struct Parts {
  std::vector<Placed> shapes;
  Box world;
  std::vector<Box> groups;
  std::vector<Box> meshes;  // bounds of the world's own triangle meshes
};

// Returns the group of each shape: that of the scene, or one of its own if the shape moves.
std::vector<std::optional<std::uint32_t>> groups_of(const Scene& scene) {
  std::vector<std::optional<std::uint32_t>> groups;
  auto own = static_cast<std::uint32_t>(scene.groups.size());
  for (const Shape& s : scene.shapes) {
    auto& group = groups.emplace_back();
    if (s.group) group = s.group->value;
    if (!s.motion.empty()) group = own++;
  }
  return groups;
}
std::size_t count_groups(const Scene& scene) {
  return scene.groups.size() + static_cast<std::size_t>(std::ranges::count_if(
                                   scene.shapes, [](const Shape& s) { return !s.motion.empty(); }));
}

// `from_group` maps the group's space to the scene's or, for an instance, to the space that the instance
// places. A shape is in its group where its to_world places it.
MovingInstance moving(const Shape& shape, const Affine& from_group, const V3d& center = V3d(0),
                      double scale = 1) {
  return {scene::Motion(shape.motion), Affine(shape.to_world).inverse() * from_group, center, scale};
}
MovingInstance moving(const Instance& instance, const Affine& from_group, const V3d& center = V3d(0),
                      double scale = 1) {
  return {scene::Motion(instance.motion), from_group, center, scale};
}

// The largest number of vertices of a scene. Indices of vertices have 32 bits, also in the BVH.
constexpr std::uint64_t kMaxVertices = std::uint64_t{1} << 31;

Result<Parts> place_all(const Scene& scene, const AssetLoader& files) {
  Parts parts;
  const auto group_of = groups_of(scene);
  parts.groups.resize(count_groups(scene));
  std::uint64_t vertices = 0;
  const bool attributes = scene::any_attribute(scene);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    std::vector<scene::AttributeUse> uses;
    if (attributes) uses = scene::attribute_uses(scene, scene.shapes[i]);
    auto p = place(scene.shapes[i], files, uses);
    if (!p) return fail(p.error().code, fmt::format("shape {}: {}", i + 1, p.error().message));
    vertices += p->mesh.positions.size();
    if (vertices > kMaxVertices)
      return fail(Errc::resource_exhausted,
                  fmt::format("the scene's meshes have more than {} vertices together", kMaxVertices));
    const auto& group = group_of[i];
    const Box own = bounds_of(*p);
    (group ? parts.groups[*group] : parts.world).add(own);
    if (!scene.shapes[i].motion.empty() && !own.empty())
      parts.world.add(moving(scene.shapes[i], Affine()).box(own, 0, 1));
    if (!group && !p->mesh.positions.empty() && (own.hi - own.lo).length() > 0) parts.meshes.push_back(own);
    parts.shapes.push_back(std::move(*p));
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Affine m(scene.instances[i].to_world);
    if (!m.invertible())
      return fail(Errc::invalid_argument, fmt::format("instance {}: its to_world has no inverse", i + 1));
    const Box& b = parts.groups[scene.instances[i].group.value];
    if (b.empty()) continue;
    const Instance& instance = scene.instances[i];
    parts.world.add(instance.motion.empty() ? b.moved(m) : moving(instance, Affine()).box(b, 0, 1));
  }
  if (!finite(parts.world) || !std::all_of(parts.groups.begin(), parts.groups.end(), finite))
    return fail(Errc::invalid_argument,
                "the scene's shapes reach to infinity: check transforms and mesh vertices");
  return parts;
}

// True if shadow rays may pass the surface.
bool lets_light_pass(const SurfaceInfo& s) {
  return s.null || s.null_transmission || s.hidden.has(RayKind::shadow) || s.hidden.has(RayKind::some_shadow);
}

// Appends to g the shapes of one space, opaque ones first. `shapes` holds the indices of these shapes in
// `parts.shapes`, ascending.
PrimitiveSet append_all(Geometry& g, const std::vector<std::uint32_t>& shapes, const Parts& parts,
                        const Space& space) {
  PrimitiveSet set;
  const auto note = [&](std::uint32_t PrimitiveRange::*edge) {
    set.triangles.*edge = g.triangle_count();
    set.spheres.*edge = static_cast<std::uint32_t>(g.spheres.size());
    set.disks.*edge = static_cast<std::uint32_t>(g.disks.size());
    set.cylinders.*edge = static_cast<std::uint32_t>(g.cylinders.size());
  };
  note(&PrimitiveRange::first);
  for (const bool passes : {false, true}) {
    note(&PrimitiveRange::passing);
    for (const std::uint32_t i : shapes)
      if (lets_light_pass(g.surfaces[i]) == passes) append(g, parts.shapes[i], i, space);
  }
  note(&PrimitiveRange::last);
  return set;
}

// Completes an instance whose map to the world is set, and checks it.
Result<PlacedInstance> checked(PlacedInstance out) {
  if (!out.to_world.invertible()) return fail(Errc::invalid_argument, "its to_world has no inverse");
  out.to_local = out.to_world.inverse();
  // The largest absolute value allowed in the matrix of to_local. The BVH transforms rays to the group's
  // space by an inverse that it computes itself, in float32, and it cannot trace rays whose origin is then
  // too far away (near_enough() in accel.cpp).
  constexpr double kLargestInverse = 5e8;
  const auto in_range = [](double x) { return std::abs(x) <= kLargestInverse; };
  if (!std::isnormal(static_cast<float>(out.to_world.determinant())) ||
      !std::all_of(out.to_local.a.begin(), out.to_local.a.end(), in_range))
    return fail(Errc::invalid_argument,
                "its to_world makes the group too small or too flat beside the rest of the scene for single "
                "precision");
  out.mirrored = out.to_world.determinant() < 0 ? -1.f : 1.f;
  return out;
}

Result<PlacedInstance> place_instance(const Instance& instance, const Geometry& g, const Space& group) {
  const Affine m(instance.to_world);
  PlacedInstance out;
  out.group = instance.group.value;
  out.to_world = Affine::scale_translate(g.scale, -g.center * g.scale) * m *
                 Affine::scale_translate(1 / group.scale, group.center);
  // The translation is computed again, because digits may cancel in the product of the three maps above
  out.to_world.b = (m.point(group.center) - g.center) * g.scale;
  return checked(out);
}

// Places a shape or an instance that moves. Scales between two keys are between theirs.
template <class T>
Result<PlacedInstance> place_moving(const T& object, std::uint32_t group, Geometry& g, const Space& space) {
  const MovingInstance instance =
      moving(object, Affine::scale_translate(1 / space.scale, space.center), g.center, g.scale);
  PlacedInstance out;
  out.group = group;
  for (const MotionKey& key : object.motion) {
    out.to_world = instance.to_world(key.time);
    if (auto ok = checked(out); !ok) return ok;
  }
  out.to_world = instance.to_world(0);
  out.moving = static_cast<std::uint32_t>(g.moving.size());
  g.moving.push_back(instance);
  return checked(out);
}

template <class T>
Result<void> add_instance(const T& object, std::uint32_t group, const std::vector<Space>& spaces, Geometry& g,
                          std::string_view what, std::size_t number) {
  Result<PlacedInstance> placed = PlacedInstance{};
  if (!object.motion.empty())
    placed = place_moving(object, group, g, spaces[group]);
  else if constexpr (std::is_same_v<T, Instance>)
    placed = place_instance(object, g, spaces[group]);
  if (!placed)
    return fail(placed.error().code, fmt::format("{} {}: {}", what, number, placed.error().message));
  g.instances.push_back(*placed);
  return {};
}

bool names_groups_that_exist(const Scene& scene) {
  const auto there = [&](GroupIndex g) { return g.value < scene.groups.size(); };
  return std::all_of(scene.shapes.begin(), scene.shapes.end(),
                     [&](const Shape& s) {
                       return !s.group || (there(*s.group) && !s.emitter && s.motion.empty());
                     }) &&
         std::all_of(scene.instances.begin(), scene.instances.end(),
                     [&](const Instance& i) { return there(i.group); });
}

}  // namespace

Result<Geometry> Geometry::build(const Scene& scene, const AssetLoader& files) {
  Geometry g;
  const auto traits = scene::bsdf_traits(scene);
  if (!traits) return fail(Errc::invalid_argument, "the scene's materials contain themselves");
  if (!names_groups_that_exist(scene))
    return fail(Errc::invalid_argument,
                "a shape or instance is of a group that the scene does not have, or "
                "moves by itself or emits light in a group");
  const auto parts = place_all(scene, files);
  if (!parts) return tl::unexpected(parts.error());
  const scene::LinkLists links(scene);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    g.surfaces.push_back(
        surface_info(scene, *traits, scene.shapes[i], links, parts->shapes[i].normals_given));
    g.surfaces.back().wants_attributes = !parts->shapes[i].mesh.attributes.empty();
  }
  g.attributes = attributes_of(scene);
  const Space world = world_space(parts->meshes, parts->world);
  g.center = world.center;
  g.scale = world.scale;
  if (!parts->world.empty()) {
    const V3d half = (parts->world.hi - parts->world.lo) * .5,
              aside = (parts->world.hi + parts->world.lo) * .5 - g.center;
    g.radius = static_cast<float>((half.length() + aside.length()) * g.scale);
  }
  std::vector<std::uint32_t> own;
  const auto group_of = groups_of(scene);
  std::vector<std::vector<std::uint32_t>> of_group(parts->groups.size());
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i)
    (group_of[i] ? of_group[*group_of[i]] : own).push_back(i);
  g.own = append_all(g, own, *parts, world);
  std::vector<Space> spaces;
  for (std::size_t i = 0; i < of_group.size(); ++i)
    g.groups.push_back(append_all(g, of_group[i], *parts, spaces.emplace_back(unit_space(parts->groups[i]))));
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (auto ok = add_instance(instance, instance.group.value, spaces, g, "instance", i + 1); !ok)
      return tl::unexpected(ok.error());
  }
  g.instance_of_shape.resize(scene.shapes.size(), kNone);
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    if (scene.shapes[i].motion.empty()) continue;
    g.instance_of_shape[i] = static_cast<std::uint32_t>(g.instances.size());
    if (auto ok = add_instance(scene.shapes[i], *group_of[i], spaces, g, "shape", i + 1); !ok)
      return tl::unexpected(ok.error());
  }
  g.attributes.find_means();
  // The BVH loads 16 bytes for a 12-byte vertex, so the allocation must not end directly behind the last
  // vertex.
  g.positions.reserve(g.positions.size() + 2);
  if (!g.normals.empty()) g.normals.resize(g.positions.size());
  if (!g.uvs.empty()) g.uvs.resize(g.positions.size());
  return g;
}

}  // namespace ls::render
