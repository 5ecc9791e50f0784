// Reads colours: rgb, black bodies and spectra.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "core/base/file_form.h"
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

using Matrix3 = std::array<Vec3, 3>;  // its rows

Vec3 product(const Matrix3& m, const Vec3& v) { return {dot(m[0], v), dot(m[1], v), dot(m[2], v)}; }
Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 out;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) out[i][k] = dot(a[i], Vec3{{b[0][k], b[1][k], b[2][k]}});
  return out;
}
Matrix3 inverse(const Matrix3& m) {
  const Vec3 a = cross(m[1], m[2]), b = cross(m[2], m[0]), c = cross(m[0], m[1]);
  const double det = dot(m[0], a);
  Matrix3 out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = Vec3{{a[i] / det, b[i] / det, c[i] / det}};
  return out;
}

// The primaries and the white of a colour space, as chromaticities (x, y).
struct Space {
  ColourSpace space;
  std::array<double, 2> red, green, blue, white;
};
constexpr std::array<double, 2> kD65{.3127, .3290};
// From ITU-R BT.709 and BT.2020, SMPTE RP 431-2 and ST 2065-1. The green of DCI-P3 is (.265, .690), and its
// white D65, in pbrt-v4 (src/pbrt/util/colorspace.cpp), too.
constexpr Space kSpaces[] = {
    {ColourSpace::srgb, {.64, .33}, {.3, .6}, {.15, .06}, kD65},
    {ColourSpace::dci_p3, {.68, .32}, {.265, .690}, {.15, .06}, kD65},
    {ColourSpace::rec2020, {.708, .292}, {.170, .797}, {.131, .046}, kD65},
    {ColourSpace::aces2065_1, {.7347, .2653}, {0, 1}, {.0001, -.077}, {.32168, .33767}},
};
const Space& row_of(ColourSpace space) {
  return *std::find_if(std::begin(kSpaces), std::end(kSpaces),
                       [&](const Space& row) { return row.space == space; });
}

Vec3 xyz_of(const std::array<double, 2>& xy) { return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]}; }

// Returns the matrix that converts a colour of the space to X, Y, Z: its columns are those of the primaries,
// scaled so that (1, 1, 1) is the white, of luminance 1.
Matrix3 to_xyz(const Space& s) {
  // A chromaticity (x, y) has the direction (x, y, 1 - x - y); the green of ACES has a y of 1, its blue one
  // below 0.
  Matrix3 m;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::array<double, 2> xy = std::array{s.red, s.green, s.blue}[k];
    m[0][k] = xy[0];
    m[1][k] = xy[1];
    m[2][k] = 1 - xy[0] - xy[1];
  }
  const Vec3 scale = product(inverse(m), xyz_of(s.white));
  for (Vec3& row : m)
    for (std::size_t k = 0; k < 3; ++k) row[k] *= scale[k];
  return m;
}

// Returns the matrix that converts X, Y, Z seen under one white to those that look alike under another:
// Bradford's (K. M. Lam, Metamerism and Colour Constancy, 1985), as ICC profiles have it.
Matrix3 adapted(const std::array<double, 2>& from, const std::array<double, 2>& to) {
  const Matrix3 cones{Vec3{{.8951, .2664, -.1614}}, Vec3{{-.7502, 1.7135, .0367}},
                      Vec3{{.0389, -.0685, 1.0296}}};
  const Vec3 one = product(cones, xyz_of(from)), other = product(cones, xyz_of(to));
  Matrix3 scaled = cones;
  for (std::size_t i = 0; i < 3; ++i)
    for (double& x : scaled[i]) x *= other[i] / one[i];
  return product(inverse(cones), scaled);
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

Rgb one_rgb(Translation& t, const Param& p, RgbOf meaning) {
  const std::vector<double> c = srgb_numbers(t, p, meaning);
  return {c[0], c[1], c[2]};
}

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

std::optional<ColourSpace> colour_space(std::string_view name) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  static constexpr std::pair<std::string_view, ColourSpace> kNames[] = {
      {"srgb", ColourSpace::srgb},
      {"dci-p3", ColourSpace::dci_p3},
      {"rec2020", ColourSpace::rec2020},
      {"aces2065-1", ColourSpace::aces2065_1}};
  for (const auto& [known, space] : kNames)
    if (known == lower) return space;
  return std::nullopt;
}

std::vector<double> srgb_numbers(Translation& t, const Param& p, RgbOf meaning) {
  if (p.space == ColourSpace::srgb) return p.numbers;
  const Space &from = row_of(p.space), &to = row_of(ColourSpace::srgb);
  const bool as_seen = meaning == RgbOf::light || from.white == to.white;
  Matrix3 m = to_xyz(from);
  if (!as_seen) m = product(adapted(from.white, to.white), m);
  m = product(inverse(to_xyz(to)), m);
  std::vector<double> out = p.numbers;
  bool is_cut = false;
  for (std::size_t i = 0; i + 2 < out.size(); i += 3) {
    const Vec3 given{{out[i], out[i + 1], out[i + 2]}};
    // The whites stand for each other, so that a grey stays exactly grey; only light keeps a white of its
    // own.
    if (is_grey({given[0], given[1], given[2]}) && (from.white == to.white || meaning != RgbOf::light))
      continue;
    const Vec3 seen = product(m, given);
    const bool at_most_one = meaning == RgbOf::surface && std::max({given[0], given[1], given[2]}) <= 1;
    for (std::size_t k = 0; k < 3; ++k) {
      out[i + k] = std::clamp(seen[k], 0., at_most_one ? 1. : std::numeric_limits<double>::max());
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
