// Decodes photometric files of lamps (IES LM-63-1986 to LM-63-2019) into images of all directions.
#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/assets/image.h"
#include "core/base/bytes.h"
#include "core/base/parse_number.h"

namespace ls {
namespace {

constexpr std::uint32_t kSide = 512;  // pixels of the image along each side: less than half a degree each
constexpr std::size_t kMostAngles = 3601;  // of one kind: a tenth of a degree around the whole circle
constexpr std::size_t kMostLines = 1000;   // of descriptions before TILT

// The numbers of the file, with the lines on which they stand.
class Numbers {
 public:
  Numbers(std::string_view text, std::size_t line, char line_end)
      : rest_(text), line_(line), line_end_(line_end) {}

  std::size_t line() const { return line_; }
  // Returns the next number; nullopt if there is none or if it is no number.
  std::optional<double> next() {
    constexpr std::string_view kBetween = " \t\r\n,\f\v";
    while (!rest_.empty() && kBetween.find(rest_[0]) != kBetween.npos) {
      line_ += rest_[0] == line_end_;
      rest_.remove_prefix(1);
    }
    word_ = rest_.substr(0, rest_.find_first_of(kBetween));
    std::string_view digits = word_;
    if (digits.starts_with('+')) digits.remove_prefix(1);
    const auto n = parse_number<double>(digits);
    accepted_ = n && std::isfinite(*n);
    if (!accepted_) return std::nullopt;
    rest_.remove_prefix(word_.size());
    return n;
  }
  // Why what was wanted is not there
  std::string refused() const {
    if (word_.empty()) return "the file ends";
    const std::string_view word = word_.substr(0, 40);
    return accepted_ ? fmt::format("this is {}", word) : fmt::format("'{}' is no number", word);
  }

