// Shapes, with what stands in them: bsdf, area emitter, media.
#include <fmt/format.h>

#include "common/scene/plugin_error.h"
#include "common/scene/reader.h"
#include "common/scene/transform.h"

namespace ls::scene {

void Reader::read_shape(const Element& e) {
  const std::string_view type = e.get("type");
  if (type == "rectangle") return read_geometry(e, RectangleShape{});
  if (type == "cube") return read_geometry(e, CubeShape{});
  if (type == "sphere") return read_geometry(e, SphereShape{});
  if (type == "disk") return read_geometry(e, DiskShape{});
  if (type == "obj") return read_geometry(e, MeshShape{.format = MeshFormat::obj, .flip_tex_coords = true});
  if (type == "ply") return read_geometry(e, MeshShape{.format = MeshFormat::ply});
  unknown_plugin(e, report_);
}

template <class T>
void Reader::read_geometry(const Element& e, T geometry) {
  Params p(*this, e);
  bind(p, geometry);
  Shape shape;
  bind(p, shape);
  shape.geometry = geometry;
  read_shape_parts(p, shape);
  p.finish();
  check_placement(e, shape);
  scene_.shapes.push_back(std::move(shape));
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

  const auto emitters = p.take_nested("emitter");
  if (emitters.size() > 1)
    report_.error(emitters[1].use->at, fmt::format("{} has a second emitter", p.title()));
  if (!emitters.empty()) shape.emitter = read_area(*emitters[0].object);

  const auto bsdfs = p.take_nested("bsdf");
  if (bsdfs.size() > 1) report_.error(bsdfs[1].use->at, fmt::format("{} has a second bsdf", p.title()));
  if (!bsdfs.empty()) {
    if (const auto index = bsdf(*bsdfs[0].object, *bsdfs[0].use)) shape.bsdf = *index;
    return;
  }
  // 0.x: what only bounds a medium lets light through.
  if (p.object().old && emitters.empty() && shape.is_medium_transition) {
    scene_.bsdfs.emplace_back(NullBsdf{});
    shape.bsdf = {static_cast<std::uint32_t>(scene_.bsdfs.size() - 1)};
    return;
  }
  // Mitsuba: diffuse; black under an emitter.
  const double grey = emitters.empty() ? .5 : 0;
  scene_.bsdfs.emplace_back(DiffuseBsdf{add_constant_texture({grey, grey, grey})});
  shape.bsdf = {static_cast<std::uint32_t>(scene_.bsdfs.size() - 1)};
  if (shape.is_medium_transition && !p.object().old)
    report_.warning(p.object().at, fmt::format("{} bounds a medium but has no bsdf, so it is opaque: add "
                                               "<bsdf type=\"null\"/> to let light through",
                                               p.title()));
}

std::optional<AreaEmitter> Reader::read_area(const Element& e) {
  if (e.get("type") != "area") {
    report_.error(value_place(e, "type"),
                  fmt::format("a shape can only hold an emitter \"area\", not \"{}\"", e.get("type")));
    return std::nullopt;
  }
  Params p(*this, e);
  AreaEmitter area;
  bind(p, area);
  p.finish();
  return area;
}

void Reader::check_placement(const Element& e, const Shape& shape) {
  if (!invertible(shape.to_world))
    report_.error(
        e.at, fmt::format("to_world flattens this {} or leaves the range of numbers: it can't be inverted",
                          e.get("type")));
  else if (std::holds_alternative<SphereShape>(shape.geometry) && !is_similarity(shape.to_world))
    report_.error(
        e.at,
        "to_world stretches this sphere: only turning, moving and scaling alike along all axes keeps it one");
}

}  // namespace ls::scene
