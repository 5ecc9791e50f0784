#include "formats/pbrt/cloud.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/base/digest.h"
#include "formats/pbrt/media_parts.h"

namespace ls::scene::pbrt {
namespace {

constexpr int kPeriod = 256;

// The permutation of Perlin's noise (see noise() in cloud.h).
constexpr std::array<std::uint8_t, kPeriod> kPermutation{
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

// The gradients, indexed by a hash with 16 values: the 12 directions from the centre of a cube to the middles
// of its edges, four of which occur twice. This is pbrt's list. Perlin's has another order, and repeats (0,
// -1, 1) instead of (0, 1, -1).
constexpr std::int8_t kGradients[16][3] = {
    {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
    {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {-1, 1, 0}, {0, 1, -1}, {0, -1, -1}};

std::size_t permuted(std::size_t i) { return kPermutation[i % kPeriod]; }

// Perlin's weight: its first and second derivatives are 0 at both ends of [0, 1].
double weight(double t) { return t * t * t * (t * (6 * t - 15) + 10); }

double between(double t, double a, double b) { return a + t * (b - a); }

}  // namespace

double noise(const Vec3& p) {
  std::array<std::size_t, 3> cell{};
  std::array<double, 3> in{}, w{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(p[i])) return 0;
    const double floor = std::floor(p[i]), turn = std::fmod(floor, kPeriod);
    cell[i] = static_cast<std::size_t>(turn < 0 ? turn + kPeriod : turn);
    in[i] = p[i] - floor;
    w[i] = weight(in[i]);
  }
  const auto corner = [&](std::size_t x, std::size_t y, std::size_t z) {
    const auto& g = kGradients[permuted(permuted(permuted(cell[0] + x) + cell[1] + y) + cell[2] + z) %
                               std::size(kGradients)];
    return g[0] * (in[0] - static_cast<double>(x)) + g[1] * (in[1] - static_cast<double>(y)) +
           g[2] * (in[2] - static_cast<double>(z));
  };
  const auto edge = [&](std::size_t y, std::size_t z) {
    return between(w[0], corner(0, y, z), corner(1, y, z));
  };
  return between(w[2], between(w[1], edge(0, 0), edge(1, 0)), between(w[1], edge(0, 1), edge(1, 1)));
}

Vec3 noise_slope(const Vec3& p) {
  constexpr double kStep = 0.01;
  const double here = noise(p);
  Vec3 slope;
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3 q = p;
    q[i] += kStep;
    slope[i] = (noise(q) - here) / kStep;
  }
  return slope;
}

namespace {

// Constants of pbrt's formula. Each octave of noise has half the strength and kFiner times the frequency of
// the octave before.
constexpr double kFiner = 1.99;
constexpr int kOctaves = 5;
// Number of times that a point is moved by the gradient of noise, and the frequency of the first such noise.
constexpr int kWarps = 2;
constexpr double kWarpFrequency = 10;

Vec3 plus(const Vec3& a, double x, const Vec3& b) {
  return Vec3{{a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]}};
}
Vec3 times(double x, const Vec3& a) { return Vec3{{x * a[0], x * a[1], x * a[2]}}; }

// Returns how many cells the finest noise has per unit of length. The finest noise is the last octave or, if
// noise also moves the points (wispiness > 0), the last noise that does so.
double cells_per_unit(const Cloud& cloud) {
  const double octaves = std::pow(kFiner, kOctaves - 1);
  return std::abs(cloud.frequency) *
         (cloud.wispiness > 0 ? std::max(octaves, kWarpFrequency * kFiner) : octaves);
}

// Least number of grid nodes per unit of height (y). The density decreases with height, piecewise linearly
// with corners at the heights 0, 1/2 and 1; so many nodes resolve this.
constexpr double kLeastPerHeight = 64;

// Returns the sides of a grid that samples the cloud's density with `per_cell` nodes along an axis per cell
// of the finest noise (in y also with at least kLeastPerHeight nodes per unit of length). nullopt: the grid
// would have more than `most` nodes.
std::optional<CloudNodes> nodes_of(const Cloud& cloud, double per_cell, std::size_t most) {
  CloudNodes out;
  out.per_cell = per_cell;
  double count = 1;
  std::array<double, 3> sides{};
  for (std::size_t i = 0; i < 3; ++i) {
    double per_unit = per_cell * cells_per_unit(cloud);
    if (i == 1) per_unit = std::max(per_unit, kLeastPerHeight);
    sides[i] = 1 + std::max(1., std::ceil((cloud.high[i] - cloud.low[i]) * per_unit));
    count *= sides[i];
  }
  if (!(count <= static_cast<double>(most))) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) out.sides[i] = static_cast<int>(sides[i]);
  return out;
}

}  // namespace

double density_at(const Cloud& cloud, const Vec3& p) {
  if (p[1] <= 0) return 1;  // for any noise the sum below is at least 1, and is clamped to 1
  Vec3 q = times(cloud.frequency, p);
  if (cloud.wispiness > 0) {
    double strength = 0.05 * cloud.wispiness, frequency = kWarpFrequency;
    for (int i = 0; i < kWarps; ++i) {
      q = plus(q, strength, noise_slope(times(frequency, q)));
      strength /= 2;
      frequency *= kFiner;
    }
  }
  double sum = 0, strength = 0.5, frequency = 1;
  for (int i = 0; i < kOctaves; ++i) {
    sum += strength * noise(times(frequency, q));
    strength /= 2;
    frequency *= kFiner;
  }
  const double thinned = std::clamp((1 - p[1]) * 4.5 * cloud.density * sum, 0., 1.);
  return std::clamp(thinned + 2 * std::max(0., 0.5 - p[1]), 0., 1.);
}

