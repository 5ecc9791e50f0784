// Colour spaces of linear colours, and the matrices between them. In a Tristimulus the numbers are R, G, B or
// X, Y, Z.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace ls {

// A place in the chromaticity diagram of CIE 1931: x and y.
using Chromaticity = std::array<double, 2>;
struct Chromaticities {
  Chromaticity red, green, blue, white;
  bool operator==(const Chromaticities&) const = default;
};

using Tristimulus = std::array<double, 3>;
struct ColourMatrix {
  std::array<Tristimulus, 3> rows;  // it acts on columns
  double operator()(std::size_t row, std::size_t column) const { return rows[row][column]; }
};
Tristimulus operator*(const ColourMatrix& m, const Tristimulus& c);
ColourMatrix operator*(const ColourMatrix& a, const ColourMatrix& b);
ColourMatrix inverse(const ColourMatrix& m);  // not finite if m cannot be inverted

// Returns the matrix from R, G, B of these primaries to CIE XYZ: its columns are those of the primaries,
// scaled so that (1, 1, 1) is the white, of luminance 1 (SMPTE RP 177-1993). Not finite if the primaries are
// those of no colour space.
ColourMatrix to_xyz(const Chromaticities& c);
// Returns the matrix from X, Y, Z seen under one white to those that look alike under another: Bradford's (K.
// M. Lam, Metamerism and Colour Constancy, 1985), as ICC profiles have it.
ColourMatrix adaptation(const Chromaticity& from, const Chromaticity& to);

// rec709: the colours of the renderer, linear sRGB (ITU-R BT.709). rec2020: BT.2020. p3_d65: the primaries of
// SMPTE RP 431-2 with the white D65. acescg, aces2065_1: AP1 and AP0 of ACES (S-2014-004, ST 2065-1). xyz:
// CIE 1931 XYZ as R, G, B.
enum class ColourSpace { rec709, rec2020, p3_d65, acescg, aces2065_1, xyz };
std::span<const ColourSpace> colour_spaces();
std::string_view to_string(ColourSpace space);
const Chromaticities& chromaticities_of(ColourSpace space);
// Returns the matrix from linear colours of Rec. 709 to the space. White becomes white: if the whites differ,
// that of Rec. 709 is adapted. X, Y, Z have no white of their own, so a white of Rec. 709 becomes that of
// D65.
ColourMatrix from_rec709(ColourSpace space);
// The same for a space with these primaries and a white of its own
ColourMatrix from_rec709(const Chromaticities& c);
// Primaries of Adobe RGB (1998), with the white D65
inline constexpr Chromaticities kAdobeRgb{{.64, .33}, {.21, .71}, {.15, .06}, {.3127, .3290}};

}  // namespace ls
