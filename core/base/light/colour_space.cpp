#include "core/base/light/colour_space.h"

namespace ls {
namespace {

struct Row {
  std::string_view name;
  Chromaticities chromaticities;
};
constexpr Chromaticity kD65{.3127, .3290}, kAcesWhite{.32168, .33767};
constexpr Row kRows[] = {  // in the order of ColourSpace
    {"rec709", {{.64, .33}, {.3, .6}, {.15, .06}, kD65}},
    {"rec2020", {{.708, .292}, {.170, .797}, {.131, .046}, kD65}},
    {"p3-d65", {{.68, .32}, {.265, .690}, {.15, .06}, kD65}},
    {"acescg", {{.713, .293}, {.165, .830}, {.128, .044}, kAcesWhite}},
    {"aces2065-1", {{.7347, .2653}, {0, 1}, {.0001, -.077}, kAcesWhite}},
    // The axes of XYZ as primaries; (1, 1, 1) lies at (1/3, 1/3), so that to_xyz() is the identity.
    {"xyz", {{1, 0}, {0, 1}, {0, 0}, {1. / 3, 1. / 3}}}};
constexpr std::array kSpaces{ColourSpace::rec709, ColourSpace::rec2020,    ColourSpace::p3_d65,
                             ColourSpace::acescg, ColourSpace::aces2065_1, ColourSpace::xyz};
static_assert(std::size(kRows) == kSpaces.size());

const Row& row_of(ColourSpace space) { return kRows[static_cast<std::size_t>(space)]; }

double dot(const Tristimulus& a, const Tristimulus& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Tristimulus cross(const Tristimulus& a, const Tristimulus& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Tristimulus xyz_of(const Chromaticity& xy) { return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]}; }

}  // namespace

Tristimulus operator*(const ColourMatrix& m, const Tristimulus& c) {
  return {dot(m.rows[0], c), dot(m.rows[1], c), dot(m.rows[2], c)};
}

ColourMatrix operator*(const ColourMatrix& a, const ColourMatrix& b) {
  ColourMatrix out;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) out.rows[i][k] = dot(a.rows[i], {b(0, k), b(1, k), b(2, k)});
  return out;
}

ColourMatrix inverse(const ColourMatrix& m) {
  const Tristimulus a = cross(m.rows[1], m.rows[2]), b = cross(m.rows[2], m.rows[0]),
                    c = cross(m.rows[0], m.rows[1]);
  const double det = dot(m.rows[0], a);
  ColourMatrix out;
  for (std::size_t i = 0; i < 3; ++i) out.rows[i] = {a[i] / det, b[i] / det, c[i] / det};
  return out;
}

ColourMatrix to_xyz(const Chromaticities& c) {
  // A chromaticity (x, y) has the direction (x, y, 1 - x - y); the green of ACES has a y of 1, its blue one
  // below 0.
  ColourMatrix m;
  for (std::size_t k = 0; k < 3; ++k) {
    const Chromaticity& xy = k == 0 ? c.red : k == 1 ? c.green : c.blue;
    m.rows[0][k] = xy[0];
    m.rows[1][k] = xy[1];
    m.rows[2][k] = 1 - xy[0] - xy[1];
  }
  const Tristimulus scale = inverse(m) * xyz_of(c.white);
  for (Tristimulus& row : m.rows)
    for (std::size_t k = 0; k < 3; ++k) row[k] *= scale[k];
  return m;
}

ColourMatrix adaptation(const Chromaticity& from, const Chromaticity& to) {
  constexpr ColourMatrix kCones{{{{.8951, .2664, -.1614}, {-.7502, 1.7135, .0367}, {.0389, -.0685, 1.0296}}}};
  const Tristimulus one = kCones * xyz_of(from), other = kCones * xyz_of(to);
  ColourMatrix scaled = kCones;
  for (std::size_t i = 0; i < 3; ++i)
    for (double& x : scaled.rows[i]) x *= other[i] / one[i];
  return inverse(kCones) * scaled;
}

std::span<const ColourSpace> colour_spaces() { return kSpaces; }

std::string_view to_string(ColourSpace space) { return row_of(space).name; }

const Chromaticities& chromaticities_of(ColourSpace space) { return row_of(space).chromaticities; }

ColourMatrix from_rec709(ColourSpace space) {
  if (space == ColourSpace::xyz) return to_xyz(chromaticities_of(ColourSpace::rec709));
  return from_rec709(chromaticities_of(space));
}

ColourMatrix from_rec709(const Chromaticities& c) {
  ColourMatrix m = to_xyz(chromaticities_of(ColourSpace::rec709));
  if (c.white != kD65) m = adaptation(kD65, c.white) * m;
  return inverse(to_xyz(c)) * m;
}

}  // namespace ls
