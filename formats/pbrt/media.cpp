// Translates media; media of grids in the scene's text are in grids.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "formats/pbrt/media_parts.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

// clang-format off
constexpr Substance kSubstances[] = {
    // H. W. Jensen, S. R. Marschner, M. Levoy, P. Hanrahan: A Practical Model for Subsurface Light Transport,
    // SIGGRAPH 2001, the table of measured parameters.
    {"Apple", {0.003, 0.0034, 0.046}, {2.29, 2.39, 1.97}},
    {"Chicken1", {0.015, 0.077, 0.19}, {0.15, 0.21, 0.38}},
    {"Chicken2", {0.018, 0.088, 0.2}, {0.19, 0.25, 0.32}},
    {"Cream", {0.0002, 0.0028, 0.0163}, {7.38, 5.47, 3.15}},
    {"Ketchup", {0.061, 0.97, 1.45}, {0.18, 0.07, 0.03}},
    {"Marble", {0.0021, 0.0041, 0.0071}, {2.19, 2.62, 3}},
    {"Potato", {0.0024, 0.009, 0.12}, {0.68, 0.7, 0.55}},
    {"Skimmilk", {0.0014, 0.0025, 0.0142}, {0.7, 1.22, 1.9}},
    {"Skin1", {0.032, 0.17, 0.48}, {0.74, 0.88, 1.01}},
    {"Skin2", {0.013, 0.07, 0.145}, {1.09, 1.59, 1.79}},
    {"Spectralon", {0, 0, 0}, {11.6, 20.4, 14.9}},
    {"Wholemilk", {0.0011, 0.0024, 0.014}, {2.55, 3.21, 3.77}},
    // S. G. Narasimhan, M. Gupta, C. Donner, R. Ramamoorthi, S. K. Nayar, H. W. Jensen: Acquiring Scattering
    // Properties of Participating Media by Dilution, SIGGRAPH 2006; with the dilutions that pbrt-v4 uses.
    {"Lowfat Milk", {0.002875, 0.00575, 0.0115}, {0.89187, 1.5136, 2.532}},
    {"Reduced Milk", {0.0025556, 0.0051111, 0.012778}, {2.4858, 3.1669, 4.5214}},
    {"Regular Milk", {0.0015333, 0.0046, 0.019933}, {4.5513, 5.8294, 7.136}},
    {"Espresso", {4.7984, 6.5751, 8.8493}, {0.72378, 0.84557, 1.0247}},
    {"Mint Mocha Coffee", {3.772, 5.8228, 7.82}, {0.31602, 0.38538, 0.48131}},
    {"Lowfat Soy Milk", {0.0014375, 0.0071875, 0.035937}, {0.30576, 0.34233, 0.61664}},
    {"Regular Soy Milk", {0.0019167, 0.0095833, 0.065167}, {0.59223, 0.73866, 1.4693}},
    {"Lowfat Chocolate Milk", {0.0115, 0.0368, 0.1564}, {0.64925, 0.83916, 1.1057}},
    {"Regular Chocolate Milk", {0.010063, 0.043125, 0.14375}, {1.4585, 2.1289, 2.9527}},
    {"Coke", {0.10014, 0.16503, 0.2468}, {8.9053e-05, 8.372e-05, 0}},
    {"Pepsi", {0.091641, 0.14158, 0.20729}, {6.1697e-05, 4.2564e-05, 0}},
    {"Sprite", {0.001886, 0.0018308, 0.0020025}, {6.0306e-06, 6.4139e-06, 6.5504e-06}},
    {"Gatorade", {0.024794, 0.019289, 0.008878}, {0.0024574, 0.003007, 0.0037325}},
    {"Chardonnay", {0.010782, 0.011855, 0.023997}, {1.7982e-05, 1.3758e-05, 1.2023e-05}},
    {"White Zinfandel", {0.012072, 0.016184, 0.019843}, {1.7501e-05, 1.9069e-05, 1.288e-05}},
    {"Merlot", {0.11632, 0.25191, 0.29434}, {2.1129e-05, 0, 0}},
    {"Budweiser Beer", {0.011492, 0.024911, 0.057786}, {2.4356e-05, 2.4079e-05, 1.0564e-05}},
    {"Coors Light Beer", {0.006164, 0.013984, 0.034983}, {5.0922e-05, 4.301e-05, 0}},
    {"Clorox", {0.0033542, 0.014892, 0.026297}, {0.0024035, 0.0031373, 0.003991}},
    {"Apple Juice", {0.012957, 0.023741, 0.052184}, {0.00013612, 0.00015836, 0.000227}},
    {"Cranberry Juice", {0.039437, 0.094223, 0.12426}, {0.00010402, 0.00011646, 7.8139e-05}},
    {"Grape Juice", {0.10404, 0.23958, 0.29325}, {5.382e-05, 0, 0}},
    {"Ruby Grapefruit Juice", {0.085867, 0.18314, 0.25262}, {0.011002, 0.010927, 0.011036}},
    {"White Grapefruit Juice", {0.0138, 0.018831, 0.056781}, {0.22826, 0.23998, 0.32748}},
    {"Shampoo", {0.014107, 0.045693, 0.061717}, {0.0007176, 0.0008303, 0.0009016}},
    {"Strawberry Shampoo", {0.01449, 0.05796, 0.075823}, {0.00015671, 0.00015947, 1.518e-05}},
    {"Head & Shoulders Shampoo", {0.084621, 0.15688, 0.20365}, {0.023805, 0.028804, 0.034306}},
    {"Lemon Tea Powder", {2.4288, 4.5757, 7.2127}, {0.040224, 0.045264, 0.051081}},
    {"Orange Powder", {0.001449, 0.003441, 0.007863}, {0.00015617, 0.00017482, 0.0001762}},
    {"Pink Lemonade Powder", {0.001165, 0.002366, 0.003195}, {0.00012103, 0.00013073, 0.00012528}},
    {"Cappuccino Powder", {35.844, 49.547, 61.084}, {1.8436, 2.5851, 2.1662}},
    {"Salt Powder", {0.28415, 0.3257, 0.34148}, {0.027333, 0.032451, 0.031979}},
    {"Sugar Powder", {0.012638, 0.031051, 0.050124}, {0.00022272, 0.00025513, 0.000271}},
    {"Suisse Mocha Powder", {17.502, 27.004, 35.433}, {2.7979, 3.5452, 4.3365}},
    {"Pacific Ocean Surface Water", {0.031845, 0.031324, 0.030147}, {0.0001764, 0.00032095, 0.00019617}},
};
// clang-format on

}  // namespace

