#include "formats/xml/transform_element.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/xml/values.h"

namespace ls::scene {
namespace {

// Tolerance of lengths that should be 1, so that files may give unit vectors with three decimals.
constexpr double kUnitSlack = 1e-3;

Vec3 normalized(const Vec3& v) {
  // The vector is scaled first, so that squares of tiny or huge components neither underflow nor overflow.
  const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  const Vec3 s{v[0] / largest, v[1] / largest, v[2] / largest};
  const double n = std::sqrt(dot(s, s));
  return {s[0] / n, s[1] / n, s[2] / n};
}
bool is_zero(const Vec3& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

Transform translation(const Vec3& d) { return {{1, 0, 0, d[0], 0, 1, 0, d[1], 0, 0, 1, d[2], 0, 0, 0, 1}}; }
Transform scaling(const Vec3& s) { return {{s[0], 0, 0, 0, 0, s[1], 0, 0, 0, 0, s[2], 0, 0, 0, 0, 1}}; }

// Returns the right-handed rotation about `axis`, by Rodrigues' formula.
Transform rotation(const Vec3& axis, double degrees) {
  const Vec3 a = normalized(axis);
  const double angle = degrees * (std::numbers::pi / 180), s = std::sin(angle), c = std::cos(angle),
               t = 1 - c;
  return {{t * a[0] * a[0] + c, t * a[0] * a[1] - s * a[2], t * a[0] * a[2] + s * a[1], 0,
           t * a[0] * a[1] + s * a[2], t * a[1] * a[1] + c, t * a[1] * a[2] - s * a[0], 0,
           t * a[0] * a[2] - s * a[1], t * a[1] * a[2] + s * a[0], t * a[2] * a[2] + c, 0, 0, 0, 0, 1}};
}

// Returns a unit vector perpendicular to the unit vector n: the first of the two in Duff et al. 2017,
// "Building an Orthonormal Basis, Revisited".
Vec3 some_up(const Vec3& n) {
  const double sign = std::copysign(1.0, n[2]), a = -1 / (sign + n[2]);
  return {1 + sign * n[0] * n[0] * a, sign * n[0] * n[1] * a, -sign * n[0]};
}

// Returns the matrix from camera space to world: +z points from origin to target, +x to the left.
std::optional<Transform> look_at(const Vec3& origin, const Vec3& target, Vec3 up) {
  const Vec3 way = minus(target, origin);
  if (is_zero(way)) return std::nullopt;
  const Vec3 dir = normalized(way);
  if (is_zero(up)) up = some_up(dir);
  const Vec3 across = cross(up, dir);
  if (is_zero(across)) return std::nullopt;
  const Vec3 left = normalized(across);
  return of_columns(left, cross(dir, left), dir, origin);
}

std::optional<Vec3> read_triple(const Element& e, std::string_view attribute, Report& report) {
  const auto numbers = parse_numbers(e.get(attribute), 3);
  if (numbers && numbers->size() == 3) return Vec3{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  return report.refuse(value_place(e, attribute), fmt::format("'{}' of <{}> wants three numbers, not \"{}\"",
                                                              attribute, e.tag, e.get(attribute)));
}

std::optional<Transform> read_lookat(const Element& e, Report& report) {
  const auto origin = read_triple(e, "origin", report), target = read_triple(e, "target", report);
  const auto up = e.find("up") ? read_triple(e, "up", report) : Vec3{0, 0, 0};
  if (!origin || !target || !up) return std::nullopt;
  auto t = look_at(*origin, *target, *up);
  if (!t)
    report.error(e.at,
                 "<lookat> has no direction: target and origin are the same, or up points along the view");
  return t;
}

std::optional<Transform> read_matrix(const Element& e, Report& report) {
  const auto numbers = parse_numbers(e.get("value"), 16);
  if (!numbers || (numbers->size() != 9 && numbers->size() != 16))
    return report.refuse(value_place(e, "value"), "<matrix> wants 9 or 16 numbers, row by row");
  Transform t;
  const std::size_t n = numbers->size() == 16 ? 4 : 3;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) t.m[4 * i + j] = (*numbers)[n * i + j];
  if (t.m[12] != 0 || t.m[13] != 0 || t.m[14] != 0 || t.m[15] != 1)
    return report.refuse(value_place(e, "value"),
                         "the last row of a <matrix> must be 0 0 0 1: perspective is no placement");
  return t;
}

std::optional<Transform> read_rotate(const Element& e, Report& report) {
  const auto axis = read_xyz(e, 0, report);
  const auto angle = parse_number(e.get("angle"));
  if (!angle)
    report.error(value_place(e, "angle"),
                 fmt::format("'angle' of <rotate> wants a number of degrees, not \"{}\"", e.get("angle")));
  if (!axis || !angle) return std::nullopt;
  if (is_zero(*axis))
    return report.refuse(e.at, "<rotate> needs an axis: x=\"1\", y=\"1\", z=\"1\" or a mixture");
  // Mitsuba 3 does not normalise the axis, so that a length other than 1 gives a shear, which nobody intends.
  const double length = std::sqrt(dot(*axis, *axis));
  if (std::abs(length - 1) > kUnitSlack)
    report.warning(e.at, fmt::format("this axis has the length {:.4g}: only its direction is used. Mitsuba 3 "
                                     "shears unless the length is 1",
                                     length));
  return rotation(*axis, *angle);
}

std::optional<Transform> read_step(const Element& e, Report& report) {
  if (e.tag == "lookat") return read_lookat(e, report);
  if (e.tag == "matrix") return read_matrix(e, report);
  if (e.tag == "rotate") return read_rotate(e, report);
  const bool scales = e.tag == "scale";
  const auto v = read_xyz(e, scales ? 1 : 0, report);
  if (!v) return std::nullopt;
  return scales ? scaling(*v) : translation(*v);
}

}  // namespace

Transform read_transform(const Element& e, Report& report) {
  Transform t;
  for (const Element& step : e.children) {
    const auto s = read_step(step, report);
    if (!s) continue;
    t = multiply(*s, t);
    if (std::any_of(t.m.begin(), t.m.end(), [](double x) { return !std::isfinite(x); })) {
      report.error(step.at, "with this step the transform leaves the range of numbers");
      return {};
    }
  }
  return t;
}

std::optional<Vec3> read_xyz(const Element& e, double missing, Report& report) {
  static constexpr std::string_view kAxes[] = {"x", "y", "z"};
  if (e.find("value")) {
    if (e.find("x") || e.find("y") || e.find("z"))
      return report.refuse(e.at, fmt::format("<{}> gives both value and x, y, z", e.tag));
    const auto numbers = parse_numbers(e.get("value"), 3);
    if (numbers && numbers->size() == 1) return Vec3{(*numbers)[0], (*numbers)[0], (*numbers)[0]};
    if (numbers && numbers->size() == 3) return Vec3{(*numbers)[0], (*numbers)[1], (*numbers)[2]};
    return report.refuse(value_place(e, "value"),
                         fmt::format("<{}> wants one or three numbers, not \"{}\"", e.tag, e.get("value")));
  }
  Vec3 v{missing, missing, missing};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!e.find(kAxes[i])) continue;
    const auto x = parse_number(e.get(kAxes[i]));
    if (!x)
      return report.refuse(value_place(e, kAxes[i]), fmt::format("'{}' of <{}> wants a number, not \"{}\"",
                                                                 kAxes[i], e.tag, e.get(kAxes[i])));
    v[i] = *x;
  }
  return v;
}

Span value_place(const Element& e, std::string_view attribute) {
  const Attribute* a = e.find(attribute);
  if (!a) return e.at;
  Span s = a->value_at;
  if (s.length == 0) s.length = 1;
  return s;
}

}  // namespace ls::scene
