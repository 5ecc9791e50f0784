// Parses the values of XML attributes: numbers, lists and colours. nullopt means that the text is not such a
// value.
#pragma once

#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "core/scene/scene.h"
#include "core/scene/spectrum.h"

namespace ls::scene {

// These two parse one finite number, which may have blanks around it.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);
std::optional<bool> parse_boolean(std::string_view text);  // parses true or false, in any letter case
// Parses numbers separated by commas or blanks. nullopt: one of them is not a number, or there are more than
// `most`.
std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t most);
// Parses a colour: one number (grey), three numbers, or #rrggbb, which is 8-bit sRGB and decoded to linear.
std::optional<Rgb> parse_rgb(std::string_view text);
// Parses #rrggbb without decoding: 255 becomes 1.
std::optional<Rgb> parse_hex(std::string_view text);
double decode_srgb(double x);  // converts an sRGB value, 0 to 1, to a linear one (IEC 61966-2-1)
// The value of a <spectrum>: one number, three numbers of linear sRGB (in files of Mitsuba 0.x), or
// wavelength:value pairs in nm; std::monostate if the text is none of these.
using SpectrumText = std::variant<std::monostate, double, Rgb, SpectralCurve>;
SpectrumText parse_spectrum(std::string_view text);

}  // namespace ls::scene
