// Numbers, lists and colours as they are written in attributes.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace ls::scene {

// A finite number and nothing else but surrounding blanks.
std::optional<double> parse_number(std::string_view text);
std::optional<long long> parse_integer(std::string_view text);
std::optional<bool> parse_boolean(std::string_view text);  // true, false in any case
// Numbers between commas and blanks; nothing if one of them is no number, or there are more than `most`.
std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t most);
// One number (grey), three, or #rrggbb: 8-bit sRGB, decoded to linear (IEC 61966-2-1).
std::optional<Rgb> parse_rgb(std::string_view text);
// <spectrum>: one number, three (0.x files), or wavelength:value pairs that are all of one value.
struct SpectrumText {
  std::optional<Rgb> value;
  bool varies = false;  // well-formed pairs whose values differ
};
SpectrumText parse_spectrum(std::string_view text);

}  // namespace ls::scene
