// Translates Nori's media with their phase functions and volumes.
#include <fmt/format.h>

#include <algorithm>

#include "core/base/file_form.h"
#include "formats/nori/object.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene::nori {
namespace {

constexpr Rgb kBlack{0, 0, 0};

struct Coefficients {
  Rgb sigma_t, albedo;
};

// Reads the three notations of coefficients: sigma_a with sigma_s, absorption with scattering, sigma_t with
// albedo.
class Reader {
 public:
  Reader(Object& o, Report& report) : o_(o), report_(report) {}

  std::optional<Coefficients> coefficients() {
    o_.both("sigma_a", "absorption");
    o_.both("sigma_s", "scattering");
    const bool apart = any({"sigma_a", "sigma_s", "absorption", "scattering"});
    const bool together = any({"sigma_t", "albedo"});
    if (apart && together)
      return report_.refuse(
          o_.element().at,
          fmt::format("{} gives both absorption or scattering and sigma_t or albedo", o_.title()));
    if (together) return Coefficients{o_.color("sigma_t", {.5, .5, .5}), o_.color("albedo", {.5, .5, .5})};
    if (!apart && !any({"emission", "source_radiance"}))
      return report_.refuse(
          o_.element().at,
          fmt::format("{} needs its coefficients: sigma_a and sigma_s, or sigma_t and albedo", o_.title()));
    const Rgb a = o_.color(o_.has("absorption") ? "absorption" : "sigma_a", kBlack);
    const Rgb s = o_.color(o_.has("scattering") ? "scattering" : "sigma_s", kBlack);
    Coefficients c{};
    for (std::size_t i = 0; i < 3; ++i) {
      c.sigma_t[i] = a[i] + s[i];
      c.albedo[i] = c.sigma_t[i] > 0 ? s[i] / c.sigma_t[i] : 0;
    }
    return c;
  }

