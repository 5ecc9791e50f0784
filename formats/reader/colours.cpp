// Reads colours in their various notations (part of Params), and the spectra that are objects: `d65`,
// `regular`, `irregular` and `blackbody`.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/scene/limits.h"
#include "core/scene/spectrum.h"
#include "formats/reader/params.h"
#include "formats/reader/reader.h"
#include "formats/xml/grammar.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls::scene {

std::optional<Rgb> Params::colour(const Field& f, const Element& e, std::string_view wanted) {
  const std::string_view text = e.get("value");
  if (e.tag == "spectrum" && kind_of(e) == TagKind::property) return spectrum(f, e, wanted);
  if (const Element* object = object_at(e); object && (object->tag == "spectrum" || object->tag == "texture"))
    return colour_of_object(f, e, *object);
  std::optional<Rgb> c;
  if (e.tag == "rgb" || e.tag == "color") c = parse_rgb(text);
  if (e.tag == "float" || e.tag == "integer")
    if (const auto x = parse_number(text)) c = Rgb{*x, *x, *x};
  if (!c) {
    wrong_type(f.name, e, wanted);
    return std::nullopt;
  }
  return in_range(f, e, *c) ? c : std::nullopt;
}

// Converts spectra to colours as the RGB modes of Mitsuba do. In version 3 the curve of a reflectance is
// multiplied by the illuminant D65, but the curve of a light is not; so light of equal power at all
// wavelengths is not white. In version 0.x no curve is multiplied by an illuminant, and a single number is a
// grey.
std::optional<Rgb> Params::spectrum(const Field& f, const Element& e, std::string_view wanted) {
  const SpectrumText text = parse_spectrum(e.get("value"));
  const bool emits = object_.tag == "emitter";
  std::optional<Rgb> c;
  if (const auto* x = std::get_if<double>(&text)) {
    c = emits && !e.old ? equal_energy_srgb() : Rgb{1, 1, 1};
    for (double& part : *c) part *= *x;
  } else if (const auto* rgb = std::get_if<Rgb>(&text)) {
    c = *rgb;
  } else if (const auto* curve = std::get_if<SpectralCurve>(&text)) {
    c = shown(f, e, linear_srgb(*curve, emits || e.old ? Illuminant::equal_energy : Illuminant::d65));
  } else if (e.find("filename")) {
    return reader_.report().refuse(
        value_place(e, "filename"),
        fmt::format("'{}' of {}: curves in files are not read; give it as value=\"400:0.1, 500:0.3, ...\"",
                    f.name, title()));
  } else if (e.get("value").find(':') != std::string_view::npos) {
    return reader_.report().refuse(
        value_place(e, "value"),
        fmt::format(
            "'{}' of {} wants wavelength:value pairs, at least two, in increasing order of their wavelengths",
            f.name, title()));
  } else {
    wrong_type(f.name, e, wanted);
    return std::nullopt;
  }
  return in_range(f, e, *c) ? c : std::nullopt;
}

// Returns the colour of an object: of a spectrum, or of a texture that is the same everywhere.
std::optional<Rgb> Params::colour_of_object(const Field& f, const Element& e, const Element& object) {
  std::optional<Rgb> c;
  if (Reader::is_spectrum(object)) {
    const auto s = reader_.spectrum(object, e);
    if (!s) return std::nullopt;
    const bool emits = object_.tag == "emitter";
    if (const auto* rgb = std::get_if<Rgb>(&*s)) c = *rgb;
    if (const auto* curve = std::get_if<SpectralCurve>(&*s))
      c = shown(f, e, linear_srgb(*curve, emits || e.old ? Illuminant::equal_energy : Illuminant::d65));
    if (const auto* light = std::get_if<Reader::LightColour>(&*s)) {
      if (!emits)
        return reader_.report().refuse(e.at, fmt::format("'{}' of {} is no light: it can't be a \"{}\"",
                                                         f.name, title(), object.get("type")));
      c = light->value;
    }
  } else if (const auto index = reader_.texture(object, e)) {
    const Rgb* same = reader_.constant(*index);
    if (!same)
      return reader_.report().refuse(
          e.at, fmt::format("'{}' of {} is the same everywhere: a texture \"{}\" can't be one", f.name,
                            title(), object.get("type")));
    c = *same;
  }
  return c && in_range(f, e, *c) ? c : std::nullopt;
}

// Clamps a colour to the values that the parameter may have, as Mitsuba does: no channel is below 0, and for
// a reflectance none is above 1. Warns of changes that are larger than rounding errors.
Rgb Params::shown(const Field& f, const Element& e, const Rgb& seen) {
  // The tables of spectra and the matrix that converts to sRGB have at least four digits. Their rounding
  // errors, which make a white deviate from 1, cause no warning.
  constexpr double kSlack = 1e-3;
  Rgb c = seen;
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    c[i] = std::clamp(seen[i], std::max(f.range.min, 0.0), f.range.max);
    most = std::max(most, std::abs(c[i] - seen[i]));
  }
  if (most > kSlack)
    reader_.report().warning(
        value_place(e, "value"),
        fmt::format("'{}' of {} is, as linear sRGB, {:.4f} {:.4f} {:.4f}: cut off to what it can be", f.name,
                    title(), seen[0], seen[1], seen[2]));
  return c;
}

namespace {

constexpr std::size_t kMaxCurvePoints = 4096;  // largest number of points of one spectral curve

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

double needed_number(Params& p, std::string_view name, const Range& range) {
  double value = 0;
  p.read({.name = name, .doc = "", .range = range, .required = true}, value);
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
    p.read({.name = "color", .doc = ""}, colour);
    p.read({.name = "scale", .doc = ""}, scale);
    for (double& x : colour) {
      x *= scale;
      if (!std::isfinite(x))
        return report_.error(e.at, fmt::format("{} is brighter than numbers go", p.title())), std::nullopt;
    }
    s = colour;
  } else if (type == "blackbody") {
    const double kelvin =
        needed_number(p, "temperature", {.min = 0, .max = kMaxTemperature, .open_min = true});
    if (report_.has_errors()) return std::nullopt;
    Rgb colour = linear_srgb(black_body_xyz(kelvin));
    for (double& x : colour) x = std::max(x, 0.0);  // a deep red outside sRGB has negative components
    s = LightColour{colour};
  } else {
    SpectralCurve curve;
    curve.value = curve_numbers(p, "values", report_);
    if (type == "irregular") {
      curve.nm = curve_numbers(p, "wavelengths", report_);
    } else {
      const double first = needed_number(p, "wavelength_min", kNonNegative),
                   last = needed_number(p, "wavelength_max", kNonNegative);
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
