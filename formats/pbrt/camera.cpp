// Translates the directives before WorldBegin: film, camera, filter, sampler, integrator.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

// The clip planes of the camera. pbrt has none: its camera sees everything from the pinhole to infinity.
constexpr double kNearest = 1e-4, kFarthest = 1e7;

class SettingsTranslator {
 public:
  SettingsTranslator(Translation& t, Settings& s, const Span& file) : t_(t), s_(s), file_(file) {}

  void run() {
    Element film = made("film", "hdrfilm", s_.film ? s_.film->at() : file_);
    if (s_.film)
      fill(film);
    else
      add_size(film, 1280, 720);
    add(film, filter());
    Element sensor = camera();
    add(sensor, sampler());
    add(sensor, std::move(film));
    add(t_.scene, integrator());
    add(t_.scene, std::move(sensor));
  }

 private:
  static void whole(Element& parent, std::string name, int x) {
    add(parent, "integer", std::move(name), fmt::format("{}", x), parent.at);
  }

  void add_size(Element& film, int width, int height) {
    width_ = width;
    height_ = height;
    whole(film, "width", width);
    whole(film, "height", height);
  }

  void fill(Element& film) {
    Params& p = *s_.film;
    if (const std::string_view type = p.row().type; type == "gbuffer" || type == "spectral")
      t_.report.warning(p.at(), fmt::format("{} gives the picture in red, green and blue: further layers are "
                                            "chosen by --aov",
                                            p.title()));
    add_size(film, p.integer("xresolution", 1280), p.integer("yresolution", 720));
    crop(film, p);
    if (const std::string sensor = p.text("sensor", "cie1931"); sensor != "cie1931")
      t_.report.warning(
          p.at(),
          fmt::format(
              "the sensor \"{}\" is not known here: colours are those that the CIE 1931 observer sees",
              sensor));
    p.finish();
  }

  void crop(Element& film, Params& p) {
    const Param* share = p.take("cropwindow");
    const Param* pixels = p.take("pixelbounds");
    const Param* given = pixels ? pixels : share;
    if (!given) return;
    if (given->numbers.size() != 4)
      return p.error(given->at, fmt::format("'{}' wants four numbers: x0 x1 y0 y1", given->name));
    std::array<double, 4> at{};
    for (std::size_t i = 0; i < 4; ++i)
      at[i] = pixels ? given->numbers[i] : std::ceil(given->numbers[i] * (i < 2 ? width_ : height_));
    if (std::any_of(at.begin(), at.end(), [](double x) { return !(x >= 0 && x <= 1e6); }) || at[0] >= at[1] ||
        at[2] >= at[3])
      return p.error(given->at, fmt::format("'{}' leaves no part of the frame", given->name));
    whole(film, "crop_offset_x", static_cast<int>(at[0]));
    whole(film, "crop_offset_y", static_cast<int>(at[2]));
    whole(film, "crop_width", static_cast<int>(at[1] - at[0]));
    whole(film, "crop_height", static_cast<int>(at[3] - at[2]));
  }

  Element filter() {
    if (!s_.filter) return made("rfilter", "gaussian", file_);
    Params& p = *s_.filter;
    const std::string_view type = p.row().type;
    const bool has_lobes = type == "mitchell" || type == "sinc";
    Element out = made("rfilter", type == "triangle" ? "tent" : has_lobes ? "gaussian" : type, p.at());
    if (has_lobes) {
      t_.report.warning(
          p.at(),
          fmt::format("{} is read as \"gaussian\", which blurs a little more: it has negative lobes, which "
                      "samples that each belong to one pixel can't follow",
                      p.title()));
    } else if (type == "gaussian") {
      add(out, "stddev", p.number("sigma", .5), p.at());
    } else {
      const double x = p.number("xradius", type == "box" ? .5 : 2), y = p.number("yradius", x);
      add(out, "radius", x, p.at());
      if (x != y) p.error(p.at(), fmt::format("{} has two radii: give one", p.title()));
    }
    p.finish();
    return out;
  }

  Element sampler() {
    Element out = made("sampler", "independent", s_.sampler ? s_.sampler->at() : file_);
    int count = 16;
    if (s_.sampler) {
      Params& p = *s_.sampler;
      if (p.row().type == "stratified") {
        const int x = p.integer("xsamples", 4), y = p.integer("ysamples", 4);
        if (x < 1 || y < 1 || x > 32768 || y > 32768)
          p.error(p.at(), fmt::format("{} wants 1 to 32768 samples each way", p.title()));
        else
          count = x * y;
      } else {
        count = p.integer("pixelsamples", 16);
      }
      p.finish();
    }
    whole(out, "sample_count", count);
    return out;
  }

