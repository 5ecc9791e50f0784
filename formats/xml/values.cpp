#include "formats/xml/values.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string>

#include "core/base/parse_number.h"

namespace ls::scene {
namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr std::string_view kSeparators = " ,\t\r\n";
constexpr std::size_t kMaxSpectrumPairs = 4096;

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

template <class T>
std::optional<T> parse_whole(std::string_view text) {
  text = trimmed(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return ls::parse_number<T>(text);
}

// Calls f(std::string_view) -> bool for each token of the text, until f returns false.
template <class F>
bool for_each_token(std::string_view text, F f) {
  for (std::size_t at = text.find_first_not_of(kSeparators); at < text.size();) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    if (!f(text.substr(at, end - at))) return false;
    at = text.find_first_not_of(kSeparators, end);
  }
  return true;
}

// Parses a spectral curve: at least two pairs wavelength:value, with increasing wavelengths in nm.
std::optional<SpectralCurve> parse_curve(std::string_view text) {
  SpectralCurve curve;
  const bool ok = for_each_token(text, [&](std::string_view token) {
    const std::size_t colon = token.find(':');
    if (colon == std::string_view::npos || curve.nm.size() == kMaxSpectrumPairs) return false;
    const auto nm = parse_number(token.substr(0, colon)), value = parse_number(token.substr(colon + 1));
    if (!nm || !value || (!curve.nm.empty() && !(*nm > curve.nm.back()))) return false;
    curve.nm.push_back(*nm);
    curve.value.push_back(*value);
    return true;
  });
  return ok && curve.nm.size() >= 2 ? std::optional(std::move(curve)) : std::nullopt;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  const auto value = parse_whole<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<long long> parse_integer(std::string_view text) { return parse_whole<long long>(text); }

std::optional<bool> parse_boolean(std::string_view text) {
  std::string lower(trimmed(text).substr(0, 8));
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (lower == "true") return true;
  if (lower == "false") return false;
  return std::nullopt;
}

std::optional<std::vector<double>> parse_numbers(std::string_view text, std::size_t most) {
  std::vector<double> numbers;
  const bool ok = for_each_token(text, [&](std::string_view token) {
    const auto x = parse_number(token);
    if (!x || numbers.size() == most) return false;
    numbers.push_back(*x);
    return true;
  });
  return ok ? std::optional(std::move(numbers)) : std::nullopt;
}

std::optional<Rgb> parse_rgb(std::string_view text) {
  if (auto hex = parse_hex(text)) {
    for (double& x : *hex) x = decode_srgb(x);
    return hex;
  }
  const auto numbers = parse_numbers(text, 3);
  if (!numbers) return std::nullopt;
  if (numbers->size() == 1) return Rgb{(*numbers)[0], (*numbers)[0], (*numbers)[0]};
  if (numbers->size() == 3) return Rgb{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  return std::nullopt;
}

std::optional<Rgb> parse_hex(std::string_view text) {
  text = trimmed(text);
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), value, 16);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return Rgb{(value >> 16) / 255.0, (value >> 8 & 255) / 255.0, (value & 255) / 255.0};
}

double decode_srgb(double x) { return x <= .04045 ? x / 12.92 : std::pow((x + .055) / 1.055, 2.4); }

SpectrumText parse_spectrum(std::string_view text) {
  if (text.find(':') != std::string_view::npos) {
    auto curve = parse_curve(text);
    return curve ? SpectrumText(std::move(*curve)) : SpectrumText();
  }
  const auto numbers = parse_numbers(text, 3);
  if (numbers && numbers->size() == 1) return numbers->front();
  if (numbers && numbers->size() == 3) return Rgb{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  return {};
}

}  // namespace ls::scene
