// Reads sensors, films, filters, samplers and integrators.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "core/scene/motion.h"
#include "core/scene/schema/integrators.h"
#include "formats/reader/mitsuba_plugins.h"
#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene {
namespace {

// True if the keys are not all of one transform.
bool changes(std::span<const MotionKey> keys) {
  return std::ranges::any_of(keys, [&](const MotionKey& k) { return k.to_world != keys.front().to_world; });
}

}  // namespace

void Reader::read_sensor(const Element& e) {
  if (!is_read_plugin("sensor", e.get("type"))) return unknown_plugin(e, report_);
  if (e.get("type") == "batch") return read_batch(e);
  if (e.get("type").ends_with("meter")) return void(read_meter(e, nullptr));
  if (sensor_)
    return report_.warning(
        e.at, fmt::format("a second sensor; the first ({}) is used", report_.refer_to(sensor_->at, e.at)));
  sensor_ = &e;
  Params p(*this, e);
  Sensor& s = scene_.sensor;
  read_projection(e, p, s);
  read_sensor_medium(p, s.medium);
  const auto film = p.take_only("film", "this sensor", "film");
  const auto sampler = p.take_only("sampler", "this sensor", "sampler");
  if (film) read_film(*film->object);
  if (sampler) read_sampler(*sampler->object);
  p.finish();
}

// Reads the parameters that depend on the type of the camera.
void Reader::read_projection(const Element& e, Params& p, Sensor& s) {
  Binder binder(p);
  const Element* animation = p.take_animation("to_world");
  if (e.get("type") == "spherical") {
    s.projection = Projection::spherical;
    describe_place(binder, s);
  } else if (e.get("type") == "orthographic") {
    s.projection = Projection::orthographic;
    describe_clips(binder, s);
  } else {
    const bool has_focus = p.has("focus_distance"), has_aperture = p.has("aperture_radius");
    read_fov(p, s);
    describe_perspective(binder, s);
    if (e.get("type") == "thinlens") {
      describe_lens(binder, s);
      if (s.aperture_scale) refuse_attributes(e, *s.aperture_scale, "aperture_scale");
      if (!has_aperture) report_.error(e.at, "sensor \"thinlens\" needs 'aperture_radius'");
      if (!has_focus) s.focus_distance = s.far_clip;
    }
  }
  if (s.near_clip >= s.far_clip) report_.error(e.at, "near_clip is not nearer than far_clip");
  shutter_open_ = s.shutter_open;
  shutter_close_ = s.shutter_close;
  if (animation)
    read_motion(*animation, s);
  else
    check_place(e, s.to_world, s.projection);
}

// Reports a transform of a camera of this kind that is not allowed. Returns whether it is.
bool Reader::check_place(const Element& e, const Transform& to_world, Projection projection) {
  if (projection == Projection::orthographic) {
    if (invertible(to_world)) return true;
    report_.error(e.at, "to_world flattens this camera or leaves the range of numbers: it can't be inverted");
  } else {
    if (is_rigid(to_world)) return true;
    report_.error(e.at,
                  "to_world of a sensor may only move, turn and mirror: this one scales or shears, which "
                  "Mitsuba 3 refuses, too; leave its <scale> out");
  }
  return false;
}

