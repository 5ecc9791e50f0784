// Translates shapes, and assigns to them the current material, area light and media.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/scene/motion.h"
#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

struct Mesh {
  std::vector<double> positions, normals, uvs;  // per corner (vertex): 3, 3 and 2 numbers
  std::vector<double> indices;                  // three corners per triangle; whole numbers in range
};

class ShapeTranslator {
 public:
  ShapeTranslator(Translation& t, Params& p, const Attributes& a, bool in_object)
      : t_(t), p_(p), a_(a), in_object_(in_object) {}

  std::optional<Element> run() {
    auto out = geometry();
    if (out) {
      const bool stands = a_.end_ctm.to == a_.ctm.to;
      const Way way{to_world_.to,
                    stands ? to_world_.to : multiply(a_.end_ctm.to, multiply(a_.ctm.from, to_world_.to))};
      place_moving(t_, *out, way, why_still(way), p_.at());
      orient(*out);
      surface(*out);
    }
    p_.finish();
    return out;
  }

 private:
  std::optional<Element> geometry() {
    const std::string_view type = p_.row().type;
    to_world_ = a_.ctm;
    if (type == "sphere") return sphere();
    if (type == "disk") return disk();
    if (type == "cylinder") return cylinder();
    if (type == "plymesh") return ply_file();
    return type == "trianglemesh" ? triangles() : patches();
  }

  std::string_view why_still(const Way& way) const {
    const std::string_view type = p_.row().type;
    if (in_object_) return "it is in an ObjectBegin";
    if (a_.light) return "it gives light";
    const bool round = type == "sphere" || type == "cylinder";
    return round && !(is_similarity(way.start) && is_similarity(way.end)) ? "it is stretched" : "";
  }
  bool needs_uv() const { return a_.material.has_texture || p_.has("alpha"); }

  void need_whole() {
    if (p_.number("phimax", 360) != 360)
      p_.error(p_.at(),
               fmt::format("{} is cut off by phimax: {}", p_.title(), p_.row().find("phimax")->meaning));
  }

  Element sphere() {
    need_whole();
    // v of our spheres is 0 at the north pole, in pbrt at the south pole. A mirror along the axis exchanges
    // the poles, and orient() turns the normals back.
    if (needs_uv()) to_world_ = then(a_.ctm, scaled(Vec3{{1, 1, -1}}));
    Element out = made("shape", "sphere", p_.at());
    const double radius = p_.number("radius", 1);
    areas_ = {4 * std::numbers::pi * radius * radius};
    add(out, "radius", radius, p_.at());
    return out;
  }

  Element disk() {
    need_whole();
    if (p_.number("innerradius", 0) != 0)
      p_.error(p_.at(), fmt::format("{} has a hole: {}", p_.title(), p_.row().find("innerradius")->meaning));
    if (a_.material.has_texture)
      t_.warn_once(p_.at(),
                   "a texture lies otherwise on a disk than in pbrt: here u is the distance from the centre "
                   "and v the angle, in pbrt u is the angle and v is 1 at the centre");
    const double radius = p_.number("radius", 1);
    areas_ = {std::numbers::pi * radius * radius};
    to_world_ =
        then(then(a_.ctm, moved(Vec3{{0, 0, p_.number("height", 0)}})), scaled(Vec3{{radius, radius, 1}}));
    return made("shape", "disk", p_.at());
  }

  Element cylinder() {
    need_whole();
    Element out = made("shape", "cylinder", p_.at());
    const double low = p_.number("zmin", -1), high = p_.number("zmax", 1), radius = p_.number("radius", 1);
    areas_ = {2 * std::numbers::pi * radius * std::abs(high - low)};
    add(out, "point", "p0", fmt::format("0 0 {}", low), p_.at());
    add(out, "point", "p1", fmt::format("0 0 {}", high), p_.at());
    add(out, "radius", radius, p_.at());
    return out;
  }

  std::optional<Element> ply_file() {
    const std::string file = p_.text("filename", "");
    if (file.empty()) {
      p_.missing("filename");
      return std::nullopt;
    }
    return ply(file);
  }

  Element ply(const std::string& file) {
    Element out = made("shape", "ply", p_.at());
    add(out, "string", "filename", file, p_.at());
    add(out, "boolean", "flat_without_normals", "true", p_.at());
    return out;
  }

