// Translates the camera of a glTF file, and adds a film and an integrator, which glTF does not have.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/text/suggest.h"
#include "formats/gltf/translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

// Size of the image in pixels, which glTF does not specify. A camera with an aspect ratio changes the width.
constexpr int kHeight = 720, kWidth = 1280;
constexpr int kSamples = 64;
constexpr double kFarthest = 1e7;  // distance of the far clip plane of a camera without zfar
// A scene without cameras gets one that shows the whole bounding sphere of its meshes. kFrom is the direction
// from the centre of the sphere to this camera: in front (+z), to the right (+x) and above (+y).
constexpr Vec3 kFrom{{{.5, .35, 1}}};
constexpr double kFov = 40;  // field of view of this camera in degrees, along the shorter side of the image
// Distance of this camera from the centre, relative to the distance at which the sphere just fits the image.
constexpr double kMargin = 1.05;

std::string name_of(const Translation& t, const Standing& camera) {
  const std::string own = camera.node["camera"].in(t.root["cameras"])["name"].text("");
  return own.empty() ? camera.node["name"].text("") : own;
}

class CameraTranslator {
 public:
  explicit CameraTranslator(Translation& t) : t_(t) {}

  Element placed(const Standing& standing) {
    const Item camera = standing.node["camera"].in(t_.root["cameras"]);
    const Span at = camera.at();
    const auto to_world = facing(standing.to_world);
    if (!to_world) standing.node.error("the transform of this camera leaves it no direction");
    const std::string type = camera["type"].text("");
    if (type == "orthographic")
      return orthographic(camera["orthographic"], to_world.value_or(Transform{}), at);
    if (type != "perspective") camera["type"].error("a camera is \"perspective\" or \"orthographic\"");
    const Item lens = camera["perspective"];
    const double fov = lens["yfov"].number(0);
    if (!(fov > 0 && fov < std::numbers::pi)) lens.error("yfov is wanted, above 0 and below pi");
    set_aspect(lens["aspectRatio"]);
    Element out = made("sensor", "perspective", at);
    add(out, "fov", fov * kDegrees, at);
    add(out, "string", "fov_axis", "y", at);
    clip(out, lens, 1e-4);
    place(out, to_world.value_or(Transform{}), at);
    return out;
  }

  Element framing(const Box& box) {
    const Span at = t_.root.at();
    Vec3 middle{{0, 0, 0}};
    double radius = 0;
    for (std::size_t i = 0; i < 3 && !box.is_empty(); ++i) {
      middle[i] = (box.low[i] + box.high[i]) / 2;
      radius += std::pow((box.high[i] - box.low[i]) / 2, 2);
    }
    radius = std::max(std::sqrt(radius), 1e-6);
    const double distance = kMargin * radius / std::sin(kFov / 2 / kDegrees);
    const double length = std::sqrt(dot(kFrom, kFrom));
    Vec3 eye;
    for (std::size_t i = 0; i < 3; ++i) eye[i] = middle[i] + kFrom[i] / length * distance;
    Element out = made("sensor", "perspective", at);
    add(out, "fov", kFov, at);
    add(out, "string", "fov_axis", "smaller", at);
    add(out, "near_clip", distance / 1e4, at);
    add(out, "far_clip", std::max(4 * distance, 1.), at);
    place(out, looking(eye, middle), at);
    return out;
  }

  void finish(Element sensor) {
    const Span at = sensor.at;
    Element sampler = made("sampler", "independent", at), film = made("film", "hdrfilm", at);
    add(sampler, "integer", "sample_count", fmt::format("{}", kSamples), at);
    add(film, "integer", "width", fmt::format("{}", width_), at);
    add(film, "integer", "height", fmt::format("{}", kHeight), at);
    add(sensor, std::move(sampler));
    add(sensor, std::move(film));
    t_.add(made("integrator", "volpath", at));
    t_.add(std::move(sensor));
  }

 private:
  void set_aspect(const Item& given) {
    if (!given.given()) return;
    const double aspect = given.number(1);
    if (aspect >= .01 && aspect <= 20)
      width_ = std::max(1, static_cast<int>(std::lround(kHeight * aspect)));
    else
      given.error("an aspectRatio from 0.01 to 20 is read");
  }

  void clip(Element& out, const Item& lens, double least) {
    add(out, "near_clip", std::max(lens["znear"].number(least), least), out.at);
    add(out, "far_clip", lens["zfar"].number(kFarthest), out.at);
  }

  // Translates an orthographic camera. In Mitsuba's format it covers [-1, 1] across the width of the image;
  // in glTF xmag is half the width. So the transform is scaled by xmag.
  Element orthographic(const Item& lens, const Transform& to_world, const Span& at) {
    const double x = std::abs(lens["xmag"].number(0)), y = std::abs(lens["ymag"].number(0));
    Element out = made("sensor", "orthographic", at);
    if (!(x > 0 && y > 0 && x / y >= .01 && x / y <= 20)) {
      lens.error("xmag and ymag are wanted, the half width and half height of what is seen");
      return out;
    }
    width_ = std::max(1, static_cast<int>(std::lround(kHeight * x / y)));
    clip(out, lens, 1e-4);
    Transform scale;
    scale.m[0] = scale.m[5] = x;
    place(out, multiply(to_world, scale), at);
    return out;
  }

  Translation& t_;
  int width_ = kWidth;
};

}  // namespace

void add_camera(Translation& t, const std::vector<Standing>& cameras, const std::string& name,
                const Box& box) {
  CameraTranslator translator(t);
  if (cameras.empty() && name.empty()) {
    t.root.warning("the scene has no camera: one is put in front of it that sees all of it");
    return translator.finish(translator.framing(box));
  }
  std::vector<std::string> names;
  for (const Standing& camera : cameras) {
    const std::string own = name_of(t, camera);
    if (!own.empty()) names.push_back(own);
    if (!name.empty() && own != name) continue;
    if (name.empty() && cameras.size() > 1)
      t.root.warning(
          fmt::format("the first of {} cameras is used: -D camera=NAME chooses another", cameras.size()));
    return translator.finish(translator.placed(camera));
  }
  t.root.error(fmt::format("the scene has no camera \"{}\"{}", name, suggestion(name, names)));
}

}  // namespace ls::scene::gltf
