// Where on the film and on the lens a camera's rays begin.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/chi_square.h"
#include "tests/support/jacobian.h"
#include "worker/render/camera/camera.h"
#include "worker/render/math/random.h"

namespace ls::render {
namespace {

constexpr int kFilmSamples = 100000;

struct Filter {
  std::string name;
  ReconstructionFilter filter;
  double radius;
  std::function<double(double)> value;  // of any scale
};
std::vector<Filter> filters() {
  std::vector<Filter> all;
  for (const double r : {.5, 2.})
    all.push_back({fmt::format("box {}", r), BoxFilter{r}, r, [](double) { return 1.; }});
  for (const double r : {1., 3.})
    all.push_back({fmt::format("tent {}", r), TentFilter{r}, r,
                   [=](double x) { return std::max(0., 1 - std::abs(x) / r); }});
  for (const double s : {.25, .5, 2.})
    all.push_back({fmt::format("gaussian {}", s), GaussianFilter{s}, 4 * s, [=](double x) {
                     const double edge = std::exp(-8.);
                     return std::max(0., std::exp(-x * x / (2 * s * s)) - edge);
                   }});
  return all;
}
double integral(const Filter& f, double a, double b) {
  constexpr int kParts = 200;
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    const double x0 = a + (b - a) * i / kParts, h = (b - a) / kParts;
    sum += h / 6 * (f.value(x0) + 4 * f.value(x0 + h / 2) + f.value(x0 + h));
  }
  return sum;
}

Camera lens() {
  Sensor s;
  s.aperture_radius = .25;
  s.focus_distance = 5;
  return Camera(s, {64, 48}, {0, 0, 0}, 1);
}
// The point of the lens of a ray through the middle of the frame, in units of its radius: rays start at the
// near plane, and meet at the focus.
V3d lens_point(const Camera& c, const V2& u) {
  const CameraRay ray = c.ray(32, 24, u);
  const V3d o(ray.o), d(ray.d);
  return (o - d * (o.z / d.z)) / .25;
}

TEST(Film, FilmAndLensSamplesFollowTheirDensity) {
  test::ChiSquareTally tally("sampling/film");
  for (const Filter& f : filters()) {
    constexpr int kCells = 80;
    std::vector<double> expected, got(kCells, 0);
    const double all = integral(f, -f.radius, f.radius), width = 2 * f.radius / kCells;
    for (int i = 0; i < kCells; ++i)
      expected.push_back(kFilmSamples * integral(f, -f.radius + i * width, -f.radius + (i + 1) * width) /
                         all);
    RandomStream r(51);
    const PixelFilter sampled(f.filter);
    for (int i = 0; i < kFilmSamples; ++i) {
      const double x = sampled.offset(r.uniform());
      ++got[static_cast<std::size_t>(std::clamp(static_cast<int>((x + f.radius) / width), 0, kCells - 1))];
    }
    tally.expect(f.name, expected, got);
  }
  // Cells of equal area: rings by the square of the radius, and sectors.
  constexpr int kRings = 10, kSectors = 16;
  std::vector<double> expected(kRings * kSectors, double{kFilmSamples} / (kRings * kSectors)),
      got(expected.size(), 0);
  const Camera camera = lens();
  RandomStream r(52);
  for (int i = 0; i < kFilmSamples; ++i) {
    const float u = r.uniform(), v = r.uniform();
    const V3d p = lens_point(camera, {u, v});
    const double turn = std::atan2(p.y, p.x) / (2 * M_PI);
    const int ring = std::min(kRings - 1, static_cast<int>((p.x * p.x + p.y * p.y) * kRings)),
              sector = std::min(kSectors - 1, static_cast<int>((turn < 0 ? turn + 1 : turn) * kSectors));
    ++got[static_cast<std::size_t>(ring * kSectors + sector)];
  }
  tally.expect("thin lens", expected, got);
  tally.close();
}

TEST(Film, SamplingJacobianIsOneOverTheDensity) {
  for (const Filter& f : filters()) {
    const PixelFilter sampled(f.filter);
    const double all = integral(f, -f.radius, f.radius);
    // A table of 1024 steps: its slope is the mean over one of them, as a difference over 2^-7 of all hardly
    // notices.
    test::expect_slope(
        f.name, [&](double u) { return sampled.offset(static_cast<float>(u)); },
        [&](double x) { return f.value(x) / all; }, 4e-6 * f.radius);
  }
  const Camera camera = lens();
  test::expect_jacobian(
      "thin lens",
      [&](const V2& u) -> std::optional<test::Mapped> {
        return test::Mapped{lens_point(camera, u), 1 / M_PI};
      },
      0x1p-20);  // of the lens's radius: the focus is 20 of them away, and each ray's direction rounded
}

}  // namespace
}  // namespace ls::render
