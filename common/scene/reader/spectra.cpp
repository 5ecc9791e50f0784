// Spectra that are objects: `d65`, `regular`, `irregular` and `blackbody`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/scene/limits.h"
#include "common/scene/reader/reader.h"
#include "common/scene/xml/transform_element.h"
#include "common/scene/xml/values.h"

namespace ls::scene {
namespace {

constexpr std::size_t kMaxCurvePoints = 4096;  // of one curve

// Reads the numbers of a required <string>. Empty: it is missing or wrong, which has been reported.
std::vector<double> curve_numbers(Params& p, std::string_view name, Report& report) {
  const Element* given = p.take(name);
  if (!given)
    return report.error(p.object().at, fmt::format("{} needs '{}'", p.title(), name)), std::vector<double>{};
  const auto values =
      given->tag == "string" ? parse_numbers(given->get("value"), kMaxCurvePoints) : std::nullopt;
  if (values && values->size() >= 2) return *values;
  report.error(given->at, fmt::format("'{}' of {} wants a <string> of 2 to {} numbers", name, p.title(),
                                      kMaxCurvePoints));
  return {};
}

double needed_number(Params& p, std::string_view name, const Range& range, Report& report) {
  double value = 0;
  if (const Element* given = p.take(name))
    p.convert({.name = name, .doc = "", .range = range}, *given, value);
  else
    report.error(p.object().at, fmt::format("{} needs '{}'", p.title(), name));
  return value;
}

std::vector<double> evenly(double first, double last, std::size_t n) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i)
    x[i] = first + (last - first) * static_cast<double>(i) / static_cast<double>(n - 1);
  return x;
}

}  // namespace

bool Reader::is_spectrum(const Element& object) {
  static constexpr std::string_view kTypes[] = {"d65", "regular", "irregular", "blackbody"};
  return object.tag == "spectrum" && std::ranges::find(kTypes, object.get("type")) != std::end(kTypes);
}

std::optional<Reader::Spectrum> Reader::read_spectrum(const Element& e) {
  const std::string_view type = e.get("type");
  Params p(*this, e);
  Spectrum s;
  if (type == "d65") {
    // As in Mitsuba's RGB modes, d65 is the white of sRGB.
    Rgb colour{1, 1, 1};
    double scale = 1;
    if (const Element* given = p.take("color")) p.convert({.name = "color", .doc = ""}, *given, colour);
    if (const Element* given = p.take("scale")) p.convert({.name = "scale", .doc = ""}, *given, scale);
    for (double& x : colour) {
      x *= scale;
      if (!std::isfinite(x))
        return report_.error(e.at, fmt::format("{} is brighter than numbers go", p.title())), std::nullopt;
    }
    s = colour;
  } else if (type == "blackbody") {
    const double kelvin =
        needed_number(p, "temperature", {.min = 0, .max = kMaxTemperature, .open_min = true}, report_);
    if (report_.has_errors()) return std::nullopt;
    Rgb colour = linear_srgb(black_body_xyz(kelvin));
    for (double& x : colour) x = std::max(x, 0.0);  // a red outside of sRGB has negative components
    s = LightColour{colour};
  } else {
    SpectralCurve curve;
    curve.value = curve_numbers(p, "values", report_);
    if (type == "irregular") {
      curve.nm = curve_numbers(p, "wavelengths", report_);
    } else {
      const double first = needed_number(p, "wavelength_min", kNonNegative, report_),
                   last = needed_number(p, "wavelength_max", kNonNegative, report_);
      if (!curve.value.empty()) curve.nm = evenly(first, last, curve.value.size());
    }
    if (report_.has_errors()) return std::nullopt;
    const auto falls = [](double a, double b) { return !(a < b); };
    if (curve.nm.size() != curve.value.size())
      report_.error(e.at, fmt::format("{} has {} wavelengths and {} values", p.title(), curve.nm.size(),
                                      curve.value.size()));
    else if (std::ranges::adjacent_find(curve.nm, falls) != curve.nm.end())
      report_.error(e.at, fmt::format("the wavelengths of {} must increase", p.title()));
    s = std::move(curve);
  }
  p.finish();
  return report_.has_errors() ? std::nullopt : std::optional(std::move(s));
}

}  // namespace ls::scene
