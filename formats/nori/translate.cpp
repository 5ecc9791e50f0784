#include "formats/nori/translate.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/nori/object.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::nori {
namespace {

// The id of the medium outside of all meshes that have a medium.
constexpr std::string_view kAmbient = "ambient";

class SceneTranslator {
 public:
  explicit SceneTranslator(Report& report) : report_(report) {}

  std::optional<Element> run(const Element& scene) {
    out_.tag = "scene";
    out_.at = scene.at;
    set(out_, "version", "3.0.0", scene.at);
    for (const Element& e : scene.children)
      if (e.tag == "medium") ambient(e);
    for (const Element& e : scene.children) {
      if (report_.full()) return std::nullopt;
      child(e);
    }
    finish_camera(scene);
    return report_.has_errors() ? std::nullopt : std::optional(std::move(out_));
  }

 private:
  void child(const Element& e) {
    if (e.tag == "medium") return;  // run() has translated the media already
    if (e.tag == "mesh") return mesh(e);
    if (e.tag == "emitter") {
      if (auto light = emitter(e, report_)) add(out_, std::move(*light));
      return;
    }
    if (e.tag == "camera") return first(camera_, e);
    if (e.tag == "sampler") return first(sampler_, e);
    if (e.tag == "integrator") return first(integrator_, e);
    if (e.tag == "denoiser")
      return report_.warning(e.at,
                             "<denoiser> has no effect here: what is written is the picture as rendered");
    report_.error(e.at,
                  object_kind(e) == TagKind::object
                      ? fmt::format("a <{}> can't stand in <scene>", e.tag)
                      : fmt::format("<{}> stands in no object: <scene> itself has no parameters", e.tag));
  }

  void first(const Element*& slot, const Element& e) {
    if (slot)
      return report_.error(
          e.at, fmt::format("a second {}; the first is in {}", e.tag, report_.refer_to(slot->at, e.at)));
    slot = &e;
  }

  void ambient(const Element& e) {
    if (has_ambient_)
      return report_.error(e.at, "a second medium of the scene itself: one can be everywhere");
    has_ambient_ = true;
    if (auto m = medium(e, {}, report_)) {
      set(*m, "id", std::string(kAmbient), e.at);
      add(out_, std::move(*m));
    }
  }

  void mesh(const Element& e) {
    const Plugin* plugin = known_plugin(e, report_);
    if (!plugin) return;
    Object o(e, *plugin, report_);
    Element out = made("shape", plugin->type, e.at);
    const Element* to_world = o.take("toWorld");
    Mesh m{plugin->type == "sphere", {}, {}};
    if (m.sphere) {
      const Vec3 center = o.triple("center", {{0, 0, 0}});
      const double radius = o.number("radius", 1);
      add(out, "point", "center", center, e.at);
      add(out, "radius", radius, e.at);
      if (!to_world) {
        m.low = Vec3{{center[0] - radius, center[1] - radius, center[2] - radius}};
        m.high = Vec3{{center[0] + radius, center[1] + radius, center[2] + radius}};
      }
    } else {
      const Element* filename = o.take("filename");
      if (!filename) o.missing("filename");
      add_as(out, filename, "filename");
      add(out, "boolean", "flat_without_normals", "true", e.at);
    }
    add_transform(out, to_world, "to_world");
    const Element* inner = o.only("medium");
    surface(o, m, inner != nullptr, out);
    if (inner) bounded(*inner, m, out);
    o.finish();
    add(out_, std::move(out));
  }

  // Adds the bsdf and the emitter. A mesh without a bsdf gets the bsdf "null", which light passes unchanged,
  // if it only bounds a medium; otherwise it is grey, even if it emits.
  void surface(Object& o, const Mesh& m, bool bounds_medium, Element& out) {
    const Span at = o.element().at;
    if (const Element* given = o.only("bsdf")) {
      if (auto b = bsdf(*given, m, report_)) add(out, std::move(*b));
    } else if (bounds_medium) {
      add(out, made("bsdf", "null", at));
    } else {
      Element grey = made("bsdf", "diffuse", at);
      add(grey, "reflectance", Rgb{.5, .5, .5}, at);
      add(out, std::move(grey));
    }
    if (const Element* given = o.only("emitter"))
      if (auto light = mesh_emitter(*given, report_)) add(out, std::move(*light));
  }

