#include "util/report/number_text.h"

#include <fmt/chrono.h>

#include <array>
#include <cmath>
#include <ctime>

#include "util/report/phrases.h"

namespace ls::report {

std::string superscript(int n) {
  static constexpr std::array kDigits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text;
  for (const char c : fmt::format("{}", n))
    text += c == '-' ? "⁻" : kDigits[static_cast<std::size_t>(c - '0')];
  return text;
}

std::string figure(double x) {
  if (!std::isfinite(x)) return kAbsent;
  if (x == 0) return "0";
  // The number is rounded first, so that 9.996 gets the exponent of 10.0.
  const std::string scientific = fmt::format("{:.2e}", x);
  const std::size_t e = scientific.find('e');
  const int exponent = std::stoi(scientific.substr(e + 1));
  if (exponent >= 5 || exponent < -3) return scientific.substr(0, e) + " × 10" + superscript(exponent);
  if (exponent < 3) return fmt::format("{:.{}f}", x, 2 - exponent);
  const double unit = std::pow(10.0, exponent - 2);
  return count(std::round(x / unit) * unit);
}

std::string true_figure(double x, bool below_noise) { return below_noise ? phrase("belowNoise") : figure(x); }

std::string given(double x) {
  return x != 0 && std::abs(x) < 1e-4 ? figure(x) : std::isfinite(x) ? fmt::format("{:g}", x) : kAbsent;
}

std::string duration(double seconds) {
  if (!std::isfinite(seconds)) return kAbsent;
  if (seconds < 9.95) return fmt::format("{:g} s", std::round(seconds * 10) / 10);
  if (seconds < 99.5) return fmt::format("{:.0f} s", seconds);
  if (seconds < 3570)
    return seconds < 597 ? fmt::format("{:g} min", std::round(seconds / 6) / 10)
                         : fmt::format("{:.0f} min", seconds / 60);
  const double minutes = std::round(seconds / 60);
  if (minutes < 48 * 60)
    return fmt::format("{:.0f} h {:.0f} min", std::floor(minutes / 60), std::fmod(minutes, 60));
  const double hours = std::round(seconds / 3600);
  return fmt::format("{} d {:.0f} h", count(std::floor(hours / 24)), std::fmod(hours, 24));
}

std::string count(double n) {
  if (!std::isfinite(n)) return kAbsent;
  const std::string digits = fmt::format("{:.0f}", std::abs(n));
  std::string grouped = n <= -0.5 ? "−" : "";
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) grouped += ',';
    grouped += digits[i];
  }
  return grouped;
}

std::string sample_count(double spp) {
  return std::isfinite(spp) && spp < 100 ? fmt::format("{:g}", std::round(10 * spp) / 10) : count(spp);
}

std::string threads_words(double n) {
  return std::isfinite(n) && std::abs(n) < 1e6 ? fmt::format("{:g}", std::round(10 * n) / 10) : kAbsent;
}

std::string byte_size(double n) {
  static constexpr std::array kUnits{"B", "KiB", "MiB", "GiB", "TiB"};
  if (!std::isfinite(n)) return kAbsent;
  std::size_t unit = 0;
  while (n >= 1024 && unit + 1 < kUnits.size()) n /= 1024, ++unit;
  return unit == 0 || n >= 100 ? fmt::format("{:.0f} {}", n, kUnits[unit])
                               : fmt::format("{:.1f} {}", n, kUnits[unit]);
}

std::string percent(double part) {
  if (!std::isfinite(part)) return kAbsent;
  const double whole = std::round(100 * part);
  if (part > 0 && whole == 0) return "< 1 %";
  if (part < 1 && whole == 100) return "> 99 %";
  return fmt::format("{:.0f} %", whole);
}

std::string date_time(double unix_seconds) {
  if (!(unix_seconds > 0 && unix_seconds < 1e11)) return kAbsent;
  return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(static_cast<std::time_t>(unix_seconds)));
}

}  // namespace ls::report
