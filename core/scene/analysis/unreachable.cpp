#include "core/scene/analysis/unreachable.h"

#include <algorithm>

#include "core/scene/analysis/shape_place.h"
#include "core/scene/limits.h"
#include "core/scene/schema/light_links.h"
#include "core/scene/schema/traits.h"
#include "core/scene/transform.h"

namespace ls::scene {
namespace {

// The margin around boxes, as a fraction of the largest coordinate of the two boxes that are compared. It is
// 16 times the renderer's offset of ray origins. So if two objects are at least this far apart, a ray that
// leaves the surface of one cannot start inside the other.
constexpr double kApart = 0x1p-16;
Box with_margin(const Box& b, const Box& beside) {
  return grown(b, kApart * std::max(largest_coordinate(b), largest_coordinate(beside)));
}

// True if the box `tight`, with a margin, contains no point of the camera or of its near plane. Rays begin on
// the near plane.
bool camera_is_outside(const Sensor& s, const Box& tight) {
  const Vec3 camera = origin_of(s.to_world);
  const Box box = with_margin(tight, {camera, camera});
  if (touch(box, {camera, camera})) return false;
  if (s.projection == Projection::spherical) return true;
  const Vec3 normal = cross(column(s.to_world, 0), column(s.to_world, 1));
  const double unit = dot(normal, column(s.to_world, 2));
  bool before = true, behind = true;
  for (int k = 0; k < 8; ++k) {
    const Vec3 p = corner(box, k);
    const double depth = dot(normal, minus(p, camera)) / unit;
    before = before && depth < 0;
    behind = behind && depth > s.near_clip * (1 + kApart);
  }
  return before || behind;
}

class Search {
 public:
  Search(const Scene& scene, const std::vector<BsdfTraits>& traits)
      : s_(scene), traits_(traits), links_(scene) {
    for (std::size_t i = 0; i < s_.shapes.size(); ++i)
      if (is_entrance(s_.shapes[i])) entrances_.push_back({i, place_in_scene(s_.shapes[i])});
  }

  bool unreachable(std::size_t i) {
    const Shape& s = s_.shapes[i];
    // Meters may be anywhere.
    if (!s_.meters.empty() || !s.interior || s.group || lets_rays_in(s) || !has_interior_behind(s))
      return false;
    const auto box = box_of(s);
    // Where a camera or a shape that moves is at all times is not looked at.
    if (!s_.sensor.motion.empty() || !s.motion.empty()) return false;
    const bool clear = box ? camera_is_outside(s_.sensor, *box) : !s_.sensor.medium;
    return clear && (traits_[s.bsdf.value].black_behind || (box && sealed(s, i, *box)));
  }

 private:
  struct Entrance {
    std::size_t shape;
    std::optional<Box> box;  // bounding box in the scene; nullopt: unknown
  };
  // True if some rays pass the shape because they do not see it, or shadow rays because it does not shade
  // their light.
  bool lets_rays_in(const Shape& s) const {
    return !s.visible_camera || !s.visible_shadow || !s.visible_reflection || !s.visible_volume ||
           (links_.blockers() & ~links_.having(s.link_sets)) != 0;
  }
  bool emits(MediumIndex m) const { return traits_of(s_.media[m.value], s_.volumes).emits; }
  static std::optional<Box> place_in_scene(const Shape& s) {
    return s.group || !s.motion.empty() ? std::nullopt : box_of(s);
  }

  // True if light may enter through the shape or come from it. A surface that light passes unchanged (bsdf
  // "null") and that bounds no medium does not count, since prune.cpp removes it later.
  bool is_entrance(const Shape& s) const {
    const auto glowing = [&](const std::optional<MediumIndex>& m) { return m && emits(*m); };
    if (s.emitter || glowing(s.interior) || glowing(s.exterior) || lets_rays_in(s)) return true;
    const bool nothing = std::holds_alternative<NullBsdf>(s_.bsdfs[s.bsdf.value]) && !s.is_medium_transition;
    return traits_[s.bsdf.value].transmits && !nothing;
  }

  // True if the normals of the shape point away from its interior medium, as usual. False if the shape is
  // mirrored, or if it is a mesh whose file may have normals that swap its sides
  // (worker/render/geometry/geometry_build.cpp).
  static bool has_interior_behind(const Shape& s) {
    const auto* mesh = std::get_if<MeshShape>(&s.geometry);
    return invertible(s.to_world) && determinant3(s.to_world) > 0 && (!mesh || mesh->face_normals);
  }

  // True if no light reaches the medium inside the shape. All of these conditions must hold: the shape is a
  // sphere or a cube; light does not pass its surface; neither the surface nor the medium emits; no emitter
  // and no other entrance (a surface through or from which light may come) touches the shape or is inside it;
  // its normals are not flipped, since flipped normals put the interior medium on the outside.
  bool sealed(const Shape& s, std::size_t i, const Box& box) {
    const bool closed =
        std::holds_alternative<SphereShape>(s.geometry) || std::holds_alternative<CubeShape>(s.geometry);
    if (!closed || s.flip_normals || s.emitter || traits_[s.bsdf.value].transmits || emits(*s.interior))
      return false;
    const auto lit = [&](const Emitter& e) {
      const auto p = traits_of(e, s_.textures).position;
      return p && touch(with_margin(box, {*p, *p}), {*p, *p});
    };
    if (std::any_of(s_.emitters.begin(), s_.emitters.end(), lit)) return false;
    if ((compared_ += entrances_.size()) > kMaxEntrances) return false;
    return std::all_of(entrances_.begin(), entrances_.end(),
                       [&](const Entrance& e) { return e.shape != i && e.box && apart(box, e); });
  }

  // True if the surface of the entrance `e` is apart from the box `tight`: `e` is beside the box, or encloses
  // it.
  bool apart(const Box& tight, const Entrance& e) const {
    const Box box = with_margin(tight, *e.box);
    if (!touch(box, *e.box)) return true;
    const Shape& s = s_.shapes[e.shape];
    if (!invertible(s.to_world)) return false;
    for (int k = 0; k < 8; ++k)
      if (!holds(s, corner(box, k))) return false;
    return true;
  }

  const Scene& s_;
  const std::vector<BsdfTraits>& traits_;
  const LinkLists links_;
  std::vector<Entrance> entrances_;
  std::uint64_t compared_ = 0;
};

}  // namespace

std::vector<bool> unreachable_interiors(const Scene& scene) {
  std::vector<bool> out(scene.shapes.size(), false);
  const auto traits = bsdf_traits(scene);
  const bool any = std::any_of(scene.shapes.begin(), scene.shapes.end(), [&](const Shape& s) {
    return s.interior && traits && !(*traits)[s.bsdf.value].transmits;
  });
  if (!any) return out;
  Search search(scene, *traits);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = search.unreachable(i);
  return out;
}

}  // namespace ls::scene
