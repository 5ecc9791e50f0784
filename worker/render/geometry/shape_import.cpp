#include "worker/render/geometry/shape_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "core/assets/mesh.h"
#include "core/base/overloaded.h"

namespace ls::render {
namespace {

LocalMesh rectangle() {
  LocalMesh m;
  m.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  m.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  m.indices = {0, 1, 2, 0, 2, 3};
  return m;
}

// The cube as a mesh of six faces. On each face uv takes all values of the unit square: u increases along the
// edge direction Face::a, and v along the cross product of Face::a and the normal Face::n (as in the cube of
// Mitsuba 3.9.1).
LocalMesh cube() {
  struct Face {
    V3d n, a;
  };
  const Face faces[6] = {{{0, -1, 0}, {0, 0, 1}}, {{0, 1, 0}, {-1, 0, 0}}, {{1, 0, 0}, {0, 1, 0}},
                         {{0, 0, 1}, {0, 1, 0}},  {{-1, 0, 0}, {0, 1, 0}}, {{0, 0, -1}, {0, -1, 0}}};
  const V2 corners[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  LocalMesh m;
  for (const Face& f : faces) {
    const auto base = static_cast<std::uint32_t>(m.positions.size());
    const V3d b = f.a.cross(f.n);
    for (const V2& uv : corners) {
      m.positions.push_back(f.n + f.a * (2. * uv.x - 1) + b * (2. * uv.y - 1));
      m.uvs.push_back(uv);
    }
    for (std::uint32_t k : {0u, 2u, 1u, 0u, 3u, 2u}) m.indices.push_back(base + k);
  }
  return m;
}

const MeshAttributeTexture& texture_of(const Scene& scene, const scene::AttributeUse& use) {
  return std::get<MeshAttributeTexture>(scene.textures[use.texture.value]);
}
bool per_face(const std::string& name) { return name.starts_with("face_"); }

std::string list_of(const MeshData& mesh) {
  std::string out;
  for (const std::string& name : mesh.attribute_names) out += (out.empty() ? "it has " : ", ") + name;
  return out.empty() ? "it has none" : out;
}

Result<void> check(const MeshAttribute& a, std::string_view file, const scene::AttributeUse& use,
                   double scale) {
  using As = scene::AttributeUse::As;
  if (use.as == As::number && a.components != 1)
    return fail(Errc::invalid_argument,
                fmt::format("'{}': a bsdf reads the attribute \"{}\" as one number, but it has {}: name an "
                            "attribute of one number instead",
                            file, a.name, a.components));
  if (use.as == As::colour && a.components != 3)
    return fail(
        Errc::invalid_argument,
        fmt::format("'{}': a normal map reads the attribute \"{}\", which has one number instead of three",
                    file, a.name));
  float largest = 0;
  for (const float x : a.values) {
    if (!std::isfinite(x))
      return fail(Errc::invalid_argument,
                  fmt::format("'{}': the attribute \"{}\" holds a number that is not finite", file, a.name));
    largest = std::max(largest, x);
  }
  if (a.bytes && !use.in_light && largest * scale > 1.0001)
    return fail(
        Errc::invalid_argument,
        fmt::format(
            "'{}': the attribute \"{}\" is stored in bytes, which are numbers from 0 to 255 (as in "
            "Mitsuba), but a bsdf needs numbers up to 1: set `scale` of the texture to 0.00392157, or "
            "store floats from 0 to 1",
            file, a.name));
  return {};
}

std::vector<std::string> attribute_names(const Scene& scene, const std::vector<scene::AttributeUse>& uses) {
  std::vector<std::string> names;
  for (const scene::AttributeUse& use : uses) {
    const std::string& name = texture_of(scene, use).name;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

// Checks that `mesh`, read from `file`, has the attributes that the textures in `uses` read, in the expected
// size and range. If not, fails with invalid_argument; the message names the file, the attribute and a
// remedy.
Result<void> check_attributes(const MeshData& mesh, std::string_view file, const Scene& scene,
                              const std::vector<scene::AttributeUse>& uses) {
  for (const scene::AttributeUse& use : uses) {
    const MeshAttributeTexture& t = texture_of(scene, use);
    const auto it = std::find_if(mesh.attributes.begin(), mesh.attributes.end(),
                                 [&](const MeshAttribute& a) { return a.name == t.name; });
    if (it == mesh.attributes.end())
      return fail(Errc::invalid_argument,
                  fmt::format("the mesh '{}' has no attribute \"{}\", which a texture reads; {}", file,
                              t.name, list_of(mesh)));
    if (auto ok = check(*it, file, use, t.scale); !ok) return ok;
  }
  return {};
}

Result<LocalMesh> load(const MeshShape& shape, const AssetLoader& files,
                       const std::vector<scene::AttributeUse>& uses) {
  auto path = files.path(shape.file);
  if (!path) return tl::unexpected(path.error());
  auto data = load_mesh(*path, files.name(shape.file), shape.shape_index, attribute_names(files.scene, uses));
  if (!data) return tl::unexpected(data.error());
  if (auto ok = check_attributes(*data, files.name(shape.file), files.scene, uses); !ok)
    return tl::unexpected(ok.error());
  LocalMesh m;
  m.attributes = std::move(data->attributes);
  m.indices = std::move(data->indices);
  m.face_normals = data->face_normals;
  m.dropped_triangles = data->dropped_triangles;
  m.wrong_uv_faces = data->wrong_uv_faces;
  const std::size_t n = data->vertex_count();
  m.positions.reserve(n);
  for (std::size_t i = 0; i < n; ++i)
    m.positions.emplace_back(data->positions[3 * i], data->positions[3 * i + 1], data->positions[3 * i + 2]);
  if (!shape.face_normals && !data->face_normals && !data->normals.empty()) {
    for (std::size_t i = 0; i < n; ++i)
      m.normals.emplace_back(data->normals[3 * i], data->normals[3 * i + 1], data->normals[3 * i + 2]);
  }
  for (std::size_t i = 0; 2 * i < data->uvs.size(); ++i) {
    const float v = data->uvs[2 * i + 1];
    m.uvs.emplace_back(data->uvs[2 * i], shape.flip_tex_coords ? 1 - v : v);
  }
  return m;
}

Result<Sphere> place_sphere(const SphereShape& s, const Affine& m) {
  // The map scales uniformly if its columns are orthogonal and equally long, up to the rounding of composed
  // transforms.
  const V3d x = m.vector({1, 0, 0}), y = m.vector({0, 1, 0}), z = m.vector({0, 0, 1});
  const double l = x.length(), tolerance = 1e-5 * l;
  if (std::abs(y.length() - l) > tolerance || std::abs(z.length() - l) > tolerance ||
      std::abs(x.dot(y)) > tolerance * l || std::abs(y.dot(z)) > tolerance * l ||
      std::abs(z.dot(x)) > tolerance * l) {
    return fail(Errc::invalid_argument, "a sphere can only be scaled uniformly; use a mesh for an ellipsoid");
  }
  Sphere r;
  r.center = m.point(V3d(s.center[0], s.center[1], s.center[2]));
  r.radius = s.radius * l;
  const V3d rows[3] = {x / l, y / l, z / l};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) r.to_local[3 * i + k] = rows[i][k];
  return r;
}

Disk place_disk(const Affine& m) {
  Disk d;
  d.center = m.point({0, 0, 0});
  d.u = m.vector({1, 0, 0});
  d.v = m.vector({0, 1, 0});
  // The normal points to the side to which m maps +z, also if m mirrors. m.normal() then gives the other
  // side.
  d.n = m.normal({0, 0, 1}).normalized() * (m.determinant() < 0 ? -1. : 1.);
  return d;
}

// Places a cylinder. Its azimuth starts, as in Mitsuba, at the first axis of the frame of Duff et al. 2017
// about the direction from p0 to p1, before m transforms it.
Result<Cylinder> place_cylinder(const CylinderShape& s, const Affine& m) {
  const V3d p0(s.p0[0], s.p0[1], s.p0[2]), d = V3d(s.p1[0], s.p1[1], s.p1[2]) - p0, n = d.normalized();
  const double sign = std::copysign(1., n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
  const V3d x = m.vector({1 + sign * n.x * n.x * a, sign * b, -sign * n.x}),
            y = m.vector({b, sign + n.y * n.y * a, -n.y}), z = m.vector(d);
  const double l = x.length(), tolerance = 1e-5;
  if (!(d.length() > 0)) return fail(Errc::invalid_argument, "a cylinder's p0 and p1 are the same point");
  if (std::abs(y.length() - l) > tolerance * l || std::abs(x.dot(y)) > tolerance * l * l ||
      std::max(std::abs(x.dot(z)), std::abs(y.dot(z))) > tolerance * l * z.length())
    return fail(Errc::invalid_argument, "a cylinder can only be stretched along its axis; use a mesh");
  Cylinder r;
  r.p0 = m.point(p0);
  r.length = z.length();
  r.axis = z / r.length;
  r.u = (x - r.axis * r.axis.dot(x)).normalized();
  r.v = r.axis.cross(r.u);
  if (r.v.dot(y) < 0) r.v = -r.v;
  r.radius = s.radius * l;
  return r;
}

void transform(LocalMesh& m, const Affine& to_scene) {
  for (V3d& p : m.positions) p = to_scene.point(p);
  for (V3d& n : m.normals) {
    n = to_scene.normal(n);
    if (const double l = n.length(); l > 0) n /= l;
  }
}

// Computes smooth normals for a mesh file without normals, as Mitsuba does: at each vertex the normalised sum
// of the normals of its triangles, weighted by their angles there (Thuermer and Wuethrich 1998).
void smooth(LocalMesh& m) {
  m.normals.assign(m.positions.size(), V3d(0));
  for (std::size_t i = 0; i + 2 < m.indices.size(); i += 3) {
    const std::uint32_t* v = &m.indices[i];
    const V3d n = (m.positions[v[1]] - m.positions[v[0]]).cross(m.positions[v[2]] - m.positions[v[0]]);
    const double l = n.length();
    if (!(l > 0) || !std::isfinite(l)) continue;
    for (int k = 0; k < 3; ++k) {
      const V3d a = m.positions[v[(k + 1) % 3]] - m.positions[v[k]],
                b = m.positions[v[(k + 2) % 3]] - m.positions[v[k]];
      m.normals[v[k]] += n / l * std::atan2(a.cross(b).length(), a.dot(b));
    }
  }
  for (V3d& n : m.normals) {
    if (const double l = n.length(); l > 0) n /= l;
  }
}

}  // namespace

Result<Placed> place(const Shape& shape, const AssetLoader& files,
                     const std::vector<scene::AttributeUse>& uses) {
  const Affine m(shape.to_world);
  if (!m.invertible()) return fail(Errc::invalid_argument, "its to_world has no inverse");
  if (!uses.empty() && !std::holds_alternative<MeshShape>(shape.geometry))
    return fail(Errc::invalid_argument,
                fmt::format("a texture reads its attribute \"{}\", but only meshes have attributes",
                            attribute_names(files.scene, uses).front()));
  Placed out;
  const auto set = [](auto& to, auto placed) -> Result<void> {
    if (!placed) return tl::unexpected(placed.error());
    to = std::move(*placed);
    return {};
  };
  const auto ok = std::visit(
      overloaded{[&](const RectangleShape&) { return set(out.mesh, Result<LocalMesh>(rectangle())); },
                 [&](const CubeShape&) { return set(out.mesh, Result<LocalMesh>(cube())); },
                 [&](const SphereShape& s) { return set(out.sphere, place_sphere(s, m)); },
                 [&](const DiskShape&) { return set(out.disk, Result<Disk>(place_disk(m))); },
                 [&](const CylinderShape& s) { return set(out.cylinder, place_cylinder(s, m)); },
                 [&](const MeshShape& s) { return set(out.mesh, load(s, files, uses)); }},
      shape.geometry);
  if (!ok) return tl::unexpected(ok.error());
  transform(out.mesh, m);
  out.normals_given = !out.mesh.normals.empty();
  const auto* mesh = std::get_if<MeshShape>(&shape.geometry);
  const bool flat = !mesh || mesh->face_normals || mesh->flat_without_normals || out.mesh.face_normals;
  if (!flat && !out.normals_given) smooth(out.mesh);
  return out;
}

Box bounds_of(const Placed& p) {
  Box b;
  for (const V3d& v : p.mesh.positions) b.add(v);
  if (p.sphere) b.add(box_of(*p.sphere));
  if (p.cylinder) b.add(box_of(*p.cylinder));
  if (p.disk) {  // the corners of the square around the disk
    for (int k = 0; k < 4; ++k)
      b.add(p.disk->center + p.disk->u * (k & 1 ? 1. : -1.) + p.disk->v * (k & 2 ? 1. : -1.));
  }
  return b;
}

SurfaceAttributes attributes_of(const Scene& scene) {
  SurfaceAttributes all;
  for (const Texture& t : scene.textures) {
    if (const auto* a = std::get_if<MeshAttributeTexture>(&t))
      all.names.try_emplace(a->name, static_cast<std::uint32_t>(all.names.size()));
  }
  all.first_of.assign(scene.shapes.size(), SurfaceAttributes::kNoChannel);
  return all;
}

void add_channel(SurfaceAttributes& all, const MeshAttribute& a, std::uint32_t surface, std::uint32_t base,
                 const std::vector<std::uint32_t>& kept) {
  const auto name = all.names.find(a.name);
  if (name == all.names.end()) return;
  const bool faces = per_face(a.name);
  const std::size_t count = faces ? kept.size() : a.values.size() / a.components;
  all.channels.push_back({faces, base, static_cast<std::uint32_t>(count), all.values.size(), name->second,
                          all.first_of[surface]});
  all.first_of[surface] = static_cast<std::uint32_t>(all.channels.size() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    const float* v = &a.values[(faces ? kept[i] : i) * a.components];
    C3 c = a.components == 3 ? C3(v[0], v[1], v[2]) : C3(v[0]);
    for (int k = 0; k < 3; ++k) {
      all.clamped += c[k] < 0;
      c[k] = std::max(c[k], 0.f);
    }
    all.values.push_back(c);
  }
}

}  // namespace ls::render
