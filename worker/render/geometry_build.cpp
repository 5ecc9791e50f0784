// Scene shapes -> one array of world-space primitives, opaque ones first.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "common/assets/mesh.h"
#include "common/base/overloaded.h"
#include "common/scene/bsdf_traits.h"
#include "worker/render/geometry.h"
#include "worker/render/transform.h"

namespace ls::render {
namespace {

// A shape in scene space, in double, before recentring.
struct LocalMesh {
  std::vector<V3d> positions;
  std::vector<V3d> normals;
  std::vector<V2> uvs;
  std::vector<std::uint32_t> indices;
};
struct Placed {
  LocalMesh mesh;
  bool normals_given = false;  // by the file
  std::optional<Sphere> sphere;
  std::optional<Disk> disk;
};

struct Bounds {
  V3d lo{std::numeric_limits<double>::infinity()}, hi{-std::numeric_limits<double>::infinity()};
  void add(const V3d& p) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], p[k]);
      hi[k] = std::max(hi[k], p[k]);
    }
  }
  bool empty() const { return !(lo.x <= hi.x); }
};

LocalMesh rectangle() {
  LocalMesh m;
  m.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  m.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  m.indices = {0, 1, 2, 0, 2, 3};
  return m;
}

// Six faces; each has the unit square as its uv, u along a and v along a x n (as Mitsuba 3.9.1's cube).
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