  // Returns the parameter `indices`, which has `each` (3 or 4) indices per face. If it is not given and the
  // shape has exactly `each` corners, returns 0, 1, ..., each - 1. Empty: the parameter is wrong or missing,
  // which was reported.
  std::vector<double> indices(std::size_t corners, std::size_t each) {
    const Param* p = p_.take("indices");
    if (!p) {
      std::vector<double> all;
      for (std::size_t i = 0; i < each; ++i) all.push_back(static_cast<double>(i));
      if (corners == each) return all;
      p_.missing("indices");
      return {};
    }
    const auto is_wrong = [&](double x) {
      return x != std::floor(x) || x < 0 || x >= static_cast<double>(corners);
    };
    const auto bad = std::find_if(p->numbers.begin(), p->numbers.end(), is_wrong);
    if (bad != p->numbers.end())
      return p_.error(p->at, fmt::format("there is no corner {}: P has {}, counted from 0", *bad, corners)),
             std::vector<double>{};
    if (!p->numbers.empty() && p->numbers.size() % each == 0) return p->numbers;
    return p_.error(p->at, fmt::format("{} indices are no multiple of {}", p->numbers.size(), each)),
           std::vector<double>{};
  }

  // Measures the area of each face in the world, since pbrt makes a separate light of each face. A face is
  // `size` triangles of the mesh.
  void measure(const Mesh& mesh, std::size_t size) {
    const auto corner = [&](std::size_t i) {
      const std::size_t at = 3 * static_cast<std::size_t>(mesh.indices[i]);
      return transform_point(to_world_.to,
                             Vec3{{mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]}});
    };
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const Vec3 a = corner(i), b = corner(i + 1), c = corner(i + 2);
      const Vec3 normal = cross(minus(b, a), minus(c, a));
      if (i / 3 % size == 0) areas_.push_back(0);
      areas_.back() += .5 * std::sqrt(dot(normal, normal));
    }
  }

  std::optional<Element> kept(const Mesh& mesh) {
    const auto single = [](const std::vector<double>& all) {
      return std::vector<float>(all.begin(), all.end());
    };
    const auto file = keep_made(t_.assets, MadeMesh{.positions = single(mesh.positions),
                                                    .normals = single(mesh.normals),
                                                    .uvs = single(mesh.uvs),
                                                    .indices = {mesh.indices.begin(), mesh.indices.end()}});
    return file ? std::optional(ply(*file)) : p_.refuse(p_.at(), file.error().message);
  }

  const Param* take_corners() {  // nullptr: there are none, which has been reported
    const Param* corners = p_.take("P");
    if (!corners) p_.missing("P");
    if (!corners || !corners->numbers.empty()) return corners;
    return p_.error(corners->at, "P has no corners"), nullptr;
  }

  // Returns the parameter, which has `size` numbers for each corner; nullptr if it is not given, or is wrong,
  // which was reported.
  const std::vector<double>* per_corner(const char* name, std::size_t size, std::size_t corners) {
    const Param* p = p_.take(name);
    if (!p || p->numbers.size() == size * corners) return p ? &p->numbers : nullptr;
    p_.error(p->at,
             fmt::format("'{}' has {} numbers, but P has {} corners", name, p->numbers.size(), corners));
    return nullptr;
  }

  std::optional<Element> triangles() {
    const Param* corners = take_corners();
    if (!corners) return std::nullopt;
    const std::size_t n = corners->numbers.size() / 3;
    Mesh mesh{corners->numbers, {}, {}, indices(n, 3)};
    for (const auto& [name, size, list] : {std::tuple{"N", std::size_t{3}, &mesh.normals},
                                           {"uv", std::size_t{2}, &mesh.uvs},
                                           {"st", std::size_t{2}, &mesh.uvs}})
      if (const auto* given = per_corner(name, size, n)) *list = *given;
    has_normals_ = !mesh.normals.empty();
    if (a_.light && a_.light->power) measure(mesh, 1);
    if (mesh.indices.empty()) return std::nullopt;
    if (!mesh.uvs.empty() || !needs_uv()) return kept(mesh);
    if (mesh.indices.size() > kMaxOwnCorners) return too_many_corners();
    return kept(with_default_uv(mesh));
  }

  // The most corners that a mesh may have if each triangle or patch gets corners of its own. An index takes
  // as little as 2 bytes of text, but the corner that is made from it takes up to 200 bytes of memory until
  // the mesh's file is written.
  static constexpr std::size_t kMaxOwnCorners = std::size_t{1} << 22;
  std::optional<Element> too_many_corners() {
    return p_.refuse(
        p_.at(), fmt::format("{} has more than {} corners that need uv of their own: give uv, or a plymesh",
                             p_.title(), kMaxOwnCorners));
  }

  // Gives each triangle corners of its own, with pbrt's default uv of triangles.
  static Mesh with_default_uv(const Mesh& mesh) {
    Mesh out;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      const auto first = 3 * static_cast<std::ptrdiff_t>(mesh.indices[i]);
      for (const auto& [from, to] :
           {std::pair{&mesh.positions, &out.positions}, {&mesh.normals, &out.normals}})
        if (!from->empty()) to->insert(to->end(), from->begin() + first, from->begin() + first + 3);
      out.uvs.insert(out.uvs.end(), {i % 3 == 0 ? 0. : 1., i % 3 == 2 ? 1. : 0.});
      out.indices.push_back(static_cast<double>(i));
    }
    return out;
  }

  std::optional<Element> patches() {
    const Param* corners = take_corners();
    if (!corners) return std::nullopt;
    const std::vector<double>& x = corners->numbers;
    const std::vector<double> four = indices(x.size() / 3, 4);
    if (four.empty()) return std::nullopt;
    if (four.size() > kMaxOwnCorners) return too_many_corners();
    const auto *normals = per_corner("N", 3, x.size() / 3), *uvs = per_corner("uv", 2, x.size() / 3);
    has_normals_ = normals != nullptr;
    // Patches share no corners, since u and v go from 0 to 1 on each patch if none are given.
    Mesh mesh;
    for (std::size_t i = 0; i < four.size(); i += 4) {
      std::array<Vec3, 3> side;  // vectors from corner 0 to the corners 1, 2 and 3
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
          side[k][axis] = x[3 * std::size_t(four[i + k + 1]) + axis] - x[3 * std::size_t(four[i]) + axis];
      const Vec3 normal = cross(side[0], side[1]);
      const double size = std::sqrt(dot(normal, normal)) * std::sqrt(dot(side[2], side[2]));
      // The tolerance allows for the coordinates' rounding to single precision, by up to 2^-24 of their
      // value.
      if (std::abs(dot(normal, side[2])) > 1e-5 * size)
        return p_.refuse(
            p_.at(), fmt::format("{} is bent, and only flat patches are read: give a plymesh", p_.title()));
      const Vec3 apart = minus(minus(side[2], side[0]), side[1]);
      if ((needs_uv() || normals) && dot(apart, apart) > 1e-10 * dot(side[2], side[2]))
        t_.warn_once(p_.at(),
                     fmt::format("a patch of {} that is no parallelogram is two triangles here, over "
                                 "which textures and normals go otherwise than in pbrt",
                                 p_.title()));
      for (const std::size_t k : {0, 1, 3, 0, 3, 2}) mesh.indices.push_back(static_cast<double>(i + k));
      for (std::size_t k = 0; k < 4; ++k) {
        const auto corner = x.begin() + 3 * static_cast<std::ptrdiff_t>(four[i + k]);
        mesh.positions.insert(mesh.positions.end(), corner, corner + 3);
        const auto own = [&](const std::vector<double>& from, std::ptrdiff_t size) {
          return from.begin() + size * static_cast<std::ptrdiff_t>(four[i + k]);
        };
        if (normals) mesh.normals.insert(mesh.normals.end(), own(*normals, 3), own(*normals, 3) + 3);
        if (uvs)
          mesh.uvs.insert(mesh.uvs.end(), own(*uvs, 2), own(*uvs, 2) + 2);
        else
          mesh.uvs.insert(mesh.uvs.end(), {k % 2 == 0 ? 0. : 1., k < 2 ? 0. : 1.});
      }
    }
    if (a_.light && a_.light->power) measure(mesh, 2);
    return kept(mesh);
  }

  // The original side of a shape is the one that its normal points to without ReverseOrientation and
  // mirrors: outside of a sphere, and where the corners of a mesh run counterclockwise or its vertex normals
  // point. In pbrt the normal is on the other side if the shape is reversed; of a sphere, disk or cylinder,
  // if it is either reversed or mirrored, so that both together cancel (Sphere, Disk and Cylinder in
  // src/pbrt/shapes.h against Triangle, whose corners are mirrored, too).
  bool is_turned() const { return is_quadric() ? a_.reversed != is_mirrored() : a_.reversed; }
  bool is_mirrored() const { return determinant3(a_.ctm.to) < 0; }
  bool is_quadric() const {
    const std::string_view type = p_.row().type;
    return type == "sphere" || type == "disk" || type == "cylinder";
  }

  // Adds flip_normals if the normals would otherwise be on the other side than in pbrt. Here a mirrored
  // sphere, and a mirrored mesh without vertex normals, have their normals on the side that is not the
  // original one; all others on the original side.
  void orient(Element& out) {
    const std::string_view type = p_.row().type;
    const bool one_sided = a_.light && !a_.light->two_sided;
    if (type == "plymesh" && is_mirrored() && (one_sided || a_.inside != a_.outside || a_.material.transmits))
      p_.error(p_.at(),
               fmt::format("{} is mirrored by its transform, and its sides matter, as it gives light, bounds "
                           "a medium or lets light through, but whether the file has normals, which decides "
                           "which side is which, is not known here: mirror the mesh in its file",
                           p_.title()));
    if (is_quadric() && is_mirrored() && one_sided)
      t_.warn_once(
          p_.at(),
          "a mirrored sphere, disk or cylinder gives light here on the side from which pbrt shows it "
          "shining; when it samples lights, pbrt takes the other side");
    if (a_.material.has_normal_map && is_mirrored())
      t_.warn_once(p_.at(),
                   "a normal map on a shape that its transform mirrors leans as in pbrt, which does not "
                   "mirror it along: for the mirrored picture, mirror the mesh in its file instead");
    const bool by_corners = (type == "trianglemesh" || type == "bilinearmesh") && !has_normals_;
    const bool turned_here = determinant3(to_world_.to) < 0 && (type == "sphere" || by_corners);
    if (is_turned() != turned_here) add(out, "boolean", "flip_normals", "true", p_.at());
  }

  void surface(Element& out) {
    const bool is_masked = p_.has("alpha") && !a_.material.null;
    if (p_.has("alpha") && a_.material.null) p_.take("alpha");
    if (is_masked) {
      Element mask = made("bsdf", "mask", p_.at());
      add_value(t_, mask, p_, {"alpha", "opacity"}, {1, 1, 1});
      refer(mask, "", a_.material.id, p_.at());
      add(out, std::move(mask));
    } else {
      refer(out, "", a_.material.id, p_.at());
    }
    if (a_.light && is_masked)
      t_.warn_once(p_.at(),
                   "a shape's alpha does not mask its light here; in pbrt it does, and with alpha 0 the "
                   "shape is unseen and gives all of its light");
    if (a_.light && a_.material.null)
      t_.warn_once(p_.at(), "shapes of Material \"interface\" give no light, in pbrt neither");
    if (a_.light && !a_.material.null) {
      Element area = made("emitter", "area", a_.light->at);
      add(area, "radiance", radiance(*a_.light), a_.light->at);
      if (a_.light->two_sided) add(area, "boolean", "two_sided", "true", a_.light->at);
      add(out, std::move(area));
    }
    if (a_.inside == a_.outside) return;
    // In pbrt the inside medium is on the side that the normals point away from. So it is here, except that
    // the interior of a mirrored sphere or mesh is always on the side away from the original one.
    const std::string_view type = p_.row().type;
    const bool swapped =
        determinant3(to_world_.to) < 0 && type != "disk" && type != "cylinder" && is_turned();
    const std::string &inside = swapped ? a_.outside : a_.inside, &outside = swapped ? a_.inside : a_.outside;
    if (!inside.empty()) refer(out, "interior", medium_id(inside), p_.at());
    if (!outside.empty()) refer(out, "exterior", medium_id(outside), p_.at());
  }

  // A Lambertian emitter of area A and radiance L has the power pi A L.
  Rgb radiance(const AreaLight& light) {
    if (!light.power) return light.radiance;
    const auto [least, most] = std::minmax_element(areas_.begin(), areas_.end());
    // The tolerance allows for the coordinates' rounding to single precision, as in patches().
    if (areas_.empty() || !(*least > 0) || *most > *least * (1 + 1e-4)) {
      p_.error(light.at,
               fmt::format(
                   "the power of this light can't be spread over {}: {}; give L, which is power / (pi area)",
                   p_.title(), areas_.empty() ? "its area is in its file" : "its triangles differ in area"));
      return light.radiance;
    }
    const double sides = light.two_sided ? 2 : 1, factor = *light.power / (std::numbers::pi * *most * sides);
    return {light.radiance[0] * factor, light.radiance[1] * factor, light.radiance[2] * factor};
  }

  Translation& t_;
  Params& p_;
  const Attributes& a_;
  const bool in_object_;
  Placed to_world_;
  bool has_normals_ = false;
  std::vector<double> areas_;  // areas of the separate lights (see measure()); empty: unknown
};

}  // namespace

std::optional<Element> shape(Translation& t, Params& p, const Attributes& attributes, bool in_object) {
  return ShapeTranslator(t, p, attributes, in_object).run();
}

void place_moving(Translation& t, Element& out, const Way& way, std::string_view why_still, const Span& at) {
  if (way.start == way.end) return place(out, way.start, at);
  const bool apart = (determinant3(way.start) < 0) != (determinant3(way.end) < 0);
  if (why_still.empty() && (apart || !can_move(way.start) || !can_move(way.end)))
    why_still = "its transforms shear, or one of them mirrors";
  if (!why_still.empty()) {
    t.warn_once(at,
                fmt::format("this moves in pbrt; it is shown where it is at StartTime, since {}", why_still));
    return place(out, way.start, at);
  }
  animate(out, {t.start_time, way.start}, {t.end_time, way.end}, at);
  t.moves = true;
}

}  // namespace ls::scene::pbrt
