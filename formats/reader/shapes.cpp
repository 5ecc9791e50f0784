// Reads shapes with their nested objects (bsdf, area emitter, media), and groups of shapes with their
// instances.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/scene/motion.h"
#include "core/scene/schema/mesh_attributes.h"
#include "formats/reader/mitsuba_plugins.h"
#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"

namespace ls::scene {
namespace {

// Returns the child that gives this parameter; nullptr: there is none.
const Element* parameter_of(const Element& object, std::string_view name) {
  const auto at =
      std::ranges::find_if(object.children, [&](const Element& child) { return child.get("name") == name; });
  return at == object.children.end() ? nullptr : &*at;
}

}  // namespace

void Reader::read_shape(const Element& e) {
  const std::string_view type = e.get("type");
  if (type == "rectangle") return read_geometry(e, RectangleShape{});
  if (type == "cube") return read_geometry(e, CubeShape{});
  if (type == "sphere") return read_geometry(e, SphereShape{});
  if (type == "disk") return read_geometry(e, DiskShape{});
  if (type == "obj") return read_geometry(e, MeshShape{.format = MeshFormat::obj, .flip_tex_coords = true});
  if (type == "ply") return read_geometry(e, MeshShape{.format = MeshFormat::ply});
  if (type == "serialized") return read_geometry(e, MeshShape{.format = MeshFormat::serialized});
  if (type == "cylinder") return read_geometry(e, CylinderShape{});
  if (type == "shapegroup") return read_shape_group(e);
  if (type == "instance") return read_instance(e);
  if (type == "merge") return read_merge(e);
  unknown_plugin(e, report_);
}

void Reader::refuse_in_group(const Element& use, std::string_view type) {
  report_.error(use.at, fmt::format("{} can't stand in a shapegroup: instances within instances are not "
                                    "supported, by Mitsuba neither; put the shapes themselves here",
                                    type == "instance" ? "an instance" : "a shapegroup"));
}

// A group is read at its first use, which may be an instance that precedes the group in the file.
void Reader::read_shape_group(const Element& e) {
  if (groups_.contains(&e)) return;
  auto& index = groups_[&e];
  Params p(*this, e);
  const GroupIndex group{static_cast<std::uint32_t>(scene_.groups.size())};
  const std::size_t before = scene_.shapes.size();
  for (const auto& [object, use] : p.take_nested("shape")) {
    const std::string_view type = object->get("type");
    if (type == "instance" || type == "shapegroup") {
      refuse_in_group(*use, type);
      continue;
    }
    group_ = group;
    read_shape(*object);
    group_.reset();
  }
  p.finish();
  if (scene_.shapes.size() == before) {
    if (!report_.has_errors())
      report_.warning(e.at, "this shapegroup holds no shape: instances of it show nothing");
    return;
  }
  scene_.groups.emplace_back();
  index = group;
}

// Reads each shape in a shape "merge" as a shape of its own, which does not change the image. A merge may be
// used only once and not within another merge: otherwise nested references could multiply its shapes until
// memory runs out.
void Reader::read_merge(const Element& e) {
  if (!merges_.insert(&e).second)
    return report_.error(
        e.at, "this shape \"merge\" is used twice: put it into a shapegroup and use instances of that");
  Params p(*this, e);
  for (const auto& [object, use] : p.take_nested("shape")) {
    const std::string_view type = object->get("type");
    if (type == "merge")
      report_.error(use->at, "a merge can't stand in another: put its shapes themselves here");
    else if (group_ && (type == "instance" || type == "shapegroup"))
      refuse_in_group(*use, type);
    else
      read_shape(*object);
  }
  p.finish();
}

void Reader::read_instance(const Element& e) {
  Params p(*this, e);
  Instance instance;
  const Element* animation = p.take_animation("to_world");
  const auto fits = [&](const Element& at, const Transform& to_world) {
    if (invertible(to_world)) return true;
    report_.error(at.at,
                  "to_world flattens this instance or leaves the range of numbers: it can't be inverted");
    return false;
  };
  std::vector<MotionKey> keys;
  if (animation) keys = read_keys(*animation, fits);
  bind(p, instance);
  const auto nested = p.take_nested("shape");
  p.finish();
  if (nested.empty())
    return report_.error(e.at, "an instance needs a shapegroup: put <ref id=\"...\"/> to one into it");
  if (nested.size() > 1) return report_.error(nested[1].use->at, "this instance has a second shapegroup");
  const Element& object = *nested[0].object;
  if (object.get("type") != "shapegroup")
    return report_.error(
        nested[0].use->at,
        fmt::format(
            "an instance shows a shapegroup, not a shape \"{}\": put that into a <shape type=\"shapegroup\">",
            object.get("type")));
  fits(e, instance.to_world);
  read_shape_group(object);
  const auto& group = groups_[&object];
  if (!group) return;
  instance.group = *group;
  scene_.instances.push_back(instance);
  if (animation) note_motion(*animation, true, std::move(keys));
  label_instance(e);
}

template <class T>
void Reader::read_geometry(const Element& e, T geometry) {
  Params p(*this, e);
  if constexpr (std::is_same_v<T, MeshShape>) {
    const bool serialized = geometry.format == MeshFormat::serialized;
    const std::string_view foreign = serialized ? "flip_tex_coords" : "shape_index";
    if (const Element* given = p.take(foreign))
      report_.error(
          given->at,
          fmt::format("{} has no parameter '{}': {}", p.title(), foreign,
                      serialized ? "its v is never turned"
                                 : "it is for \"serialized\" files, which may hold several meshes"));
  }
  bind(p, geometry);
  Shape shape;
  shape.group = group_;
  const Element* animation = p.take_animation("to_world");
  bind(p, shape);
  shape.geometry = geometry;
  read_shape_parts(p, shape);
  check_visibility(p, shape);
  p.finish();
  check_placement(e, e, shape);
  check_attributes(e, shape);
  std::vector<MotionKey> keys;
  if (animation) keys = read_shape_keys(e, *animation, shape);
  scene_.shapes.push_back(std::move(shape));
  if (animation) note_motion(*animation, false, std::move(keys));
  label_shape(e);
  shape_elements_.push_back(&e);
}

std::vector<MotionKey> Reader::read_shape_keys(const Element& e, const Element& animation,
                                               const Shape& shape) {
  if (const std::string_view why = why_still(shape); !why.empty()) {
    report_.error(animation.at,
                  fmt::format("this {} {}, and such shapes can't move: give it a <transform>{}",
                              e.get("type"), why, shape.group ? ", or let instances of its group move" : ""));
    return {};
  }
  return read_keys(animation, [&, placed = shape](const Element& at, const Transform& to_world) mutable {
    placed.to_world = to_world;
    if (!check_placement(e, at, placed)) return false;
    if (!shape.emitter || is_similarity(to_world)) return true;
    report_.error(at.at,
                  "this transform stretches a shape that emits light and moves: such a shape can only turn, "
                  "move, mirror and scale alike along all axes");
    return false;
  });
}

// Rays pass a surface without a material anyhow, and the medium behind it stays visible to them.
void Reader::check_visibility(Params& p, const Shape& shape) {
  if (const Element* given =
          shape.holdout && shape.shadow_catcher ? parameter_of(p.object(), "shadow_catcher") : nullptr)
    report_.error(given->at, fmt::format("{} is a holdout, which shows no shadow: remove 'holdout' or "
                                         "'shadow_catcher'",
                                         p.title()));
  // A bsdf that could not be read is not in the list.
  const bool known = shape.bsdf.value < scene_.bsdfs.size();
  if (shape.emitter || !known || !std::holds_alternative<NullBsdf>(scene_.bsdfs[shape.bsdf.value])) return;
  const auto check = [&](const char* name, bool visible) {
    if (const Element* given = visible ? nullptr : parameter_of(p.object(), name))
      report_.error(given->at,
                    fmt::format("'{}' has no effect on {} with the bsdf \"null\": every ray passes this "
                                "surface and enters its medium. Remove the parameter",
                                name, p.title()));
  };
  check("visible_shadow", shape.visible_shadow);
  check("visible_reflection", shape.visible_reflection);
  check("visible_volume", shape.visible_volume);
}

void Reader::read_shape_parts(Params& p, Shape& shape) {
  const auto medium_of = [&](std::string_view name) -> std::optional<MediumIndex> {
    const Element* use = p.take(name);
    const Element* object = use ? resolve(*use) : nullptr;
    if (!object) return std::nullopt;
    shape.is_medium_transition = true;
    return medium(*object, *use);
  };
  shape.interior = medium_of("interior");
  shape.exterior = medium_of("exterior");

  const auto emitter = p.take_only("emitter", p.title(), "emitter");
  if (emitter && shape.group)
    report_.error(
        emitter->use->at,
        fmt::format("{} in a shapegroup can't emit light, in Mitsuba neither: place it outside of the group",
                    p.title()));
  else if (emitter)
    shape.emitter = read_area(*emitter->object);

  if (const auto sensor = p.take_only("sensor", p.title(), "sensor")) {
    if (shape.group)
      report_.error(sensor->use->at,
                    fmt::format("{} in a shapegroup can't be measured, since its instances are in several "
                                "places: place it outside of the group",
                                p.title()));
    else
      shape.meter = read_meter(*sensor->object, &shape);
  }

  const auto given = p.take_only("bsdf", p.title(), "bsdf");
  material_ = given ? given->object : nullptr;
  if (given) {
    if (const auto index = bsdf(*given->object, *given->use)) shape.bsdf = *index;
    return;
  }
  // In Mitsuba 0.x a shape that bounds a medium and has no bsdf lets all light pass unchanged (NullBsdf).
  if (p.object().old && !emitter && shape.is_medium_transition) {
    shape.bsdf = added<BsdfIndex>(NullBsdf{});
    return;
  }
  // Mitsuba's default material: diffuse, and black for an emitter.
  const double grey = emitter ? 0 : .5;
  shape.bsdf = added<BsdfIndex>(DiffuseBsdf{add_constant_texture({grey, grey, grey})});
  if (shape.is_medium_transition && !p.object().old)
    report_.warning(p.object().at, fmt::format("{} bounds a medium but has no bsdf, so it is opaque: add "
                                               "<bsdf type=\"null\"/> to let light through",
                                               p.title()));
}

std::optional<AreaEmitter> Reader::read_area(const Element& e) {
  if (const PluginRow* row = plugin_row("emitter", e.get("type"));
      row && row->standing == Standing::refused) {
    unknown_plugin(e, report_);
    return std::nullopt;
  }
  if (e.get("type") != "area")
    return report_.refuse(
        value_place(e, "type"),
        fmt::format("a shape can only hold an emitter \"area\", not \"{}\"", e.get("type")));
  Params p(*this, e);
  AreaEmitter area;
  const bool has_beam = p.has("beam_width"), has_cutoff = p.has("cutoff_angle");
  if (p.has("falloff") && !has_beam && !has_cutoff)
    report_.error(e.at, "'falloff' of emitter \"area\" lies between beam_width and cutoff_angle: give them");
  bind(p, area);
  if (has_cutoff && !has_beam) area.beam_width = area.cutoff_angle * 3 / 4;
  p.finish();
  if (area.beam_width > area.cutoff_angle)
    report_.error(
        e.at, fmt::format("beam_width {} is wider than cutoff_angle {}", area.beam_width, area.cutoff_angle));
  // If beam_width has its default, the largest angle (90 degrees), cutoff_angle has it, too. Then falloff,
  // which acts between the two angles, has no effect, and its default is stored.
  if (area.beam_width == AreaEmitter{}.beam_width) area.falloff = AreaEmitter{}.falloff;
  return area;
}

namespace {

// True if the transformed cylinder is still circular: two directions perpendicular to its axis remain
// perpendicular, to each other and to the axis, and equally long (up to the rounding of composed transforms
// in single precision).
bool stays_cylinder(const CylinderShape& c, const Transform& t) {
  const auto dot = [](const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const auto cross = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto unit = [&](Vec3 v) {
    const double length = std::sqrt(dot(v, v));
    for (double& x : v) x /= length;
    return v;
  };
  Vec3 axis;
  for (std::size_t k = 0; k < 3; ++k) axis[k] = c.p1[k] - c.p0[k];
  axis = unit(axis);
  const Vec3 other = std::abs(axis[0]) < .7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = unit(cross(axis, other)), v = cross(axis, u);
  const Vec3 z = transform_vector(t, axis), x = transform_vector(t, u), y = transform_vector(t, v);
  const double length = std::sqrt(dot(x, x)), tolerance = 1e-5;
  return std::abs(std::sqrt(dot(y, y)) - length) <= tolerance * length &&
         std::abs(dot(x, y)) <= tolerance * length * length &&
         std::max(std::abs(dot(x, z)), std::abs(dot(y, z))) <= tolerance * length * std::sqrt(dot(z, z));
}

}  // namespace

// Checks that the shape is a PLY mesh if its textures read mesh attributes. Whether the file has these
// attributes is checked when the mesh is loaded.
void Reader::check_attributes(const Element& e, const Shape& shape) {
  const auto* mesh = std::get_if<MeshShape>(&shape.geometry);
  if (!reads_attributes_ || (mesh && mesh->format == MeshFormat::ply)) return;
  if (report_.has_errors()) return;  // after an error a material may be missing
  for (const AttributeUse& use : attribute_uses(scene_, shape))
    report_.error(
        e.at,
        fmt::format("this {} has no attribute \"{}\", which its {} reads: only a \"ply\" mesh has attributes",
                    e.get("type"), std::get<MeshAttributeTexture>(scene_.textures[use.texture.value]).name,
                    use.in_light ? "emitter" : "bsdf"));
}

bool Reader::check_placement(const Element& e, const Element& at, const Shape& shape) {
  const auto refuse = [&](std::string text) {
    report_.error(at.at, std::move(text));
    return false;
  };
  if (!invertible(shape.to_world))
    return refuse(fmt::format(
        "to_world flattens this {} or leaves the range of numbers: it can't be inverted", e.get("type")));
  if (std::holds_alternative<SphereShape>(shape.geometry) && !is_similarity(shape.to_world))
    return refuse(
        "to_world stretches this sphere: only turning, moving and scaling alike along all axes keeps it one");
  const auto* c = std::get_if<CylinderShape>(&shape.geometry);
  if (c && c->p0 == c->p1) return refuse("p0 and p1 of this cylinder are the same point");
  if (c && !stays_cylinder(*c, shape.to_world))
    return refuse(
        "to_world stretches this cylinder across its axis or shears it: only along the axis it may be "
        "scaled by itself");
  return true;
}

}  // namespace ls::scene