Result<LocalMesh> load(const MeshShape& shape, const AssetLoader& files) {
  auto path = files.path(shape.file);
  if (!path) return tl::unexpected(path.error());
  auto data = load_mesh(*path, files.name(shape.file));
  if (!data) return tl::unexpected(data.error());
  LocalMesh m;
  m.indices = std::move(data->indices);
  const std::size_t n = data->vertex_count();
  m.positions.reserve(n);
  for (std::size_t i = 0; i < n; ++i)
    m.positions.emplace_back(data->positions[3 * i], data->positions[3 * i + 1], data->positions[3 * i + 2]);
  if (!shape.face_normals && !data->normals.empty()) {
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
  // Uniform scaling: the columns are orthogonal and equally long, up to the rounding of composed transforms.
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

void transform(LocalMesh& m, const Affine& to_scene) {
  for (V3d& p : m.positions) p = to_scene.point(p);
  for (V3d& n : m.normals) {
    n = to_scene.normal(n);
    if (const double l = n.length(); l > 0) n /= l;
  }
}

// Where a file has no normals the dialect makes smooth ones: each vertex's triangles weighted by their angle
// there (Thuermer and Wuethrich 1998).
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

Result<Placed> place(const Shape& shape, const AssetLoader& files) {
  const Affine m(shape.to_world);
  if (!m.invertible()) return fail(Errc::invalid_argument, "its to_world has no inverse");
  Placed out;
  auto ok = std::visit(
      overloaded{
          [&](const RectangleShape&) -> Result<void> {
            out.mesh = rectangle();
            return {};
          },
          [&](const CubeShape&) -> Result<void> {
            out.mesh = cube();
            return {};
          },
          [&](const SphereShape& s) -> Result<void> {
            auto r = place_sphere(s, m);
            if (!r) return tl::unexpected(r.error());
            out.sphere = *r;
            return {};
          },
          [&](const DiskShape&) -> Result<void> {
            Disk d;
            d.center = m.point({0, 0, 0});
            d.u = m.vector({1, 0, 0});
            d.v = m.vector({0, 1, 0});
            d.n = m.normal({0, 0, 1}).normalized() * (m.determinant() < 0 ? -1. : 1.);  // +z, also mirrored
            out.disk = d;
            return {};
          },
          [&](const MeshShape& s) -> Result<void> {
            auto r = load(s, files);
            if (!r) return tl::unexpected(r.error());
            out.mesh = std::move(*r);
            return {};
          }},
      shape.geometry);
  if (!ok) return tl::unexpected(ok.error());
  transform(out.mesh, m);
  out.normals_given = !out.mesh.normals.empty();
  const auto* mesh = std::get_if<MeshShape>(&shape.geometry);
  if (mesh && !mesh->face_normals && !out.normals_given) smooth(out.mesh);
  return out;
}

void add_bounds(const Placed& p, Bounds& b) {
  for (const V3d& v : p.mesh.positions) b.add(v);
  if (p.sphere) {
    b.add(p.sphere->center - V3d(p.sphere->radius));
    b.add(p.sphere->center + V3d(p.sphere->radius));
  }
  if (p.disk) {
    for (int k = 0; k < 4; ++k)
      b.add(p.disk->center + p.disk->u * (k & 1 ? 1. : -1.) + p.disk->v * (k & 2 ? 1. : -1.));
  }
}

// +1 or -1: what takes the winding normal of a mesh, or the outward normal of a sphere, to the one that the
// dialect means (checked against Mitsuba 3.9.1; there a mirrored sphere is inside out).
float orientation_of(const Shape& shape, bool vertex_normals) {
  float sign = shape.flip_normals ? -1.f : 1.f;
  // A rectangle's normal is its transformed +z and a mesh with normals follows them; the winding of a
  // mirrored one is reversed.
  const bool follows = std::holds_alternative<RectangleShape>(shape.geometry) ||
                       std::holds_alternative<CubeShape>(shape.geometry) ||
                       std::holds_alternative<SphereShape>(shape.geometry) || vertex_normals;
  if (follows && Affine(shape.to_world).determinant() < 0) sign = -sign;
  return sign;
}

void append(Geometry& g, Placed& p, std::uint32_t surface) {
  const auto base = static_cast<std::uint32_t>(g.positions.size());
  SurfaceInfo& info = g.surfaces[surface];
  for (const V3d& v : p.mesh.positions) g.positions.push_back(V3((v - g.center) * g.scale));
  if (!p.mesh.normals.empty()) {
    info.normals = true;
    g.normals.resize(base);
    for (const V3d& n : p.mesh.normals) g.normals.push_back(V3(n));
  }
  if (!p.mesh.uvs.empty()) {
    info.uvs = true;
    g.uvs.resize(base);
    g.uvs.insert(g.uvs.end(), p.mesh.uvs.begin(), p.mesh.uvs.end());
  }
  for (std::size_t i = 0; i + 2 < p.mesh.indices.size(); i += 3) {
    const std::uint32_t a = base + p.mesh.indices[i], b = base + p.mesh.indices[i + 1],
                        c = base + p.mesh.indices[i + 2];
    const V3d e1 = V3d(g.positions[b]) - V3d(g.positions[a]), e2 = V3d(g.positions[c]) - V3d(g.positions[a]);
    if (!(e1.cross(e2).length() > 0)) {
      ++g.dropped_triangles;
      continue;
    }
    g.indices.insert(g.indices.end(), {a, b, c});
    g.triangle_surface.push_back(surface);
  }
  if (p.sphere) {
    Sphere s = *p.sphere;
    s.center = (s.center - g.center) * g.scale;
    s.radius *= g.scale;
    s.surface = surface;
    g.spheres.push_back(s);
  }
  if (p.disk) {
    Disk d = *p.disk;
    d.center = (d.center - g.center) * g.scale;
    d.u *= g.scale;
    d.v *= g.scale;
    d.surface = surface;
    g.disks.push_back(d);
  }
}

SurfaceInfo surface_info(const Scene& scene, const std::vector<scene::BsdfTraits>& traits, const Shape& s,
                         bool vertex_normals) {
  SurfaceInfo info;
  info.bsdf = s.bsdf;
  info.null = std::holds_alternative<NullBsdf>(scene.bsdfs.at(s.bsdf.value));
  info.veil = !info.null && traits.at(s.bsdf.value).passes;
  info.transition = s.is_medium_transition;
  if (s.interior) info.interior = s.interior->value;
  if (s.exterior) info.exterior = s.exterior->value;
  info.orientation = orientation_of(s, vertex_normals);
  return info;
}

void choose_world(Geometry& g, const Bounds& b) {
  if (b.empty()) return;
  g.center = (b.lo + b.hi) * .5;
  const V3d half = (b.hi - b.lo) * .5;
  const double extent = std::max(half.x, std::max(half.y, half.z));
  if (extent > 0) {
    int exponent = 0;
    std::frexp(extent, &exponent);  // extent <= 2^exponent
    g.scale = std::ldexp(1., -exponent);
  }
  g.radius = static_cast<float>(half.length() * g.scale);
}

}  // namespace

Result<Geometry> Geometry::build(const Scene& scene, const AssetLoader& files) {
  Geometry g;
  const auto traits = scene::bsdf_traits(scene);
  if (!traits) return fail(Errc::invalid_argument, "the scene's materials contain themselves");
  std::vector<Placed> placed;
  Bounds bounds;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    auto p = place(scene.shapes[i], files);
    if (!p) return fail(p.error().code, fmt::format("shape {}: {}", i + 1, p.error().message));
    add_bounds(*p, bounds);
    g.surfaces.push_back(surface_info(scene, *traits, scene.shapes[i], p->normals_given));
    placed.push_back(std::move(*p));
  }
  if (!bounds.empty() && !(std::isfinite(bounds.lo.x + bounds.lo.y + bounds.lo.z) &&
                           std::isfinite(bounds.hi.x + bounds.hi.y + bounds.hi.z))) {
    return fail(Errc::invalid_argument,
                "the scene's shapes reach to infinity: check transforms and mesh vertices");
  }
  choose_world(g, bounds);
  for (const bool passes : {false, true}) {
    for (std::uint32_t i = 0; i < placed.size(); ++i) {
      if ((g.surfaces[i].null || g.surfaces[i].veil) == passes) append(g, placed[i], i);
    }
    if (!passes) {
      g.opaque_triangles = g.triangle_count();
      g.opaque_spheres = static_cast<std::uint32_t>(g.spheres.size());
      g.opaque_disks = static_cast<std::uint32_t>(g.disks.size());
    }
  }
  // The BVH loads 16 bytes for a vertex of 12: the last one must not end at the end of its allocation.
  g.positions.reserve(g.positions.size() + 2);
  if (!g.normals.empty()) g.normals.resize(g.positions.size());
  if (!g.uvs.empty()) g.uvs.resize(g.positions.size());
  return g;
}

}  // namespace ls::render
