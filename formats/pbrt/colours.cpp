// Reads colours: rgb, black bodies and spectra.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "core/base/file_form.h"
#include "core/base/light/colour_space.h"
#include "core/scene/spectrum.h"
#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

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

constexpr double kNoLimit = std::numeric_limits<double>::max();

// Cuts off channels at 0 and at `most`, with a warning: sRGB cannot represent such a colour.
Rgb within_srgb(Translation& t, const Param& p, const Rgb& c, double most = kNoLimit) {
  Rgb out = c;
  for (double& x : out) x = std::clamp(x, 0., most);
  if (out != c && t.report.takes_warnings())
    t.report.warning(p.at, fmt::format("'{}' is a colour that sRGB can't hold: it is cut off", p.name));
  return out;
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
    for (const std::string_view indices : {"metal-", "glass-"})
      if (p.texts[0].starts_with(indices))
        return t.report.refuse(p.at, fmt::format("the spectrum \"{}\" is an index of refraction, which '{}' "
                                                 "is not: give it as rgb",
                                                 p.texts[0], p.name));
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

std::optional<double> kelvin_of(Translation& t, const Param& p) {
  if (p.numbers.size() == 1 && p.texts.empty() && p.numbers[0] > 0 && p.numbers[0] <= 1e6)
    return p.numbers[0];
  return t.report.refuse(p.at, fmt::format("'{}' wants one temperature in kelvin, at most 1e6", p.name));
}

// pbrt divides the spectrum of a black body by its largest value over all wavelengths. Light alone is then
// scaled to luminance 1.
std::optional<SpectralCurve> black_body_reflectance(Translation& t, const Param& p) {
  const auto kelvin = kelvin_of(t, p);
  if (!kelvin) return std::nullopt;
  SpectralCurve curve = black_body_curve(*kelvin);
  for (double& x : curve.value) x /= black_body_peak(*kelvin);
  return curve;
}

bool is_rgb(const Param& p) { return p.type == "rgb" && p.numbers.size() == 3 && p.texts.empty(); }

Rgb one_rgb(Translation& t, const Param& p, RgbOf meaning) {
  const std::vector<double> c = srgb_numbers(t, p, meaning);
  return {c[0], c[1], c[2]};
}

std::optional<Rgb> black_body(Translation& t, const Param& p) {
  const auto kelvin = kelvin_of(t, p);
  if (!kelvin) return std::nullopt;
  auto xyz = black_body_xyz(*kelvin);
  const double y = xyz[1];
  if (!std::isnormal(y))
    return t.report.refuse(p.at, fmt::format("a black body of {} K gives no light", *kelvin));
  for (double& x : xyz) x /= y;
  return within_srgb(t, p, linear_srgb(xyz));
}

}  // namespace

std::optional<ColourSpace> colour_space(std::string_view name) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  static constexpr std::pair<std::string_view, ColourSpace> kNames[] = {
      {"srgb", ColourSpace::rec709},
      {"dci-p3", ColourSpace::p3_d65},  // pbrt-v4's, whose white is D65
      {"rec2020", ColourSpace::rec2020},
      {"aces2065-1", ColourSpace::aces2065_1}};
  for (const auto& [known, space] : kNames)
    if (known == lower) return space;
  return std::nullopt;
}

std::vector<double> srgb_numbers(Translation& t, const Param& p, RgbOf meaning) {
  if (p.space == ColourSpace::rec709) return p.numbers;
  const Chromaticities &from = chromaticities_of(p.space), &to = chromaticities_of(ColourSpace::rec709);
  const bool as_seen = meaning == RgbOf::light || from.white == to.white;
  ColourMatrix m = to_xyz(from);
  if (!as_seen) m = adaptation(from.white, to.white) * m;
  m = inverse(to_xyz(to)) * m;
  std::vector<double> out = p.numbers;
  bool is_cut = false;
  for (std::size_t i = 0; i + 2 < out.size(); i += 3) {
    const Tristimulus given{out[i], out[i + 1], out[i + 2]};
    // The whites stand for each other, so that a grey stays exactly grey; only light keeps a white of its
    // own.
    if (is_grey(given) && (from.white == to.white || meaning != RgbOf::light)) continue;
    const Tristimulus seen = m * given;
    const bool at_most_one = meaning == RgbOf::surface && std::max({given[0], given[1], given[2]}) <= 1;
    for (std::size_t k = 0; k < 3; ++k) {
      out[i + k] = std::clamp(seen[k], 0., at_most_one ? 1. : kNoLimit);
      is_cut |= out[i + k] != seen[k];
    }
  }
  if (is_cut)
    t.warn_once(p.at,
                fmt::format("'{}' has colours that linear sRGB can't hold: each channel is cut off at 0{}",
                            p.name, meaning == RgbOf::surface ? " and 1" : ""));
  return out;
}

std::optional<Rgb> light_colour(Translation& t, const Param& p) {
  if (is_rgb(p)) return one_rgb(t, p, RgbOf::light);
  if (p.type == "blackbody") return black_body(t, p);
  if (p.type != "spectrum") return t.report.refuse(p.at, fmt::format("'{}' wants three numbers", p.name));
  if (p.texts.size() == 1 && p.texts[0] == "stdillum-D65") return Rgb{1, 1, 1};
  const auto curve = curve_of(t, p);
  if (!curve) return std::nullopt;
  return within_srgb(t, p, normalised(linear_srgb(*curve, Illuminant::equal_energy)));
}

std::optional<Rgb> surface_colour(Translation& t, const Param& p, RgbOf meaning) {
  if (is_rgb(p)) return one_rgb(t, p, meaning);
  if (p.type == "float" && p.numbers.size() == 1) return Rgb{p.numbers[0], p.numbers[0], p.numbers[0]};
  const bool black_body = p.type == "blackbody";
  if (p.type != "spectrum" && !black_body)
    return t.report.refuse(p.at, fmt::format("'{}' can't be given as {} here", p.name, p.type));
  const auto curve = black_body ? black_body_reflectance(t, p) : curve_of(t, p);
  if (!curve) return std::nullopt;
  // A constant curve is a grey, even if it does not cover all wavelengths.
  const auto& v = curve->value;
  if (std::all_of(v.begin(), v.end(), [&](double x) { return x == v[0]; })) return Rgb{v[0], v[0], v[0]};
  const bool at_most_one = meaning == RgbOf::surface && *std::max_element(v.begin(), v.end()) <= 1;
  return within_srgb(t, p, linear_srgb(*curve, Illuminant::d65), at_most_one ? 1 : kNoLimit);
}

Rgb light_colour(Translation& t, Params& params, std::string_view name) {
  const Param* p = params.take(name);
  if (!p) return {1, 1, 1};
  return light_colour(t, *p).value_or(Rgb{1, 1, 1});
}

}  // namespace ls::scene::pbrt