std::vector<MotionKey> Reader::read_keys(const Element& animation,
                                         const std::function<bool(const Element&, const Transform&)>& fits) {
  std::vector<MotionKey> keys;
  for (const Element& e : animation.children) {
    const auto time = parse_number(e.get("time"));
    if (!time || !(std::abs(*time) <= kMaxTime)) {
      report_.error(
          value_place(e, "time"),
          fmt::format("'time' wants a number of at most {:g} in size, not \"{}\"", kMaxTime, e.get("time")));
      continue;
    }
    if (!keys.empty() && !(*time > keys.back().time))
      report_.error(
          value_place(e, "time"),
          fmt::format("the times of an <animation> must ascend: {} comes after {}", *time, keys.back().time));
    const Transform to_world = read_transform(e, report_);
    if (!fits(e, to_world)) continue;
    if (!can_move(to_world)) {
      report_.error(e.at, "this transform shears: an <animation> can only move, turn, mirror and scale");
      continue;
    }
    if (!keys.empty() && (determinant3(to_world) < 0) != (determinant3(keys.front().to_world) < 0))
      report_.error(
          e.at,
          "this transform mirrors and the first one does not, or the other way round: between them what "
          "moves would be flat");
    keys.push_back({*time, to_world});
    if (keys.size() > kMaxMotionKeys) {
      report_.error(e.at, fmt::format("an <animation> of more than {} transforms", kMaxMotionKeys));
      break;
    }
  }
  if (keys.empty() && !report_.has_errors())
    report_.error(animation.at, "an <animation> needs a <transform time=\"...\"> for each of its times");
  return keys;
}

void Reader::read_motion(const Element& animation, Sensor& s) {
  const Motion motion(read_keys(animation, [&](const Element& at, const Transform& to_world) {
    return check_place(at, to_world, s.projection);
  }));
  check_shutter(changes(motion.keys()) ? &animation : nullptr, "the camera stands");
  if (!report_.has_errors()) place_in_exposure(animation, motion, s);
}

void Reader::check_shutter(const Element* animation, std::string_view what) {
  if (shutter_close_ < shutter_open_)
    report_.error(sensor_->at, fmt::format("the shutter closes at {} and opens at {}: let it close later",
                                           shutter_close_, shutter_open_));
  else if (animation && shutter_open_ == shutter_close_ && !report_.has_errors())
    report_.warning(animation->at,
                    fmt::format("{} where it is at {}, since the shutter opens and closes then: give "
                                "shutter_open and shutter_close",
                                what, shutter_open_));
}

template <class T>
void Reader::place_in_exposure(const Element& animation, const Motion& motion, T& object) {
  object.motion = motion_during(motion, shutter_open_, shutter_close_);
  if (object.motion.size() > kMaxMotionKeys)
    return report_.error(animation.at,
                         fmt::format("more than {} transforms are within the exposure", kMaxMotionKeys));
  object.to_world = object.motion.empty() ? motion.at(shutter_open_) : Motion(object.motion).at(.5);
}

void Reader::note_motion(const Element& animation, bool instance, std::vector<MotionKey> keys) {
  const std::size_t count = instance ? scene_.instances.size() : scene_.shapes.size();
  if (!keys.empty()) motions_.push_back({&animation, instance, count - 1, std::move(keys)});
}

// A sensor may follow the shapes that it sees, so these get their places when everything has been read.
void Reader::finish_motions() {
  if (report_.has_errors()) return;
  const auto moving = std::ranges::find_if(motions_, [](const Moving& m) { return changes(m.keys); });
  if (moving != motions_.end()) check_shutter(moving->animation, "what moves stands");
  if (report_.has_errors()) return;
  for (const Moving& m : motions_) {
    if (m.instance)
      place_in_exposure(*m.animation, Motion(m.keys), scene_.instances[m.index]);
    else
      place_in_exposure(*m.animation, Motion(m.keys), scene_.shapes[m.index]);
  }
  motions_.clear();
  scene_.sensor.shutter_open = 0;
  scene_.sensor.shutter_close = moves(scene_) ? 1 : 0;
}

// Reads the sensor's medium. The name of this parameter is "medium" or absent; any other name is an error,
// since "interior" and "exterior" are names for the media of shapes.
void Reader::read_sensor_medium(Params& p, std::optional<MediumIndex>& medium_of_sensor) {
  const Element* use = p.take("medium");
  if (const Element* object = use ? resolve(*use) : nullptr) medium_of_sensor = medium(*object, *use);
  for (const auto& nameless : p.take_nested("medium", Params::Names::none)) {
    if (use) return report_.error(nameless.use->at, "this sensor has a second medium");
    use = nameless.use;
    medium_of_sensor = medium(*nameless.object, *use);
  }
}

