// Translates Nori's camera with its filter and sampler, and Nori's integrators.
#include <fmt/format.h>

#include "core/base/text/suggest.h"
#include "core/image/frame/render_limits.h"
#include "core/scene/schema/integrators.h"
#include "formats/nori/object.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene::nori {
namespace {

// Returns the parameters that a Nori integrator may have here. They depend on the integrator that it is
// translated to (row.ours).
std::vector<Parameter> parameters_of(const IntegratorRow& row) {
  std::vector<Parameter> p;
  if (row.ours == "volpath_distant_mis") {
    p.push_back({"distance", kString, "mis", "how distances are chosen: exponential, equiangular or mis"});
    p.push_back({"heuristic", kString, "power", "how the two of mis are weighed: power or balance"});
  }
  if (sees_media(row.ours))
    p.push_back({"inmedium", kBoolean, "false", "the camera is in the medium of the mesh around it"});
  if (!row.max_depth)
    p.push_back({"maxDepth",
                 kInteger,
                 "-1",
                 "longest path in segments, as `max_depth`; -1: no limit",
                 {.min = -1, .max = kMaxDepthSetting}});
  if (row.name.ends_with("photonmapper"))
    for (const std::string_view name : {"photonCount", "photonRadius"})
      p.push_back(
          {name, kFloat | kInteger, "", "", kAny, "no photons are shot: the exact answer is rendered"});
  return p;
}

std::optional<Element> filter(const Element& e, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  const bool has_lobes = plugin->type == "mitchell";
  Element out = made("rfilter", has_lobes ? "gaussian" : plugin->type, e.at);
  if (has_lobes)
    report.warning(
        value_place(e, "type"),
        fmt::format("{} is read as \"gaussian\", which blurs a little more: it has negative lobes, "
                    "which samples that each belong to one pixel can't follow",
                    o.title()));
  if (plugin->type == "gaussian") {
    const double stddev = o.number("stddev", .5), radius = o.number("radius", 2);
    if (radius != 4 * stddev)
      report.warning(e.at,
                     fmt::format("{} ends at {} pixels: here it always ends at four times its stddev, {}",
                                 o.title(), radius, 4 * stddev));
    add(out, "stddev", stddev, e.at);
  }
  o.finish();
  return out;
}

std::optional<Element> sampler(const Element* e, const Span& at, Report& report) {
  Element out = made("sampler", "independent", e ? e->at : at);
  if (!e) {
    add(out, "integer", "sample_count", "1", at);
    return out;
  }
  const Plugin* plugin = known_plugin(*e, report);
  if (!plugin) return std::nullopt;
  Object o(*e, *plugin, report);
  if (plugin->type != "independent")
    report.warning(
        value_place(*e, "type"),
        fmt::format("of {} only the number of samples is used: which they are is this program's own matter",
                    o.title()));
  if (o.has("sampleCount"))
    add_as(out, o.take("sampleCount"), "sample_count");
  else
    add(out, "integer", "sample_count", "1", e->at);
  o.finish();
  return out;
}

void add_lens(Element& out, Object& o) {
  const double radius = o.number("apertureRadius", 0);
  if (radius > 0 && !o.has("focusDistance")) o.missing("focusDistance");
  const double focus = o.number("focusDistance", 1);
  if (!(radius > 0)) return;  // a pinhole camera has everything in focus
  for (Attribute& a : out.attributes)
    if (a.name == "type") a.value = "thinlens";
  add(out, "aperture_radius", radius, o.element().at);
  add(out, "focus_distance", focus, o.element().at);
}

}  // namespace

std::optional<Element> camera(const Element& e, const Element* sampler_given, Report& report) {
  const Plugin* plugin = known_plugin(e, report);
  if (!plugin) return std::nullopt;
  Object o(e, *plugin, report);
  Element out = made("sensor", "perspective", e.at), film = made("film", "hdrfilm", e.at);
  for (const auto& [name, fallback] : {std::pair("width", 1280), std::pair("height", 720)})
    add(film, "integer", name, fmt::format("{:.0f}", o.number(name, fallback)), e.at);
  if (const Element* given = o.only("rfilter"))
    if (auto f = filter(*given, report)) add(film, std::move(*f));
  add(out, "fov", o.number("fov", 30), e.at);
  const double near = o.number("nearClip", 1e-4), far = o.number("farClip", 1e4);
  if (near >= far) report.error(e.at, "nearClip is not nearer than farClip");
  add(out, "near_clip", near, e.at);
  add(out, "far_clip", far, e.at);
  add_lens(out, o);
  // Nori's +x points to the right of the image, Mitsuba's to the left.
  Element mirror = made("scale", "", e.at);
  set(mirror, "value", "-1 1 1", e.at);
  add_transform(out, o.take("toWorld"), "to_world", {std::move(mirror)});
  o.finish();
  add(out, std::move(film));
  if (auto s = sampler(sampler_given, e.at, report)) add(out, std::move(*s));
  return out;
}

std::optional<Integrator> integrator(const Element& e, Report& report) {
  const IntegratorRow* row = integrator_row(e.get("type"));
  if (!row) {
    known_plugin(e, report);  // reports an unknown or unsupported type
    return std::nullopt;
  }
  const Plugin plugin{"integrator", row->name, "", parameters_of(*row)};
  Object o(e, plugin, report);
  if (!row->but.empty())
    report.warning(value_place(e, "type"),
                   fmt::format("{} is read as \"{}\": {}", o.title(), row->ours, row->but));
  Integrator out{made("integrator", row->ours, e.at), false};
  if (row->max_depth) add(out.element, "integer", "max_depth", fmt::format("{}", *row->max_depth), e.at);
  add_as(out.element, o.take("maxDepth"), "max_depth");
  add_as(out.element, o.take("distance"), "distance");
  add_as(out.element, o.take("heuristic"), "heuristic");
  if (const Element* given = o.take("inmedium")) out.inmedium = parse_boolean(given->get("value")) == true;
  o.finish();
  return out;
}

}  // namespace ls::scene::nori
