// Reads emitters without a shape.
#include <fmt/format.h>

#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"

namespace ls::scene {
namespace {

// Adds the ids to which references in the element refer.
void note_references(const Element& e, std::unordered_set<std::string_view>& ids) {
  if (e.tag == "ref") ids.insert(e.get("id"));
  for (const Element& child : e.children) note_references(child, ids);
}

}  // namespace

// Reads an emitter whose parameters are all listed by describe() (core/scene/schema). Kinds of emitters
// that need more have specialisations below.
template <class Kind>
void Reader::read_emitter_as(const Element& e) {
  if constexpr (std::is_same_v<Kind, ConstantEmitter>) check_only_environment(e);
  Params p(*this, e);
  Kind emitter;
  bind(p, emitter);
  p.finish();
  scene_.emitters.emplace_back(emitter);
}

void Reader::check_only_environment(const Element& e) {
  for (const Emitter& other : scene_.emitters)
    if (std::holds_alternative<ConstantEmitter>(other) || std::holds_alternative<EnvmapEmitter>(other))
      report_.error(e.at, "a second environment: a scene has one emitter \"constant\" or \"envmap\" at most");
}

template <>
void Reader::read_emitter_as<EnvmapEmitter>(const Element& e) {
  Params p(*this, e);
  EnvmapEmitter emitter;
  bind(p, emitter);
  p.finish();
  check_only_environment(e);
  if (!invertible(emitter.to_world) || !is_similarity(emitter.to_world))
    report_.error(e.at, "to_world of an environment map may turn and mirror it, not stretch or flatten it");
  scene_.emitters.emplace_back(emitter);
}

template <>
void Reader::read_emitter_as<DirectionalEmitter>(const Element& e) {
  Params p(*this, e);
  DirectionalEmitter emitter;
  if (p.has("direction") && p.has("to_world"))
    report_.error(e.at, "emitter \"directional\" gives both direction and to_world");
  bind(p, emitter);
  if (const auto t = p.take_transform("to_world")) emitter.direction = transform_vector(*t, {0, 0, 1});
  p.finish();
  if (emitter.direction == Vec3{0, 0, 0}) report_.error(e.at, "the direction of this light is zero");
  scene_.emitters.emplace_back(emitter);
}

template <>
void Reader::read_emitter_as<PointEmitter>(const Element& e) {
  Params p(*this, e);
  PointEmitter emitter;
  if (p.has("position") && p.has("to_world"))
    report_.error(e.at, "emitter \"point\" gives both position and to_world");
  bind(p, emitter);
  if (const auto t = p.take_transform("to_world")) emitter.position = transform_point(*t, {0, 0, 0});
  p.finish();
  scene_.emitters.emplace_back(emitter);
}

template <>
void Reader::read_emitter_as<ProjectorEmitter>(const Element& e) {
  Params p(*this, e);
  ProjectorEmitter emitter;
  Sensor lens;  // a projector has the field-of-view parameters of a camera
  read_fov(p, lens);
  emitter.fov = lens.fov;
  emitter.fov_axis = lens.fov_axis;
  if (!p.has("irradiance")) report_.error(e.at, "emitter \"projector\" needs 'irradiance': what it projects");
  bind(p, emitter);
  refuse_attributes(e, emitter.irradiance, "irradiance");
  p.finish();
  if (!is_rigid(emitter.to_world))
    report_.error(e.at,
                  "to_world of a projector may only move, turn and mirror: this one scales or shears; leave "
                  "its <scale> out and give `scale` for brightness and `fov` for the image's size");
  scene_.emitters.emplace_back(emitter);
}

template <>
void Reader::read_emitter_as<SpotEmitter>(const Element& e) {
  Params p(*this, e);
  SpotEmitter emitter;
  const bool has_beam = p.has("beam_width");
  bind(p, emitter);
  if (!has_beam) emitter.beam_width = emitter.cutoff_angle * 3 / 4;
  p.finish();
  if (emitter.beam_width > emitter.cutoff_angle)
    report_.error(e.at, fmt::format("beam_width {} is wider than cutoff_angle {}", emitter.beam_width,
                                    emitter.cutoff_angle));
  if (emitter.texture) refuse_attributes(e, *emitter.texture, "texture");
  if (emitter.texture && std::holds_alternative<ConstantTexture>(scene_.textures[emitter.texture->value]))
    report_.error(e.at,
                  "'texture' of emitter \"spot\" wants an image; a single colour belongs into 'intensity'");
  if (!invertible(emitter.to_world))
    report_.error(e.at, "to_world flattens this light or leaves the range of numbers: it can't be inverted");
  scene_.emitters.emplace_back(emitter);
}

template <>
void Reader::read_emitter_as<GoniometricEmitter>(const Element& e) {
  Params p(*this, e);
  GoniometricEmitter emitter;
  const bool from_file = p.has("filename"), from_texture = p.has("texture");
  if (from_file == from_texture)
    report_.error(e.at, from_file
                            ? "emitter \"goniometric\" has both 'filename' and 'texture': leave one out"
                            : "emitter \"goniometric\" needs 'filename', an IES file or an image of its "
                              "directions, or 'texture', such an image");
  bind(p, emitter);
  if (const auto name = p.take_string("filename"))
    // `clamp`, since what lies across an edge of the square is not on the other side of the sphere
    if (const auto file = asset(*name, e.at))
      emitter.texture = added<TextureIndex>(BitmapTexture{.file = *file, .wrap = Wrap::clamp, .raw = true});
  refuse_attributes(e, emitter.texture, "texture");
  p.finish();
  if (!invertible(emitter.to_world) || !is_similarity(emitter.to_world))
    report_.error(e.at,
                  "to_world of a goniometric light may move, turn and mirror it, not stretch or flatten it");
  scene_.emitters.emplace_back(emitter);
}

void Reader::read_emitter(const Element& e) {
  const std::string_view type = e.get("type");
  if (type == "area") {
    // As any other object it may stand elsewhere than where it is used.
    if (!referred_) note_references(document_.root, referred_.emplace());
    if (e.find("id") && referred_->contains(e.get("id"))) return;
    return report_.error(e.at, "an emitter \"area\" stands in the shape that shines");
  }
  if (!with_kind_named<Emitter>(type, [&]<class Kind>() { read_emitter_as<Kind>(e); }))
    unknown_plugin(e, report_);
}

}  // namespace ls::scene