// Sets the field of view if the file has no `fov`. It is the angle that the diagonal of 35 mm film, which has
// 36 mm x 24 mm, covers at the focal length `focal_length`, by default 50 mm.
void Reader::read_fov(Params& p, Sensor& s) {
  const bool has_fov = p.has("fov");
  const Element* given = p.take("focal_length");
  if (has_fov && given)
    return report_.error(given->at, fmt::format("{} gives both fov and focal_length", p.title()));
  if (has_fov) return;
  double length = 50;
  if (given) {
    std::string_view text = given->get("value");
    if (text.ends_with("mm")) text.remove_suffix(2);
    const auto number = given->tag == "string" ? parse_number(text) : std::nullopt;
    if (!number || *number <= 0)
      return report_.error(value_place(*given, "value"), "'focal_length' wants a <string> such as \"50mm\"");
    length = *number;
  }
  s.fov = 2 * std::atan(std::sqrt(36.0 * 36 + 24.0 * 24) / (2 * length)) * (180 / std::numbers::pi);
  s.fov_axis = FovAxis::diagonal;
  // As in Mitsuba, fov_axis is only used with `fov`.
  if (const Element* axis = p.take("fov_axis"))
    report_.warning(
        value_place(*axis, "name"),
        fmt::format("'fov_axis' of {} has no effect here: it says what fov measures, and there is no fov",
                    p.title()));
}

void Reader::read_film(const Element& e) {
  used_parts_.insert(&e);
  if (!is_read_plugin("film", e.get("type"))) return unknown_plugin(e, report_);
  Params p(*this, e);
  FilmSettings& film = scene_.film;
  if (e.get("type") == "mfilm") film = {{1, 1}, BoxFilter{}};  // the defaults of Mitsuba 0.x
  if (e.get("type") != "hdrfilm")
    report_.warning(value_place(e, "type"), fmt::format("{} gives the size of the frame and its filter: what "
                                                        "is written are linear colours, as of \"hdrfilm\"",
                                                        p.title()));
  const bool has_width = p.has("crop_width"), has_height = p.has("crop_height");
  bind(p, film);
  check_crop(e, p, has_width, has_height);
  if (std::int64_t{film.size.width} * film.size.height > kMaxFramePixels)
    report_.error(e.at, fmt::format("a frame of {} x {} is larger than {} pixels", film.size.width,
                                    film.size.height, kMaxFramePixels));
  if (const auto filter = p.take_only("rfilter", "this film", "filter"))
    film.filter = read_filter(*filter->object);
  p.finish();
}

// Checks the crop. If its width or height is missing, the frame's is used. A crop of the whole frame is
// stored as no crop, so that the scene equals the one without a crop.
void Reader::check_crop(const Element& e, Params& p, bool has_width, bool has_height) {
  FilmSettings& f = scene_.film;
  if (!has_width) f.crop_size.width = f.size.width;
  if (!has_height) f.crop_size.height = f.size.height;
  const auto outside = [](int offset, int width, int whole) {
    return width < 1 || offset > whole || width > whole - offset;
  };
  if (outside(f.crop_offset[0], f.crop_size.width, f.size.width) ||
      outside(f.crop_offset[1], f.crop_size.height, f.size.height))
    report_.error(e.at, fmt::format("the crop of {} at ({}, {}) with {} x {} pixels is not within its frame "
                                    "of {} x {}: give crop_width and crop_height so that it is",
                                    p.title(), f.crop_offset[0], f.crop_offset[1], f.crop_size.width,
                                    f.crop_size.height, f.size.width, f.size.height));
  if (f.crop_size == f.size) f.crop_size = {0, 0};
}