 private:
  std::string_view rest_, word_;
  std::size_t line_;
  char line_end_;
  bool accepted_ = false;
};

struct Profile {
  int type = 1;                              // of the angles: 1 is C, 2 is B, 3 is A
  std::vector<double> vertical, horizontal;  // degrees, ascending
  std::vector<double> candelas;              // index: horizontal * vertical.size() + vertical
};

// A position in a list of ascending angles: between list[i] and list[i + 1], at the share t.
struct Position {
  std::size_t i = 0;
  double t = 0;
};
std::optional<Position> find(const std::vector<double>& list, double angle) {
  constexpr double kRounding = 1e-6;  // degrees
  if (!(angle >= list.front() - kRounding && angle <= list.back() + kRounding)) return std::nullopt;
  if (list.size() == 1) return Position{};
  const auto above = std::upper_bound(list.begin() + 1, list.end() - 1, angle);
  const auto i = static_cast<std::size_t>(above - list.begin()) - 1;
  return Position{i, std::clamp((angle - list[i]) / (list[i + 1] - list[i]), 0., 1.)};
}

double at(const Profile& p, const std::optional<Position>& v, const std::optional<Position>& h) {
  if (!v || !h) return 0;
  const std::size_t nv = p.vertical.size(), h1 = std::min(h->i + 1, p.horizontal.size() - 1),
                    v1 = std::min(v->i + 1, nv - 1);
  const auto along = [&](std::size_t row) {
    return std::lerp(p.candelas[row * nv + v->i], p.candelas[row * nv + v1], v->t);
  };
  return std::lerp(along(h->i), along(h1), h->t);
}

// The intensity in the direction (x, y, z), of length 1. Angles of type C are measured from +z, which is
// straight down for a lamp under a ceiling, and around it from +x towards -y, which is counterclockwise seen
// from above. Those of types A and B are measured from +z, where the lamp aims.
double intensity(const Profile& p, double x, double y, double z) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  if (p.type == 1) {
    const double first = p.horizontal.front(), last = p.horizontal.back();
    double h = std::atan2(-y, x) * kDegrees;
    if (h < 0) h += 360;
    // Lamps are symmetric about the planes at which the angles begin and end.
    if (first == last)
      h = first;
    else if (last <= 90)
      h = h > 270 ? 360 - h : h > 180 ? h - 180 : h > 90 ? 180 - h : h;
    else if (last <= 180)
      h = h > 180 ? 360 - h : h;
    else if (first >= 90 && last <= 270)
      h = h < 90 ? 180 - h : h > 270 ? 540 - h : h;
    return at(p, find(p.vertical, std::acos(std::clamp(z, -1., 1.)) * kDegrees), find(p.horizontal, h));
  }
  double h = 0, v = 0;
  if (p.type == 2) {  // the horizontal angle leads out of the plane of the vertical one
    h = std::asin(std::clamp(x, -1., 1.)) * kDegrees;
    v = std::atan2(y, z) * kDegrees;
  } else {
    h = std::atan2(x, z) * kDegrees;
    v = std::asin(std::clamp(y, -1., 1.)) * kDegrees;
  }
  if (p.horizontal.front() >= 0) h = std::abs(h);
  if (p.vertical.front() >= 0) v = std::abs(v);
  return at(p, find(p.vertical, v), find(p.horizontal, h));
}

// The intensity in the direction of a place in the unit square, by the equal-area map of
// worker/render/math/equal_area.h.
double intensity_at(const Profile& p, double u, double v) {
  const double x = 2 * u - 1, y = 2 * v - 1, a = std::abs(x), b = std::abs(y);
  const bool below = a + b > 1;
  const double fx = below ? 1 - b : a, fy = below ? 1 - a : b, r = fx + fy;
  const double phi = r > 0 ? fy / r * std::numbers::pi / 2 : 0, sine = r * std::sqrt(std::max(0., 2 - r * r));
  return intensity(p, std::copysign(sine * std::cos(phi), x), std::copysign(sine * std::sin(phi), y),
                   below ? r * r - 1 : 1 - r * r);
}

// True if the text is this word, in capitals or not.
bool is_word(std::string_view text, std::string_view word) {
  return text.size() == word.size() && ::strncasecmp(text.data(), word.data(), word.size()) == 0;
}

// Returns VALUE of a line TILT=VALUE, without blanks around it; nullopt if the line is another.
std::optional<std::string_view> tilt_of(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto trimmed = [&](std::string_view text) {
    const auto first = std::min(text.find_first_not_of(kBlanks), text.size());
    text.remove_prefix(first);
    return text.substr(0, text.find_last_not_of(kBlanks) + 1);
  };
  const std::size_t equals = line.find('=');
  if (equals == line.npos) return std::nullopt;
  if (!is_word(trimmed(line.substr(0, equals)), "TILT")) return std::nullopt;
  return trimmed(line.substr(equals + 1));
}

// Some files of type C leave out 360 degrees. Adds this angle, with the intensities of 0 degrees.
void close_circle(Profile& p) {
  std::vector<double>& h = p.horizontal;
  if (p.type != 1 || h.front() != 0 || h.back() <= 180 || h.back() >= 360) return;
  double widest = 0;
  for (std::size_t i = 1; i < h.size(); ++i) widest = std::max(widest, h[i] - h[i - 1]);
  if (360 - h.back() > 1.5 * widest) return;
  h.push_back(360);
  p.candelas.insert(p.candelas.end(), p.candelas.begin(),
                    p.candelas.begin() + static_cast<std::ptrdiff_t>(p.vertical.size()));
}

bool ascend(const std::vector<double>& angles) {
  return std::ranges::adjacent_find(angles, std::greater_equal<>()) == angles.end();
}

// Returns what is wrong with the range of the angles; an empty text if nothing is.
std::string_view wrong_range(const Profile& p) {
  const double v0 = p.vertical.front(), v1 = p.vertical.back(), h0 = p.horizontal.front(),
               h1 = p.horizontal.back();
  if (p.vertical.size() < 2) return "there is only one vertical angle";
  if (p.type != 1 && p.horizontal.size() < 2)
    return "there is only one horizontal angle, in a file of type A or B";
  if (p.type != 1)
    return v0 < -90 || v1 > 90 || h0 < -90 || h1 > 90 ? "an angle is not within -90 to 90 degrees" : "";
  if (v0 < 0 || v1 > 180) return "a vertical angle is not within 0 to 180 degrees";
  if (h0 < 0 || h1 > 360) return "a horizontal angle is not within 0 to 360 degrees";
  const bool known = h0 == h1 || (h0 == 0 && (h1 == 90 || h1 == 180 || h1 == 360)) || (h0 == 90 && h1 == 270);
  return known ? ""
               : "the horizontal angles are neither one alone nor from 0 to 90, 180 or 360, nor from 90 to "
                 "270 degrees";
}

}  // namespace