const Substance* find_substance(std::string_view name) {
  const auto* it = std::find_if(std::begin(kSubstances), std::end(kSubstances),
                                [&](const Substance& s) { return s.name == name; });
  return it == std::end(kSubstances) ? nullptr : it;
}

std::vector<std::string> substance_names() {
  std::vector<std::string> names;
  for (const Substance& s : kSubstances) names.emplace_back(s.name);
  return names;
}

namespace {

Rgb one(MediumSource& m, std::string_view name) {
  const Param* p = m.p.take(name);
  return p ? surface_colour(m.t, *p, RgbOf::matter).value_or(Rgb{1, 1, 1}) : Rgb{1, 1, 1};
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

bool cloud(MediumSource& m, Element& out) {
  const Coefficients c = coefficients(m);
  Box box;
  if (!read_box(m, box)) return false;
  add_albedo(m, out, c.albedo);
  add_extinction(m, out, c.extinction);
  Element volume = made("volume", "cloud", m.p.at());
  set(volume, "name", "sigma_t", m.p.at());
  const CloudVolume usual;
  add(volume, "density", m.p.number("density", usual.density), m.p.at());
  // pbrt displaces no point if it is below 0.
  add(volume, "wispiness", std::max(0., m.p.number("wispiness", usual.wispiness)), m.p.at());
  add(volume, "frequency", m.p.number("frequency", usual.frequency), m.p.at());
  add(volume, "point", "min", box.low, m.p.at());
  add(volume, "point", "max", box.high, m.p.at());
  place(volume, m.ctm.to, m.p.at());
  add(out, std::move(volume));
  return true;
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
  const bool grey = is_grey(extinction);
  // The medium "cloud" has no parameter "scale".
  const double scale = m.p.row().find("scale") ? m.p.number("scale", 1) : 1;
  add(out, "scale", grey ? scale * extinction[0] : scale, m.p.at());
  if (!grey) add(out, "tint", extinction, m.p.at());
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