ReconstructionFilter Reader::read_filter(const Element& e) {
  used_parts_.insert(&e);
  ReconstructionFilter filter = GaussianFilter{};
  const auto read = [&]<class Kind>() {
    Params p(*this, e);
    Kind kind;
    bind(p, kind);
    p.finish();
    filter = kind;
  };
  if (with_kind_named<ReconstructionFilter>(e.get("type"), read)) return filter;
  if (!is_read_plugin("rfilter", e.get("type"))) return unknown_plugin(e, report_), filter;
  // A filter with negative lobes. Each sample belongs to one pixel, so it cannot have a weight below 0 in
  // others.
  Params p(*this, e);
  report_.warning(value_place(e, "type"),
                  fmt::format("{} is read as \"gaussian\", which blurs a little more: it has negative lobes, "
                              "which samples that each belong to one pixel can't follow",
                              p.title()));
  p.finish();
  return filter;
}

// Reads only the number of samples. The renderer uses its own sampler, whatever type the file gives.
void Reader::read_sampler(const Element& e) {
  used_parts_.insert(&e);
  if (!is_read_plugin("sampler", e.get("type"))) return unknown_plugin(e, report_);
  Params p(*this, e);
  if (e.get("type") != "independent")
    report_.warning(
        value_place(e, "type"),
        fmt::format("of {} only the number of samples is used: which they are is this program's own matter",
                    p.title()));
  p.read({.name = "sample_count", .doc = "", .range = {1, kMaxSpp}}, scene_.sample_count);
  p.finish();
}

namespace {

// Rejects parameters that other integrators have but `integrator` does not.
struct OthersParameters {
  Params& params;
  Report& report;
  std::string_view integrator;
  template <class T>
  void field(const Field& f, const T&) {
    if (f.belongs_to(integrator)) return;
    if (const Element* e = params.take(f.name))
      report.error(e->at,
                   fmt::format("'{}' is a parameter of {} alone, not of {}", f.name,
                               f.only_of[1].empty() ? fmt::format("the integrator \"{}\"", f.only_of[0])
                                                    : fmt::format("the integrators \"{}\" and \"{}\"",
                                                                  f.only_of[0], f.only_of[1]),
                               params.title()));
  }
};

}  // namespace

void Reader::read_integrator(const Element& e, int depth) {
  if (depth == 0 && integrator_)
    return report_.error(e.at, fmt::format("a second integrator; the first is in {}",
                                           report_.refer_to(integrator_->at, e.at)));
  if (depth == 0) integrator_ = &e;
  if (depth > 4) return report_.error(e.at, "integrators are nested too deep, or contain themselves");
  const std::string_view type = e.get("type");
  Params p(*this, e);
  if (const WrapperRow* wrapper = wrapper_row(type)) {
    read_channels(p);
    const auto inner = p.take_nested("integrator");
    if (inner.size() != 1)
      report_.error(e.at, fmt::format("{} needs one nested integrator, not {}", p.title(), inner.size()));
    if (type != "aov" || scene_.aovs.empty())
      report_.warning(value_place(e, "type"),
                      fmt::format("only the integrator within {} is used: {}", p.title(), wrapper->lost));
    if (!inner.empty()) read_integrator(*inner[0].object, depth + 1);
    return p.finish();
  }
  IntegratorSettings& i = scene_.integrator;
  const IntegratorRow* row = integrator_row(type);
  if (!row) return unknown_plugin(e, report_);
  if (row->other_method)
    report_.warning(value_place(e, "type"),
                    fmt::format("{} is read as \"{}\", which gives the same picture by other means",
                                p.title(), row->ours));
  i.name = row->ours;
  OthersParameters others{p, report_, i.name};
  describe(others, i);
  i.max_depth = row->default_depth;
  bind(p, i);
  if (row->max_depth) i.max_depth = *row->max_depth;
  p.finish();
}

}  // namespace ls::scene
