// Reading, checking and writing the value of one setting, for each type that a setting may have. A new type
// needs a branch in each of parse(), allowed() and write(). A file that reads or writes JSON by these
// functions includes <nlohmann/json.hpp>; this header does not, since others include it only for names and
// ranges.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/digest.h"
#include "core/base/frame_range.h"
#include "core/base/parse_number.h"
#include "core/image/frame/frame.h"
#include "core/job/limits.h"
#include "core/job/setting.h"
#include "core/job/settings.h"

namespace ls {

// The values of an enumeration that a setting may have. Its names are those of to_string().
inline constexpr std::array kTargetLayers{TargetLayer::raw, TargetLayer::denoised};
constexpr std::span<const TargetLayer> offered(TargetLayer) { return kTargetLayers; }

inline std::span<const ColourSpace> offered(ColourSpace) { return colour_spaces(); }
inline std::span<const ExrCompression> offered(ExrCompression) { return exr_compressions(); }
inline std::span<const ExrParts> offered(ExrParts) { return exr_parts(); }

namespace job {

using Json = nlohmann::json;
template <class T>
concept IsJson = std::same_as<T, Json>;
using Names = std::vector<std::string>;
using Defines = std::map<std::string, std::string>;

template <class T, class... Others>
inline constexpr bool kIs = (std::is_same_v<T, Others> || ...);
template <class T>
inline constexpr bool kIsWhole = std::is_integral_v<T> && !kIs<T, bool>;

// Returns `text` truncated to `most` bytes and made ASCII, so that it can be part of a log line or a JSON
// string.
std::string printable(std::string_view text, std::size_t most);
// True if the text is short enough and has only letters, digits and "_-.:", which are safe in the names of
// files, labels and layers.
bool is_name(std::string_view text);
std::vector<std::string_view> split(std::string_view text, char separator);  // leaves empty parts out

// Parses the text of a value in a query or an option. Returns false if it cannot be such a value at all.
template <class T>
bool parse(std::string_view from, T& out) {
  const auto take = [&](const auto& result) {
    if (result) out = *result;
    return static_cast<bool>(result);
  };
  if constexpr (kIs<T, bool>) {
    out = from == "true" || from == "1";
    return out || from == "false" || from == "0";
  } else if constexpr (std::is_arithmetic_v<T>) {
    return take(parse_number<T>(from));
  } else if constexpr (std::is_enum_v<T>) {
    return take([&]() -> std::optional<T> {
      for (const T one : offered(T{}))
        if (to_string(one) == from) return one;
      return std::nullopt;
    }());
  } else if constexpr (kIs<T, Names>) {
    const auto parts = split(from, ',');
    out = {parts.begin(), parts.end()};
    return true;
  } else if constexpr (kIs<T, FrameSize>) {
    const std::size_t x = from.find('x');
    return x != from.npos && parse(from.substr(0, x), out.width) && parse(from.substr(x + 1), out.height);
  } else if constexpr (kIs<T, PixelRect>) {
    const auto parts = split(from, ',');
    return parts.size() == 4 && std::ranges::count(from, ',') == 3 && parse(parts[0], out.x0) &&
           parse(parts[1], out.y0) && parse(parts[2], out.x1) && parse(parts[3], out.y1);
  } else if constexpr (kIs<T, FrameRange>) {
    return take(parse_frames(from));
  } else if constexpr (kIs<T, TechniqueChoice>) {
    return take(parse_technique_choice(from));
  } else if constexpr (kIs<T, LightMix>) {
    return take(parse_light_mix(from));
  } else if constexpr (kIs<T, Digest>) {
    return take(Digest::parse(from));
  } else {
    static_assert(kIs<T, std::string>, "this type of setting has no text");
    out = from;
    return true;
  }
}

// Parses the JSON of a value. Returns false if it cannot be such a value at all.
template <IsJson J, class T>
bool parse(const J& from, T& out) {
  bool possible = false;
  if constexpr (kIsWhole<T>) {
    possible = from.is_number_unsigned()
                   ? std::in_range<T>(from.template get<std::uint64_t>())
                   : from.is_number_integer() && std::in_range<T>(from.template get<std::int64_t>());
  } else if constexpr (kIs<T, bool>) {
    possible = from.is_boolean();
  } else if constexpr (kIs<T, double>) {
    possible = from.is_number();
  } else if constexpr (kIs<T, Names>) {
    possible = from.is_array() && std::ranges::all_of(from, [](const J& one) { return one.is_string(); });
  } else {
    const auto part = [&](std::size_t i, int& side) { return parse(from[i], side); };
    if constexpr (kIs<T, FrameSize>)
      if (from.is_array()) return from.size() == 2 && part(0, out.width) && part(1, out.height);
    if constexpr (kIs<T, PixelRect>)
      return from.is_array() && from.size() == 4 && part(0, out.x0) && part(1, out.y0) && part(2, out.x1) &&
             part(3, out.y1);
    if constexpr (kIs<T, FrameRange>)
      if (from.is_number_unsigned()) return parse(std::string_view(from.dump()), out);
    return from.is_string() && parse(std::string_view(from.template get_ref<const std::string&>()), out);
  }
  if constexpr (std::is_arithmetic_v<T> || kIs<T, Names>)
    if (possible) out = from.template get<T>();
  return possible;
}

// Returns whether the setting may have the value: the one range check of all settings.
template <class T>
bool fits(const Setting& s, const T& value) {
  if constexpr (kIsWhole<T>)
    return std::cmp_greater_equal(value, s.range.least) && std::cmp_less_equal(value, s.range.most);
  else if constexpr (kIs<T, double>)
    return value > 0 && value <= static_cast<double>(s.range.most);  // false for NaN, too
  else if constexpr (kIs<T, std::string>)
    return s.range.most == 0
               ? is_name(value)
               : std::cmp_greater_equal(value.size(), s.range.least) && value.size() <= s.range.most;
  else if constexpr (kIs<T, Names>)
    return value.size() <= kMaxNames && std::ranges::all_of(value, is_name);
  else if constexpr (kIs<T, FrameSize>)
    return value.width >= 1 && value.height >= 1 && value.width <= kMaxFrameSide &&
           value.height <= kMaxFrameSide && std::int64_t{value.width} * value.height <= kMaxFramePixels;
  else if constexpr (kIs<T, PixelRect>)
    return value.x0 >= 0 && value.y0 >= 0 && value.x1 >= 0 && value.y1 >= 0;
  else
    return true;
}

// Returns which values are possible, such as "a whole number from 1 to 8".
template <class T>
std::string allowed(const Setting& s, Form form) {
  constexpr std::string_view kName = "a name of up to 64 letters, digits and _-.:";
  const bool json = form == Form::json;
  if constexpr (kIs<T, bool>) {
    return "true or false";
  } else if constexpr (kIsWhole<T>) {
    const bool scaled = form == Form::option && s.unit == "bytes";
    return fmt::format("a whole number from {} to {}{}", s.range.least, s.range.most,
                       scaled ? ", which may end with K, M, G or T (powers of 1024): 8G" : "");
  } else if constexpr (kIs<T, double>) {
    return fmt::format("a number above 0, at most {}", s.range.most);
  } else if constexpr (std::is_enum_v<T>) {
    std::vector<std::string> names;
    for (const T one : offered(T{}))
      names.push_back(fmt::format("{0}{1}{0}", json ? "\"" : "", to_string(one)));
    return fmt::format("{}", fmt::join(names, " or "));
  } else if constexpr (kIs<T, std::string>) {
    return s.range.most == 0 ? std::string(kName)
                             : fmt::format("a text of {} to {} bytes", s.range.least, s.range.most);
  } else if constexpr (kIs<T, Names>) {
    return fmt::format("a list of at most {} texts{}, each {}", kMaxNames, json ? "" : " separated by commas",
                       kName);
  } else if constexpr (kIs<T, Defines>) {
    return fmt::format("{}: at most {} of them, each name of 1 to {} bytes, each value {}of at most {} bytes",
                       json ? "an object {NAME: VALUE}" : "NAME=VALUE", kMaxDefines, kMaxNameBytes,
                       json ? "a text, number or boolean " : "", kMaxDefineBytes);
  } else if constexpr (kIs<T, FrameSize>) {
    return fmt::format("{}WIDTHxHEIGHT{} in pixels, each side from 1 to {} and at most {} pixels in all",
                       json ? "[width, height] or \"" : "", json ? "\"" : "", kMaxFrameSide, kMaxFramePixels);
  } else if constexpr (kIs<T, FrameRange>) {
    return fmt::format(
        "FIRST-LAST, FIRST-LASTxSTEP or the number of one frame: 1-10, 1-10x2 or 7, the last not before the "
        "first, at most {} frames, none above {}",
        kMaxFrames, kMaxFrameNumber);
  } else if constexpr (kIs<T, TechniqueChoice>) {
    return fmt::format(
        "-NAME or +NAME, separated by commas, each once and not both -equiangular and -exponential; names "
        "are {}",
        technique_names());
  } else if constexpr (kIs<T, LightMix>) {
    return fmt::format(
        "GROUP=FACTOR or GROUP=R:G:B, separated by commas, each group once; factors are numbers from 0 to {}",
        kMostMixFactor);
  } else if constexpr (kIs<T, PixelRect>) {
    return json ? "[x0, y0, x1, y1] in whole pixels, or null" : "X0,Y0,X1,Y1 in whole pixels: 0,0,64,64";
  } else {
    static_assert(kIs<T, Digest>, "this type of setting has no description");
    return "the SHA-256 of a blob, 64 hexadecimal digits";
  }
}

template <class T, IsJson J = Json>
J write(const T& value) {
  if constexpr (std::is_enum_v<T> || kIs<T, FrameRange, TechniqueChoice, LightMix>)
    return to_string(value);
  else if constexpr (kIs<T, FrameSize>)
    return J::array({value.width, value.height});
  else if constexpr (kIs<T, PixelRect>)
    return J::array({value.x0, value.y0, value.x1, value.y1});
  else if constexpr (kIs<T, Digest>)
    return value.hex();
  else
    return value;
}

// Returns the text of a value for a query or an option.
template <class T>
std::string text_of(const T& value) {
  if constexpr (kIs<T, Names>)
    return fmt::format("{}", fmt::join(value, ","));
  else if constexpr (kIs<T, FrameSize>)
    return fmt::format("{}x{}", value.width, value.height);
  else if constexpr (std::is_enum_v<T> || kIs<T, FrameRange, TechniqueChoice, LightMix>)
    return std::string(to_string(value));
  else if constexpr (kIs<T, Digest>)
    return value.hex();
  else
    return fmt::format("{}", value);
}

// Each read() parses and checks a value. It returns what is wrong with it, such as "must be a whole number
// from 1 to 8, not 9"; an empty text: nothing, and `out` has the value.
std::string must_be(std::string_view allowed, std::string_view given);
std::string read(const Setting& s, const Json& from, Defines& out);  // keeps the entries that `out` has
std::string read(const Setting& s, Form form, std::string_view from, Defines& out);  // adds one entry
std::string read(const Setting& s, Form form, std::string_view from, std::uint64_t& out);
template <IsJson J, class T>
std::string read(const Setting& s, const J& from, T& out) {
  if (parse(from, out) && fits(s, out)) return {};
  return must_be(allowed<T>(s, Form::json), from.dump(-1, ' ', false, J::error_handler_t::replace));
}
template <class T>
std::string read(const Setting& s, Form form, std::string_view from, T& out) {
  if constexpr (kIs<T, FrameRange>)
    if (const auto frames = parse_frames(from); !frames) return "is not possible: " + frames.error().message;
  return parse(from, out) && fits(s, out) ? "" : must_be(allowed<T>(s, form), from);
}
template <IsJson J, class T>
std::string read(const Setting& s, const J& from, std::optional<T>& out) {
  constexpr bool may_be_null = kIs<T, PixelRect>;
  std::optional<T> value(std::in_place);
  std::string problem;
  if (may_be_null && from.is_null())
    value.reset();
  else
    problem = read(s, from, *value);
  if (problem.empty()) out = std::move(value);
  return problem;
}
template <class T>
std::string read(const Setting& s, Form form, std::string_view from, std::optional<T>& out) {
  T value{};
  std::string problem = read(s, form, from, value);
  if (problem.empty()) out = std::move(value);
  return problem;
}

}  // namespace job
}  // namespace ls
