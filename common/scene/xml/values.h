// Parses numbers, lists and colours in attributes.
#pragma once

#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "common/scene/scene.h"
#include "common/scene/xml/spectrum.h"

namespace ls::scene {

// A finite number, with surrounding blanks only.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);
std::optional<bool> parse_boolean(std::string_view text);  // true or false, in any letter case
// Numbers separated by commas or blanks; nullopt if one of them is not a number, or there are more than
// `most`.
std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t most);
// One number (grey), three, or #rrggbb: 8-bit sRGB, decoded to linear.
std::optional<Rgb> parse_rgb(std::string_view text);
// #rrggbb without decoding: 255 is 1.
std::optional<Rgb> parse_hex(std::string_view text);
double decode_srgb(double x);  // to linear (IEC 61966-2-1)
// <spectrum>: one number, three of linear sRGB (0.x files), or wavelength:value pairs in nm.
using SpectrumText = std::variant<std::monostate, double, Rgb, SpectralCurve>;
SpectrumText parse_spectrum(std::string_view text);

}  // namespace ls::scene