  // pbrt's maxdepth counts scatterings, our max_depth the segments of a path.
  Element integrator() {
    if (!s_.integrator) {
      Element out = made("integrator", "volpath", file_);
      whole(out, "max_depth", 6);
      return out;
    }
    Params& p = *s_.integrator;
    const std::string_view type = p.row().type;
    if (type != "path" && type != "volpath")
      t_.report.warning(
          p.at(),
          fmt::format("{} is read as \"volpath\", which gives the same picture by other means{}", p.title(),
                      type == "sppm" ? ", but sppm applies its maxdepth to the paths from the light and from "
                                       "the camera separately"
                                     : ""));
    Element out = made("integrator", type == "path" ? "path" : "volpath", p.at());
    const int depth = p.integer("maxdepth", 5);
    if (depth < 0 || depth > 1'000'000)
      p.error(p.at(), fmt::format("{} has a maxdepth of {}: 0 to 1000000 are read", p.title(), depth));
    else
      whole(out, "max_depth", depth + 1);
    p.finish();
    return out;
  }

  Element camera() {
    if (!s_.camera) {
      t_.report.error(file_, "the scene has no Camera: nothing to see it with");
      return made("sensor", "perspective", file_);
    }
    Params& p = *s_.camera;
    const std::string_view type = p.row().type;
    Element out = type == "spherical"      ? spherical(p)
                  : type == "orthographic" ? orthographic(p)
                                           : perspective(p);
    if (type != "spherical") {
      add(out, "near_clip", kNearest, p.at());
      add(out, "far_clip", kFarthest, p.at());
    }
    if (!s_.camera_medium.empty()) refer(out, "medium", medium_id(s_.camera_medium), p.at());
    p.finish();
    return out;
  }

  // The part of the plane one unit ahead of the camera that the frame shows: its middle, and half of its
  // width and of its height, negative if it is mirrored. x points right, y up. The plane of a perspective
  // camera is measured in multiples of tan(fov / 2).
  struct Window {
    double x = 0, y = 0, half_width = 1, half_height = 1;
  };

  double frame_aspect() const { return static_cast<double>(width_) / std::max(1, height_); }

  // Returns the window that `screenwindow` or `frameaspectratio` gives. nullopt: neither is given, or it is
  // wrong, which was reported. Then the shorter side of the frame shows [-1, 1].
  std::optional<Window> window(Params& p) {
    const Param* sides = p.take("screenwindow");
    const bool has_aspect = p.has("frameaspectratio");
    const double aspect = p.number("frameaspectratio", 1);
    if (!sides && !has_aspect) return std::nullopt;
    if (!sides && !(aspect > 0))
      return p.refuse(p.at(), fmt::format("{} wants a frameaspectratio above 0", p.title()));
    if (!sides && aspect == frame_aspect()) return std::nullopt;
    if (!sides) return Window{0, 0, std::max(1., aspect), std::max(1., 1 / aspect)};
    const auto& n = sides->numbers;
    if (n.size() != 4 || n[0] == n[1] || n[2] == n[3])
      return p.refuse(sides->at, fmt::format("'screenwindow' of {} wants four numbers: x0 x1 y0 y1, with x0 "
                                             "other than x1 and y0 other than y1",
                                             p.title()));
    return Window{(n[0] + n[1]) / 2, (n[2] + n[3]) / 2, (n[1] - n[0]) / 2, (n[3] - n[2]) / 2};
  }

  // Mirrors the camera: pbrt's has +x on the right, ours on the left.
  static Transform facing(const Transform& world) { return multiply(world, scaled(Vec3{{-1, 1, 1}}).to); }

  // Places a camera. place_of(m): its to_world, where m is the matrix from camera to world. It is an
  // <animation> if the camera moves.
  template <class F>
  void place_camera(Element& out, Params& p, F place_of) {
    const Transform start = place_of(s_.camera_ctm.from);
    const bool stands = s_.camera_end_ctm.to == s_.camera_ctm.to;
    if (!stands || t_.moves) {
      add(out, "shutter_open", p.number("shutteropen", 0), p.at());
      add(out, "shutter_close", p.number("shutterclose", 1), p.at());
    }
    if (stands) return place(out, start, p.at());
    animate(out, {s_.start_time, start}, {s_.end_time, place_of(s_.camera_end_ctm.from)}, p.at());
    if (const double end = without_scale(s_.camera_end_ctm.from).scale;
        std::abs(end / without_scale(s_.camera_ctm.from).scale - 1) > 1e-6 && p.has("lensradius"))
      t_.warn_once(
          p.at(),
          "the scale of this camera changes while the shutter is open: its lens keeps the size and the "
          "focus of the beginning");
  }

  Element orthographic(Params& p) {
    Element out = made("sensor", "orthographic", p.at());
    // Our frame is 2 wide before to_world, and has the shape of the film.
    const double wider = std::max(1., frame_aspect());
    Placed shown = scaled(Vec3{{wider, wider, 1}});
    if (const auto w = window(p))
      shown = then(moved(Vec3{{-w->x, w->y, 0}}),
                   scaled(Vec3{{w->half_width, w->half_height * frame_aspect(), 1}}));
    place_camera(out, p, [&](const Transform& world) { return multiply(facing(world), shown.to); });
    return out;
  }