std::optional<CloudNodes> nodes_for(const Cloud& cloud, std::size_t most) {
  if (auto wanted = nodes_of(cloud, kWantedPerCell, most)) return wanted;
  std::optional<CloudNodes> best = nodes_of(cloud, kLeastPerCell, most);
  if (!best) return std::nullopt;
  double low = kLeastPerCell, high = kWantedPerCell;
  for (int i = 0; i < 20; ++i) {
    const double middle = (low + high) / 2;
    if (auto some = nodes_of(cloud, middle, most)) {
      best = some;
      low = middle;
    } else {
      high = middle;
    }
  }
  return best;
}

MadeGrid cloud_grid(const Cloud& cloud, const CloudNodes& nodes) {
  MadeGrid grid{nodes.sides, 1, {}};
  grid.values.reserve(nodes.count());
  const auto place = [&](std::size_t axis, int i) {
    const double t = static_cast<double>(i) / (nodes.sides[axis] - 1);
    return cloud.low[axis] + t * (cloud.high[axis] - cloud.low[axis]);
  };
  for (int z = 0; z < nodes.sides[2]; ++z)
    for (int y = 0; y < nodes.sides[1]; ++y)
      for (int x = 0; x < nodes.sides[0]; ++x)
        grid.values.push_back(
            static_cast<float>(density_at(cloud, Vec3{{place(0, x), place(1, y), place(2, z)}})));
  return grid;
}

namespace {

// Largest number of nodes of one grid, and of all grids of clouds in a file.
constexpr std::size_t kMaxNodes = std::size_t{1} << 24, kMaxNodesOfAll = std::size_t{1} << 25;

// Returns the name of the grid's file. The name contains a digest of the formula's parameters and the grid's
// size, not of the grid's values, whose computation takes seconds. So a grid that exists already, such as one
// that was sent to a coordinator, is found without computing it again.
std::string name_of(const Cloud& c, const CloudNodes& nodes) {
  const std::string formula =
      fmt::format("cloud {} {} {} {} {} {}", c.density, c.wispiness, c.frequency, fmt::join(c.low, " "),
                  fmt::join(c.high, " "), fmt::join(nodes.sides, " "));
  return fmt::format("cloud-{}.vol", sha256(formula).hex().substr(0, 16));
}

// Returns the grid's file. Empty: it would be too large or could not be kept, which was reported.
std::string file_of(MediumSource& m, const Cloud& cloud) {
  auto& made = m.t.clouds;
  const auto same = std::find_if(made.begin(), made.end(), [&](const auto& c) { return c.cloud == cloud; });
  if (same != made.end()) return same->file;
  std::size_t used = 0;
  for (const MadeCloud& c : made) used += c.nodes;
  const std::size_t most = std::min(kMaxNodes, kMaxNodesOfAll - used);
  const auto nodes = nodes_for(cloud, most);
  if (!nodes) {
    m.wrong(m.p.at(), fmt::format("{} is too fine for its box: its grid would have more than {} nodes (of {} "
                                  "for all clouds) with {} in a cell of its finest noise; lower its "
                                  "frequency, make its box smaller, or give a file of \"nanovdb\"",
                                  m.p.title(), most, kMaxNodesOfAll, kLeastPerCell));
    return {};
  }
  if (nodes->per_cell < kWantedPerCell)
    m.t.warn_once(
        m.p.at(),
        fmt::format("a \"cloud\" is a grid here; of {} x {} x {} nodes this one has {:.1f} along a cell of "
                    "its finest noise, where {} would be more exact",
                    nodes->sides[0], nodes->sides[1], nodes->sides[2], nodes->per_cell, kWantedPerCell));
  const std::string file = name_of(cloud, *nodes);
  if (!m.t.assets.find(file)) {
    if (!m.t.assets.keeps()) {
      m.wrong(m.p.at(), fmt::format("the grid of {} is a file \"{}\", which `lightshaft submit` sends along",
                                    m.p.title(), file));
      return {};
    }
    if (const auto kept = keep_made(m.t.assets, cloud_grid(cloud, *nodes), file); !kept) {
      m.wrong(m.p.at(), kept.error().message);
      return {};
    }
  }
  made.push_back({cloud, nodes->count(), file});
  return file;
}

}  // namespace

bool cloud(MediumSource& m, Element& out) {
  const Coefficients c = coefficients(m);
  Cloud cloud;
  cloud.density = m.p.number("density", cloud.density);
  cloud.wispiness = m.p.number("wispiness", cloud.wispiness);
  cloud.frequency = m.p.number("frequency", cloud.frequency);
  Box box;
  if (!read_box(m, box)) return false;
  cloud.low = box.low;
  cloud.high = box.high;
  add_albedo(m, out, c.albedo);
  add_extinction(m, out, c.extinction);
  const std::string file = file_of(m, cloud);
  if (file.empty()) return false;
  add_volume(m, out, "sigma_t", file, box, Filling::nodes);
  return true;
}

}  // namespace ls::scene::pbrt
