// Reads colours: rgb, black bodies and spectra.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/file_form.h"
#include "common/scene/pbrt/object_translation.h"
#include "common/scene/xml/spectrum.h"
#include "common/scene/xml/transform_element.h"
#include "common/scene/xml/values.h"

namespace ls::scene::pbrt {
namespace {

// Returns the luminance Y of a linear sRGB colour, a weighted sum of its channels. The weights, a vector w,
// follow from linear_srgb(), which converts (X, Y, Z) to sRGB: the dot product of w with the result must be
// Y. So this product is 0 for the sRGB colours of (1, 0, 0) and (0, 0, 1), and 1 for that of (0, 1, 0).
double luminance(const Rgb& c) {
  static const Vec3 weights = [] {
    const auto column = [](const std::array<double, 3>& xyz) {
      const Rgb rgb = linear_srgb(xyz);
      return Vec3{{rgb[0], rgb[1], rgb[2]}};
    };
    Vec3 w = cross(column({0, 0, 1}), column({1, 0, 0}));
    const double one = dot(w, column({0, 1, 0}));
    for (double& x : w) x /= one;
    return w;
  }();
  return weights[0] * c[0] + weights[1] * c[1] + weights[2] * c[2];
}

// Sets negative channels to 0, with a warning: sRGB cannot represent such a colour.
Rgb within_srgb(Translation& t, const Param& p, Rgb c) {
  if (std::any_of(c.begin(), c.end(), [](double x) { return x < 0; }) && t.report.takes_warnings())
    t.report.warning(p.at, fmt::format("'{}' is a colour that sRGB can't hold: it is cut off", p.name));
  for (double& x : c) x = std::max(x, 0.);
  return c;
}

Rgb normalised(const Rgb& c) {
  const double y = luminance(c);
  if (!(y > 0)) return {0, 0, 0};
  return {c[0] / y, c[1] / y, c[2] / y};
}

// Parses the text of an .spd file: pairs of numbers, with comments that begin with #.
std::optional<std::vector<double>> numbers_in(std::string_view text) {
  std::vector<double> all;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, std::min(end, text.find('#'))));
    text.remove_prefix(std::min(end + 1, text.size()));
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == '\t' || c == '\r'; }, ' ');
    if (line.find_first_not_of(' ') == std::string::npos) continue;
    const auto some = parse_numbers(line, 4096);
    if (!some || all.size() > 65536) return std::nullopt;
    all.insert(all.end(), some->begin(), some->end());
  }
  return all;
}

std::optional<SpectralCurve> curve_of(Translation& t, const Param& p) {
  std::vector<double> numbers = p.numbers;
  if (!p.texts.empty()) {
    const auto text = t.assets.text(p.texts[0]);
    if (!text)
      return t.report.refuse(
          p.at, fmt::format("the spectrum \"{}\" is no name that is known here, and as a file: {}",
                            p.texts[0], text.error().message));
    const auto read = numbers_in(without_mark(*text));
    if (!read) return t.report.refuse(p.at, fmt::format("\"{}\" is no list of numbers", p.texts[0]));
    numbers = *read;
  }
  SpectralCurve curve;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
    if (i > 0 && numbers[i] <= curve.nm.back()) break;
    curve.nm.push_back(numbers[i]);
    curve.value.push_back(numbers[i + 1]);
  }
  if (numbers.size() >= 4 && 2 * curve.nm.size() == numbers.size()) return curve;
  return t.report.refuse(
      p.at, fmt::format("'{}' wants pairs of a wavelength in nm, which increases, and a value", p.name));
}

bool is_rgb(const Param& p) { return p.type == "rgb" && p.numbers.size() == 3 && p.texts.empty(); }

std::optional<Rgb> black_body(Translation& t, const Param& p) {
  if (p.numbers.size() != 1 || !p.texts.empty() || !(p.numbers[0] > 0 && p.numbers[0] <= 1e6))
    return t.report.refuse(p.at, fmt::format("'{}' wants one temperature in kelvin, at most 1e6", p.name));
  auto xyz = black_body_xyz(p.numbers[0]);
  const double y = xyz[1];
  if (!std::isnormal(y))
    return t.report.refuse(p.at, fmt::format("a black body of {} K gives no light", p.numbers[0]));
  for (double& x : xyz) x /= y;
  return within_srgb(t, p, linear_srgb(xyz));
}

}  // namespace

std::optional<Rgb> light_colour(Translation& t, const Param& p) {
  if (is_rgb(p)) return Rgb{p.numbers[0], p.numbers[1], p.numbers[2]};
  if (p.type == "blackbody") return black_body(t, p);
  if (p.type != "spectrum") return t.report.refuse(p.at, fmt::format("'{}' wants three numbers", p.name));
  if (p.texts.size() == 1 && p.texts[0] == "stdillum-D65") return Rgb{1, 1, 1};
  const auto curve = curve_of(t, p);
  if (!curve) return std::nullopt;
  return within_srgb(t, p, normalised(linear_srgb(*curve, Illuminant::equal_energy)));
}

std::optional<Rgb> surface_colour(Translation& t, const Param& p) {
  if (is_rgb(p)) return Rgb{p.numbers[0], p.numbers[1], p.numbers[2]};
  if (p.type == "float" && p.numbers.size() == 1) return Rgb{p.numbers[0], p.numbers[0], p.numbers[0]};
  if (p.type != "spectrum")
    return t.report.refuse(p.at, fmt::format("'{}' can't be given as {} here", p.name, p.type));
  const auto curve = curve_of(t, p);
  if (!curve) return std::nullopt;
  // A constant curve is a grey, even if it does not cover all wavelengths.
  const auto& v = curve->value;
  if (std::all_of(v.begin(), v.end(), [&](double x) { return x == v[0]; })) return Rgb{v[0], v[0], v[0]};
  return within_srgb(t, p, linear_srgb(*curve, Illuminant::d65));
}

Rgb light_colour(Translation& t, Params& params, std::string_view name) {
  const Param* p = params.take(name);
  if (!p) return {1, 1, 1};
  return light_colour(t, *p).value_or(Rgb{1, 1, 1});
}

}  // namespace ls::scene::pbrt