  // In pbrt the azimuth begins at +x and goes on to +z, here it begins at -z and goes on to +x.
  Element spherical(Params& p) {
    if (const std::string mapping = p.text("mapping", "equalarea"); mapping != "equirectangular")
      p.error(p.at(), fmt::format("{} has the mapping \"{}\": only equirectangular is supported", p.title(),
                                  mapping));
    window(p);  // it does not change what this camera sees
    Element out = made("sensor", "spherical", p.at());
    const Transform axes{{0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1}};
    place_camera(out, p, [&](const Transform& world) { return multiply(without_scale(world).rigid, axes); });
    return out;
  }

  // Adds the field of view and the principal point of a perspective camera.
  void look_through(Element& out, Params& p, const Window& w, double fov) {
    // Here pixels are square. Files give the numbers of a window with few digits: four significant ones are
    // off by up to 5e-4 each, so that the shape of the window is known to 1e-3.
    constexpr double kRounding = 1e-3;
    const double shape = std::abs(w.half_width / w.half_height);
    if (std::abs(shape / frame_aspect() - 1) > kRounding)
      p.error(p.at(),
              fmt::format("{} shows a window of the shape {:.6g} : 1 on a film of {:.6g} : 1, so that "
                          "its pixels are not square, which is not known here: give the film that "
                          "shape, or leave screenwindow and frameaspectratio out",
                          p.title(), shape, frame_aspect()));
    constexpr double kDegree = std::numbers::pi / 180;
    const double edge = std::tan(fov / 2 * kDegree) * std::abs(w.half_width);
    add(out, "fov", 2 * std::atan(edge) / kDegree, p.at());
    add(out, "string", "fov_axis", "x", p.at());
    if (w.x != 0) add(out, "principal_point_offset_x", w.x / (2 * w.half_width), p.at());
    if (w.y != 0) add(out, "principal_point_offset_y", -w.y / (2 * w.half_height), p.at());
  }

  Element perspective(Params& p) {
    const double radius = p.number("lensradius", 0);
    Element out = made("sensor", radius > 0 ? "thinlens" : "perspective", p.at());
    const double fov = p.has("halffov") ? 2 * p.number("halffov", 45) : p.number("fov", 90);
    const auto shown = window(p);
    if (shown) {
      look_through(out, p, *shown, fov);
    } else {
      add(out, "fov", fov, p.at());
      add(out, "string", "fov_axis", "smaller", p.at());
    }
    // Here a perspective camera must have no scale. A uniform scale changes only the sizes of the lens radius
    // and the focus distance in the world, so these two are multiplied by it instead.
    const double scale = without_scale(s_.camera_ctm.from).scale;
    const double focus = p.number("focaldistance", 1e6);
    if (radius > 0) {
      add(out, "aperture_radius", radius * scale, p.at());
      add(out, "focus_distance", focus * scale, p.at());
    }
    const double mirror_x = shown ? std::copysign(1, shown->half_width) : 1,
                 mirror_y = shown ? std::copysign(1, shown->half_height) : 1;
    place_camera(out, p, [&](const Transform& of_world) {
      return multiply(facing(without_scale(of_world).rigid), scaled(Vec3{{mirror_x, mirror_y, 1}}).to);
    });
    return out;
  }

  Translation& t_;
  Settings& s_;
  const Span& file_;
  int width_ = 1280, height_ = 720;
};

}  // namespace

void animate(Element& out, const std::pair<double, const Transform&>& start,
             const std::pair<double, const Transform&>& end, const Span& at) {
  Element animation = made("animation", "", at);
  set(animation, "name", "to_world", at);
  for (const auto& [time, to_world] : {start, end}) {
    Element key = made("transform", "", at);
    set(key, "time", fmt::format("{}", time), at);
    add(key, matrix_step(to_world.m, at));
    add(animation, std::move(key));
  }
  add(out, std::move(animation));
}

double exposure_of(Settings& s) {
  double factor = 1;
  if (s.film) factor = s.film->number("exposuretime", 1) * s.film->number("iso", 100) / 100;
  if (!s.camera) return factor;
  const double opens = s.camera->number("shutteropen", 0), closes = s.camera->number("shutterclose", 1);
  if (!(opens < closes))
    s.camera->error(
        s.camera->at(),
        fmt::format("the shutter closes at {} and opens at {}: let it close later", closes, opens));
  return factor * (closes - opens);
}

void add_settings(Translation& t, Settings& s, const Span& file) { SettingsTranslator(t, s, file).run(); }

}  // namespace ls::scene::pbrt