 private:
  bool any(std::initializer_list<std::string_view> names) const {
    return std::any_of(names.begin(), names.end(), [&](std::string_view name) { return o_.has(name); });
  }
  Object& o_;
  Report& report_;
};

// Returns the value of a constant volume; nullopt for a grid.
std::optional<Rgb> constant_of(const Element& e, Report& report) {
  if (e.tag != "volume") return rgb_of(*parse_numbers(e.get("value"), 3));  // the text was checked before
  if (e.get("type") != "constvolume") return std::nullopt;
  Object o(e, *find_plugin("volume", "constvolume"), report);
  const Rgb value = o.color("value", kBlack);
  o.finish();
  return value;
}

// Adds a transform that maps the volume's unit cube to the bounding box of the mesh.
void fit(Element& volume, const Mesh& mesh) {
  std::array<double, 16> m{};
  for (std::size_t i = 0; i < 3; ++i) {
    m[5 * i] = (*mesh.high)[i] - (*mesh.low)[i];
    m[4 * i + 3] = (*mesh.low)[i];
  }
  m[15] = 1;
  add_transform(volume, nullptr, "to_world", {matrix_step(m, volume.at)});
}

std::optional<Element> grid(const Element* filename, const Element* order, std::string name, const Span& at,
                            const Mesh& mesh, Report& report) {
  Element out = made("volume", "gridvolume", at);
  set(out, "name", std::move(name), at);
  add_as(out, filename, "filename");
  add_as(out, order, "order");
  if (!without_gz(filename->get("value")).ends_with(".vol")) return out;
  if (!mesh.low)
    return report.refuse(
        filename->at,
        "a `.vol` fills the bounding box of its mesh, which is only known here of a <mesh type=\"sphere\"> "
        "without toWorld; put it into one, or take a file that has its own box");
  add(out, "boolean", "node_centred", "true", at);
  fit(out, mesh);
  return out;
}

// Makes the <volume> of a heterogeneous medium whose density is not constant.
std::optional<Element> grid_volume(const Element& e, std::string name, const Mesh& mesh, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  const Element* filename = o.take("filename");
  const Element* order = o.take("order");
  if (!filename) o.missing("filename");
  o.finish();
  return filename ? grid(filename, order, std::move(name), e.at, mesh, report) : std::nullopt;
}

void add_phase(Element& out, Object& o, Report& report) {
  const Element* nested = o.only("phase");
  if (nested && o.has("phase_g"))
    return report.error(nested->at, fmt::format("{} gives both a <phase> and phase_g", o.title()));
  double g = o.number("phase_g", 0);
  if (nested) {
    const Plugin* plugin = known_plugin(*nested, report);
    if (!plugin) return;
    Object phase(*nested, *plugin, report);
    if (plugin->type == "hg") g = phase.number("g", 0);
    phase.finish();
  }
  if (g == 0) return;
  Element hg = made("phase", "hg", nested ? nested->at : out.at);
  add(hg, "g", g, hg.at);
  add(out, std::move(hg));
}

void add_light(Element& out, Object& o) {
  for (const char* name : {"emission", "source_radiance"})
    if (o.has(name)) add_as(out, o.take(name), name);
}

Element homogeneous(const Coefficients& c, double scale, const Span& at) {
  Element out = made("medium", "homogeneous", at);
  add(out, "sigma_t", c.sigma_t, at);
  add(out, "albedo", c.albedo, at);
  add(out, "scale", scale, at);
  return out;
}

// Reads a density grid and multiplies it by the coefficients.
std::optional<Element> scaled_grid(Object& o, const Mesh& mesh, Report& report) {
  const Element* filename = o.take("filename");
  const auto c = Reader(o, report).coefficients();
  const double scale = o.number("scale", 1) * o.number("density_scale", 1);
  if (!filename || !c) return std::nullopt;
  const Rgb& t = c->sigma_t;
  if (!is_grey(t))
    return report.refuse(o.element().at, fmt::format("{} has an extinction of {} {} {} times its densities: "
                                                     "with a grid it can only be the same in all channels",
                                                     o.title(), t[0], t[1], t[2]));
  auto densities = grid(filename, o.take("order"), "sigma_t", o.element().at, mesh, report);
  if (!densities) return std::nullopt;
  Element out = made("medium", "heterogeneous", o.element().at);
  add(out, std::move(*densities));
  add(out, "albedo", c->albedo, o.element().at);
  add(out, "scale", scale * t[0], o.element().at);
  return out;
}

// Reads sigma_t and albedo as two volumes.
std::optional<Element> two_volumes(Object& o, const Mesh& mesh, Report& report) {
  if (!o.has("sigma_t")) o.missing("sigma_t");
  const Span at = o.element().at;
  const bool has_albedo = o.has("albedo");
  const Element* t = o.take("sigma_t");
  const Element* a = o.take("albedo");
  const double scale = o.number("scale", 1) * o.number("density_scale", 1);
  if (!t || (has_albedo && !a)) return std::nullopt;
  const auto constant_t = constant_of(*t, report);
  const auto constant_a = a ? constant_of(*a, report) : Rgb{.5, .5, .5};
  if (constant_t && constant_a) return homogeneous({*constant_t, *constant_a}, scale, at);
  Element out = made("medium", "heterogeneous", at);
  if (constant_t) {
    if (!mesh.low)
      return report.refuse(t->at,
                           "beside an albedo that varies a constant density must end somewhere, which is "
                           "only known here in a <mesh type=\"sphere\"> without toWorld");
    Element volume = made("volume", "constvolume", t->at);
    set(volume, "name", "sigma_t", t->at);
    add(volume, "value", *constant_t, t->at);
    fit(volume, mesh);
    add(out, std::move(volume));
  } else {
    auto volume = grid_volume(*t, "sigma_t", mesh, report);
    if (!volume) return std::nullopt;
    add(out, std::move(*volume));
  }
  if (constant_a) {
    add(out, "albedo", *constant_a, at);
  } else {
    auto volume = grid_volume(*a, "albedo", mesh, report);
    if (!volume) return std::nullopt;
    add(out, std::move(*volume));
  }
  add(out, "scale", scale, at);
  return out;
}

}  // namespace

std::optional<Element> medium(const Element& e, const Mesh& mesh, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  std::optional<Element> out;
  if (plugin->type == "heterogeneous") {
    out = o.has("filename") ? scaled_grid(o, mesh, report) : two_volumes(o, mesh, report);
  } else if (const auto c = Reader(o, report).coefficients()) {
    out = homogeneous(*c, o.number("scale", 1), e.at);
  }
  if (!out) {
    o.finish_refused();
    return std::nullopt;
  }
  add_phase(*out, o, report);
  add_light(*out, o);
  o.finish();
  return out;
}

}  // namespace ls::scene::nori