Result<ImageData> decode_ies(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  std::size_t line = 1;
  const auto broken = [&](std::string_view problem, std::size_t where) {
    return BrokenImage{name, "IES file"}(fmt::format("line {}: {}", where, problem));
  };
  if (std::uint64_t{kSide} * kSide > max_pixels) return too_many_pixels(name, kSide, kSide, max_pixels);
  std::string_view rest = as_text(file);
  const char line_end = rest.find('\n') == rest.npos ? '\r' : '\n';
  std::optional<std::string_view> tilt;
  for (; !tilt; ++line) {
    if (rest.empty() || line > kMostLines) return broken("no line begins with TILT=", line);
    tilt = tilt_of(next_line(rest, line_end));
  }
  Numbers numbers(rest, line, line_end);
  const auto stopped = [&](std::string_view what) {
    return broken(fmt::format("{}: {}", what, numbers.refused()), numbers.line());
  };
  const auto count = [&](std::size_t most) -> std::optional<std::size_t> {
    const auto n = numbers.next();
    if (!n || !(*n >= 1 && *n <= static_cast<double>(most)) || *n != std::floor(*n)) return std::nullopt;
    return static_cast<std::size_t>(*n);
  };
  if (is_word(*tilt, "INCLUDE")) {
    // How the output depends on the lamp's tilt: it is not tilted.
    if (!numbers.next()) return stopped("the lamp's geometry");
    const auto pairs = count(kMostAngles);
    if (!pairs) return stopped("the number of tilt angles");
    for (std::size_t i = 0; i < 2 * *pairs; ++i)
      if (!numbers.next()) return stopped("tilt angles");
  } else if (!is_word(*tilt, "NONE")) {
    return broken(fmt::format("TILT={}: the file of another tilt table is not read; write TILT=NONE for a "
                              "lamp that is not tilted",
                              tilt->substr(0, 40)),
                  line - 1);
  }
  Profile p;
  if (!numbers.next()) return stopped("the number of lamps");
  if (!numbers.next()) return stopped("lumens of a lamp");
  auto factor = numbers.next();
  if (!factor) return stopped("the candela multiplier");
  const auto verticals = count(kMostAngles);
  if (!verticals) return stopped("the number of vertical angles, 1 to 3601");
  const auto horizontals = count(kMostAngles);
  if (!horizontals) return stopped("the number of horizontal angles, 1 to 3601");
  const auto type = count(3);
  if (!type) return stopped("the photometric type, 1 to 3");
  p.type = static_cast<int>(*type);
  for (const char* what : {"units", "width", "length", "height"})
    if (!numbers.next()) return stopped(what);
  for (const char* what : {"the ballast factor", "the ballast-lamp factor"}) {
    const auto n = numbers.next();
    if (!n) return stopped(what);
    *factor *= *n;
  }
  if (!numbers.next()) return stopped("input watts");
  for (auto* angles : {&p.vertical, &p.horizontal}) {
    const bool first = angles == &p.vertical;
    for (std::size_t i = 0; i < (first ? *verticals : *horizontals); ++i) {
      const auto n = numbers.next();
      if (!n) return stopped(first ? "vertical angles" : "horizontal angles");
      angles->push_back(*n);
    }
    if (!ascend(*angles))
      return broken(first ? "the vertical angles do not ascend" : "the horizontal angles do not ascend",
                    numbers.line());
  }
  const std::size_t after_angles = numbers.line();
  const std::size_t values = *verticals * *horizontals;
  for (std::size_t i = 0; i < values; ++i) {
    const auto n = numbers.next();
    if (!n) return stopped(fmt::format("{} of {} intensities", i, values));
    const double candela = *n * *factor;
    if (!(candela >= 0 && candela <= 1e30))
      return broken(fmt::format("an intensity is {} candela", candela), numbers.line());
    p.candelas.push_back(candela);
  }
  if (numbers.next())
    return broken(fmt::format("more than {} intensities: {} vertical times {} horizontal angles", values,
                              *verticals, *horizontals),
                  numbers.line());
  close_circle(p);
  if (const auto wrong = wrong_range(p); !wrong.empty()) return broken(wrong, after_angles);
  ImageData out;
  out.width = out.height = kSide;
  out.channels = 1;
  out.f32.reserve(std::size_t{kSide} * kSide);
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x)
      out.f32.push_back(static_cast<float>(intensity_at(p, (x + .5) / kSide, (y + .5) / kSide)));
  const double brightest = *std::ranges::max_element(p.candelas);
  if (double{*std::ranges::max_element(out.f32)} < brightest / 2)
    return broken(fmt::format("its beam is too narrow for the image of {} x {} directions that is made of it",
                              kSide, kSide),
                  after_angles);
  return out;
}

}  // namespace ls
