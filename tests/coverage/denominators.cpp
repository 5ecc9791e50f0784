#include "tests/coverage/denominators.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "core/image/error/error_estimate.h"

namespace ls::test {
namespace {

constexpr int kDarkSide = 32, kReach = 2;
constexpr std::size_t kPixels = kDarkSide * kDarkSide;
constexpr double kWeightFloor = 0.01;

using Value = std::function<double(int x, int y)>;

struct Picture {
  const char* name;
  Value value;
};

const Picture kPictures[] = {
    {"black", [](int, int) { return 0.; }},
    {"dark, .02", [](int, int) { return .02; }},
    {"dark, .1", [](int, int) { return .1; }},
    {"grey, .5", [](int, int) { return .5; }},
    {"dark ramp, 0 to .2", [](int x, int) { return .2 * x / kDarkSide; }},
    {"edge of 1 and 0", [](int x, int) { return x < kDarkSide / 2 ? 1. : 0.; }},
    {"checks of .8 and .05", [](int x, int y) { return (x / 4 + y / 4) % 2 ? .8 : .05; }},
    {"dots of 5 on .1", [](int x, int y) { return x % 8 == 3 && y % 8 == 3 ? 5. : .1; }},
};

double weight(double m) { return 1 / (m * m + kWeightFloor); }

double neighbours(const std::vector<double>& s, int x, int y) {
  double sum = 0;
  int count = 0;
  for (int j = std::max(0, y - kReach); j <= std::min(kDarkSide - 1, y + kReach); ++j)
    for (int i = std::max(0, x - kReach); i <= std::min(kDarkSide - 1, x + kReach); ++i)
      if (i != x || j != y) sum += s[static_cast<std::size_t>(j * kDarkSide + i)], ++count;
  return sum / count;
}

struct Sums {
  double real = 0, ours = 0, own = 0, neighbours = 0;
};

// Noise as a renderer has it, stronger where it is bright; `strength` of it is that of a half.
Sums trial(const Picture& picture, double strength, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> a(3 * kPixels), b(3 * kPixels), s(kPixels);
  Sums out;
  for (int y = 0; y < kDarkSide; ++y)
    for (int x = 0; x < kDarkSide; ++x) {
      const auto p = static_cast<std::size_t>(y * kDarkSide + x);
      const double m = picture.value(x, y), sigma = strength * (m + .03);
      const double ea = sigma * normal(random), eb = sigma * normal(random);
      for (std::size_t c = 0; c < 3; ++c) a[c * kPixels + p] = m + ea, b[c * kPixels + p] = m + eb;
      s[p] = m + (ea + eb) / 2;
      out.real += (ea + eb) * (ea + eb) / 4 * weight(m) / kPixels;
    }
  for (int y = 0; y < kDarkSide; ++y)
    for (int x = 0; x < kDarkSide; ++x) {
      const auto p = static_cast<std::size_t>(y * kDarkSide + x);
      const double d = (a[p] - b[p]) * (a[p] - b[p]) / 4 / kPixels;
      out.own += d * weight(s[p]);
      out.neighbours += d * weight(neighbours(s, x, y));
    }
  out.ours = image_error(estimate_error({kDarkSide, kDarkSide, a, b}, 64)).relmse;
  return out;
}

}  // namespace

std::vector<DenominatorRow> measure_denominators(int trials) {
  std::vector<DenominatorRow> rows;
  std::mt19937_64 random(20);
  for (const Picture& picture : kPictures)
    for (const double strength : {.05, .3, 1.}) {
      Sums all;
      Quotient quotient;
      for (int i = 0; i < trials; ++i) {
        const Sums t = trial(picture, strength, random);
        quotient.add(t.ours, t.real);
        all.real += t.real, all.own += t.own, all.neighbours += t.neighbours;
      }
      rows.push_back(
          {picture.name, all.real / trials, quotient.ratio(), all.own / all.real, all.neighbours / all.real});
    }
  return rows;
}

std::string denominator_line(const DenominatorRow& r) {
  return fmt::format("| {} | {:.2g} | {:.3f} +- {:.3f} | {:.3f} | {:.3f} |", r.picture, r.relmse,
                     r.ours.value, r.ours.sigma, r.own, r.neighbours);
}

}  // namespace ls::test
