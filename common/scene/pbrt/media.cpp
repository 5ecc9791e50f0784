// Translates media; grid media are in grids.cpp and cloud_medium.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/suggest.h"
#include "common/scene/limits.h"
#include "common/scene/pbrt/media_parts.h"
#include "common/scene/pbrt/substances.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

Rgb one(MediumSource& m, std::string_view name) {
  const Param* p = m.p.take(name);
  return p ? surface_colour(m.t, *p).value_or(Rgb{1, 1, 1}) : Rgb{1, 1, 1};
}

bool homogeneous(MediumSource& m, Element& out) {
  Coefficients c;
  if (const std::string name = m.p.text("preset", ""); !name.empty()) {
    const Substance* substance = find_substance(name);
    if (!substance)
      return m.wrong(m.p.at(), fmt::format("{} has a preset \"{}\" that is not known{}", m.p.title(), name,
                                           suggestion(name, substance_names())));
    c = coefficients(substance->absorption, substance->scattering);
  } else {
    c = coefficients(m);
  }
  add(out, "sigma_t", c.extinction, m.p.at());
  add_albedo(m, out, c.albedo);
  add(out, "scale", m.p.number("scale", 1), m.p.at());
  const double scale = m.p.number("Lescale", 1);
  if (!m.p.has("Le")) return true;
  Rgb light = light_colour(m.t, m.p, "Le");
  for (double& x : light) x *= scale * m.t.exposure();
  if (!all_zero(light)) add(out, "source_radiance", light, m.p.at());
  return true;
}

void add_file_grid(MediumSource& m, Element& out, const char* name, const std::string& file,
                   const std::string& grid_name) {
  Element grid = made("volume", "gridvolume", m.p.at());
  set(grid, "name", name, m.p.at());
  add(grid, "string", "filename", file, m.p.at());
  add(grid, "string", "grid_name", grid_name, m.p.at());
  place(grid, m.ctm.to, m.p.at());
  add(out, std::move(grid));
}

bool nanovdb(MediumSource& m, Element& out) {
  const Coefficients c = coefficients(m);
  const std::string file = m.p.text("filename", "");
  if (file.empty()) m.p.missing("filename");
  add_file_grid(m, out, "sigma_t", file, m.p.text("gridname", "density"));
  add_albedo(m, out, c.albedo);
  add_extinction(m, out, c.extinction);
  const auto light = {"temperaturename",  "Lescale",           "LeScale",
                      "temperaturescale", "temperatureoffset", "temperaturecutoff"};
  const bool emits = std::any_of(light.begin(), light.end(), [&](const char* name) { return m.p.has(name); });
  if (!emits) {
    m.t.warn_once(m.p.at(),
                  "a file of \"nanovdb\" gives light here only if the scene says so: if it has a grid of "
                  "temperatures, name it by \"string temperaturename\"");
    return true;
  }
  const std::string temperature = m.p.text("temperaturename", "temperature");
  const double scale = m.p.number("Lescale", m.p.number("LeScale", 1));
  if (scale == 0) {
    for (const char* name : light) m.p.take(name);
    return true;
  }
  add_file_grid(m, out, "temperature", file, temperature);
  return add_black_bodies(m, out, scale);
}

}  // namespace

Coefficients coefficients(const Rgb& absorption, const Rgb& scattering) {
  Coefficients c;
  for (std::size_t i = 0; i < 3; ++i) {
    c.extinction[i] = absorption[i] + scattering[i];
    c.albedo[i] = c.extinction[i] > 0 ? scattering[i] / c.extinction[i] : 0;
  }
  return c;
}

Coefficients coefficients(MediumSource& m) {
  const Rgb absorption = one(m, "sigma_a");
  return coefficients(absorption, one(m, "sigma_s"));
}

void add_albedo(MediumSource& m, Element& out, const Rgb& albedo) { add(out, "albedo", albedo, m.p.at()); }

void add_extinction(MediumSource& m, Element& out, const Rgb& extinction) {
  const bool is_grey = extinction[0] == extinction[1] && extinction[1] == extinction[2];
  // A cloud has no scale.
  const double scale = m.p.row().find("scale") ? m.p.number("scale", 1) : 1;
  add(out, "scale", is_grey ? scale * extinction[0] : scale, m.p.at());
  if (!is_grey) add(out, "tint", extinction, m.p.at());
}

bool add_black_bodies(MediumSource& m, Element& out, double factor) {
  const double scale = m.p.number("temperaturescale", 1);
  const double offset = m.p.number("temperatureoffset", m.p.number("temperaturecutoff", 0));
  if (!(scale >= 0)) return m.wrong(m.p.at(), fmt::format("{}: temperaturescale is negative", m.p.title()));
  if (!(std::abs(scale * offset) <= kMaxTemperature))
    return m.wrong(m.p.at(), fmt::format("{}: temperatureoffset times temperaturescale is {} K, beyond {} K",
                                         m.p.title(), scale * offset, kMaxTemperature));
  if (!(factor >= 0)) return m.wrong(m.p.at(), fmt::format("{}: Lescale is negative", m.p.title()));
  add(out, "temperature_scale", scale, m.p.at());
  add(out, "temperature_offset", -scale * offset, m.p.at());
  add(out, "boolean", "peak_one", "true", m.p.at());
  add(out, "emission_scale", factor * kPhotometric * m.t.exposure(), m.p.at());
  return true;
}

std::string medium_id(const std::string& name) { return fmt::format("medium {}", name); }

void add_medium(Translation& t, const std::string& name, Params& p, const Placed& ctm) {
  using Translate = bool (*)(MediumSource&, Element&);
  struct Type {
    std::string_view name;
    Translate translate;
  };
  static constexpr Type kTypes[] = {{"homogeneous", homogeneous},
                                    {"uniformgrid", uniform_grid},
                                    {"rgbgrid", rgb_grid},
                                    {"nanovdb", nanovdb},
                                    {"cloud", cloud}};
  MediumSource m{t, p, ctm};
  const std::string_view type = p.row().type;
  Element out = made("medium", type == "homogeneous" ? "homogeneous" : "heterogeneous", p.at());
  bool is_right = false;
  for (const Type& row : kTypes)
    if (row.name == type) is_right = row.translate(m, out);
  if (const double g = p.number("g", 0); g != 0) {
    Element hg = made("phase", "hg", p.at());
    add(hg, "g", g, p.at());
    add(out, std::move(hg));
  }
  p.finish();
  if (!is_right) return;
  set(out, "id", medium_id(name), p.at());
  add(t.scene, std::move(out));
}

}  // namespace ls::scene::pbrt