  void bounded(const Element& e, const Mesh& m, Element& out) {
    auto inside = medium(e, m, report_);
    if (!inside) return;
    const std::string id = fmt::format("medium{}", bounded_.size());
    bounded_.push_back({id, m});
    set(*inside, "id", id, e.at);
    add(out_, std::move(*inside));
    refer(out, "interior", id);
    if (has_ambient_) refer(out, "exterior", std::string(kAmbient));
  }

  static void refer(Element& parent, std::string name, std::string id) {
    Element ref = made("ref", "", parent.at);
    set(ref, "name", std::move(name), parent.at);
    set(ref, "id", std::move(id), parent.at);
    add(parent, std::move(ref));
  }

  void finish_camera(const Element& scene) {
    if (!camera_) report_.error(scene.at, "the scene has no <camera>: nothing to see it with");
    if (!integrator_) report_.error(scene.at, "the scene has no <integrator>");
    if (!camera_ || !integrator_) return;
    auto sensor = camera(*camera_, sampler_, report_);
    auto light = integrator(*integrator_, report_);
    if (!sensor || !light) return;
    if (light->inmedium)
      inside_of_mesh(*sensor);
    else if (has_ambient_)
      refer(*sensor, "medium", std::string(kAmbient));
    add(out_, std::move(light->element));
    add(out_, std::move(*sensor));
  }

  // Kombu (a descendant of Nori) puts the camera into the medium of the mesh whose bounding box contains the
  // camera.
  void inside_of_mesh(Element& sensor) {
    const auto placed = std::find_if(sensor.children.begin(), sensor.children.end(),
                                     [](const Element& c) { return c.tag == "transform"; });
    const Vec3 eye = transform_point(read_transform(*placed, report_), {{0, 0, 0}});
    const std::string* id = nullptr;
    for (const auto& [name, m] : bounded_) {
      bool inside = m.low.has_value();
      for (std::size_t i = 0; inside && i < 3; ++i) inside = (*m.low)[i] <= eye[i] && eye[i] <= (*m.high)[i];
      if (inside) id = &name;
    }
    if (!id && bounded_.size() == 1 && !bounded_[0].second.low) id = &bounded_[0].first;
    if (id) return refer(sensor, "medium", *id);
    report_.error(integrator_->at,
                  "inmedium: no mesh with a medium is known to be around the camera (how far one of a file "
                  "reaches is not known here; if it is the only one it is taken)");
  }

  Report& report_;
  Element out_;
  bool has_ambient_ = false;
  const Element* camera_ = nullptr;
  const Element* sampler_ = nullptr;
  const Element* integrator_ = nullptr;
  // The meshes that bound media, each with the id of its medium.
  std::vector<std::pair<std::string, Mesh>> bounded_;
};

}  // namespace

bool is_nori(const Element& root) {
  if (root.tag == "test") return true;
  const auto has = [&](std::string_view one, std::string_view other) {
    return std::any_of(root.children.begin(), root.children.end(),
                       [&](const Element& c) { return c.tag == one || c.tag == other; });
  };
  // Mitsuba has no meshes, and called its sensors cameras before 0.4; its files have a version, and those of
  // some descendants of Nori have one, too.
  return root.tag == "scene" && has("camera", "mesh") && (!root.find("version") || !has("shape", "sensor"));
}

void rename_shapes(Element& root) {
  for (Element& child : root.children) {
    if (root.tag == "scene" && child.tag == "shape") child.tag = "mesh";
    if (child.tag == "scene") rename_shapes(child);
  }
}

bool translate(Document& document, Report& report) {
  if (!is_nori(document.root)) return true;
  if (document.root.tag == "test")
    return report.error(document.root.at, "this is a test, not a scene: run it by lightshaft validate FILE"),
           false;
  std::erase_if(document.root.attributes, [](const Attribute& a) { return a.name == "version"; });
  rename_shapes(document.root);
  if (!check_objects(document.root, report)) return false;
  auto scene = translate_scene(document.root, report);
  if (!scene) return false;
  document.root = std::move(*scene);
  return true;
}

std::optional<Element> translate_scene(const Element& scene, Report& report) {
  return SceneTranslator(report).run(scene);
}

std::optional<Element> translate_bsdf_alone(const Element& e, Report& report) {
  auto b = bsdf(e, {}, report);
  if (!b) return std::nullopt;
  Element scene = made("scene", "", e.at), shape = made("shape", "rectangle", e.at);
  set(scene, "version", "3.0.0", e.at);
  add(shape, std::move(*b));
  add(scene, std::move(shape));
  add(scene, made("sensor", "perspective", e.at));
  return scene;
}

}  // namespace ls::scene::nori
