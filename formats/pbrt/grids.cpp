// Translates grid media whose values are in the scene's text.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "formats/pbrt/media_parts.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

constexpr int kMaxSide = 4096;
constexpr std::size_t kMaxVoxels = std::size_t{1} << 24;  // with the layer that is added around the grid

std::size_t product(const std::array<int, 3>& sides) {
  return std::size_t(sides[0]) * std::size_t(sides[1]) * std::size_t(sides[2]);
}

// Reads nx, ny and nz, the numbers of voxels along each axis. Returns false if they are out of range, which
// was reported.
bool read_sides(MediumSource& m, std::array<int, 3>& sides) {
  for (std::size_t i = 0; i < 3; ++i) {
    sides[i] = m.p.integer(std::array{"nx", "ny", "nz"}[i], 1);
    if (sides[i] < 1 || sides[i] > kMaxSide)
      return m.wrong(m.p.at(), fmt::format("{} has {} values along a side; 1 to {} are read", m.p.title(),
                                           sides[i], kMaxSide));
  }
  if (product({sides[0] + 2, sides[1] + 2, sides[2] + 2}) > kMaxVoxels)
    return m.wrong(m.p.at(), fmt::format("{} has more than {} voxels: give a file of \"nanovdb\"",
                                         m.p.title(), kMaxVoxels));
  return true;
}

// Checks that the parameter, if it is given, has `channels` numbers per voxel, none of them above kLargest
// in magnitude.
bool fits(MediumSource& m, const Param* p, int channels, const std::array<int, 3>& sides) {
  const std::size_t wanted = std::size_t(channels) * product(sides);
  if (!p) return true;
  // With this limit, sums and products of two values stay within the range of float32, the type of stored
  // grids.
  constexpr double kLargest = 1e18;
  const auto large =
      std::find_if(p->numbers.begin(), p->numbers.end(), [](double x) { return !(std::abs(x) <= kLargest); });
  if (large != p->numbers.end())
    return m.wrong(p->at, fmt::format("'{}' has the value {}, beyond {}", p->name, *large, kLargest));
  if (p->numbers.size() == wanted) return true;
  return m.wrong(p->at, fmt::format("'{}' has {} numbers, but {}nx * ny * nz is {}", p->name,
                                    p->numbers.size(), channels == 1 ? "" : "3 * ", wanted));
}

// Returns a grid with the values value(voxel, channel), and around it one more layer of voxels of the value
// `beyond`. In pbrt values are at the centres of voxels and 0 outside the grid, so interpolated values fall
// towards 0 over the last half voxel within the box. The added layer has the same effect here.
template <class F>
MadeGrid padded(const std::array<int, 3>& sides, int channels, F value, float beyond = 0) {
  MadeGrid g{{sides[0] + 2, sides[1] + 2, sides[2] + 2}, channels, {}};
  const std::size_t c = std::size_t(channels);
  g.values.assign(product(g.sides) * c, beyond);
  std::size_t from = 0;
  for (int z = 0; z < sides[2]; ++z)
    for (int y = 0; y < sides[1]; ++y)
      for (int x = 0; x < sides[0]; ++x, ++from) {
        const std::size_t to =
            ((std::size_t(z) + 1) * std::size_t(g.sides[1]) + std::size_t(y) + 1) * std::size_t(g.sides[0]) +
            std::size_t(x) + 1;
        for (std::size_t k = 0; k < c; ++k) g.values[to * c + k] = static_cast<float>(value(from, k));
      }
  return g;
}

// Translates the emission of a "uniformgrid".
class GridLight {
 public:
  GridLight(MediumSource& m, const std::array<int, 3>& sides, const Box& box)
      : m_(m), sides_(sides), box_(box) {}

  bool run(Element& out) {
    const Param *colour = m_.p.take("Le"), *temperature = m_.p.take("temperature");
    scales_ = m_.p.take("Lescale");
    if (colour && temperature)
      return m_.wrong(temperature->at,
                      fmt::format("{} gives Le and temperature: leave one of them out", m_.p.title()));
    if (!fits(m_, temperature, 1, sides_) || !fits(m_, scales_, 1, sides_)) return false;
    if (temperature) return of_temperature(out, *temperature);
    for (const char* name : {"temperaturescale", "temperatureoffset", "temperaturecutoff"}) m_.p.take(name);
    return !colour || of_colour(out, *colour);
  }

 private:
  // Adds factor(channel) times Lescale as a volume. If the file gives no Lescale, pbrt uses a grid of a
  // single voxel with the value 1 (GridMedium::Create). Like every grid it falls to 0 half a voxel outside
  // the box: it is 1 in the middle of the box, 1/2 in the middle of a face, and 1/8 in a corner.
  template <class F>
  bool add_scales(Element& out, const char* name, int channels, F factor) {
    const std::array<int, 3> sides = scales_ ? sides_ : std::array{1, 1, 1};
    const MadeGrid grid = padded(sides, channels, [&](std::size_t i, std::size_t k) {
      return (scales_ ? scales_->numbers[i] : 1) * factor(k);
    });
    return add_grid(m_, out, name, grid, box_);
  }

  bool of_colour(Element& out, const Param& given) {
    const auto c = light_colour(m_.t, given);
    if (!c) return false;
    if (all_zero(*c)) return true;
    const bool grey = is_grey(*c);
    add(out, "emission_scale", m_.t.exposure() * (grey ? (*c)[0] : 1), m_.p.at());
    return add_scales(out, "source_radiance", grey ? 1 : 3,
                      [&](std::size_t k) { return grey ? 1 : (*c)[k]; });
  }

  bool of_temperature(Element& out, const Param& given) {
    const MadeGrid grid = padded(sides_, 1, [&](std::size_t i, std::size_t) { return given.numbers[i]; });
    return add_black_bodies(m_, out, 1) && add_grid(m_, out, "temperature", grid, box_) &&
           add_scales(out, "emission_weight", 1, [](std::size_t) { return 1; });
  }

  MediumSource& m_;
  const std::array<int, 3> sides_;
  const Box box_;
  const Param* scales_ = nullptr;
};

// The coefficients sigma_a and sigma_s of an "rgbgrid", one RGB value per voxel. As in pbrt
// (RGBGridMedium::SamplePoint), a coefficient that the file does not give is 1 everywhere, and one that it
// gives is 0 outside the grid.
class Colours {
 public:
  Colours(Translation& t, const Param* absorption, const Param* scattering, const std::array<int, 3>& sides)
      : absorption_(with_border(t, absorption, sides)), scattering_(with_border(t, scattering, sides)) {}

  MadeGrid extinction() const {
    MadeGrid sum = absorption_;
    for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += scattering_.values[i];
    return sum;
  }
  // Returns the albedo of each channel if it is the same in all voxels whose extinction is above 0. The
  // comparison allows for rounding: the numbers in the file may be rounded products of a density and a
  // colour.
  std::optional<Rgb> one_albedo() const {
    constexpr double kRounding = 1e-5;
    Rgb all{};
    std::array<bool, 3> is_known{};
    for (std::size_t i = 0; i < absorption_.values.size(); ++i) {
      const double sum = extinction(i);
      if (!(sum > 0)) continue;
      const double albedo = scattering_.values[i] / sum;
      if (is_known[i % 3] && !(std::abs(albedo - all[i % 3]) <= kRounding)) return std::nullopt;
      if (!is_known[i % 3]) all[i % 3] = albedo;
      is_known[i % 3] = true;
    }
    return all;
  }
  // A voxel without extinction has no albedo of its own, but takes part in the interpolation: it gets the
  // mean of its neighbours, weighted by their extinction.
  MadeGrid albedo() const {
    MadeGrid g = absorption_;
    std::size_t i = 0;
    for (int z = 0; z < g.sides[2]; ++z)
      for (int y = 0; y < g.sides[1]; ++y)
        for (int x = 0; x < g.sides[0]; ++x)
          for (std::size_t k = 0; k < 3; ++k, ++i)
            g.values[i] = static_cast<float>(extinction(i) > 0 ? scattering_.values[i] / extinction(i)
                                                               : albedo_around({x, y, z}, k));
    return g;
  }

 private:
  static MadeGrid with_border(Translation& t, const Param* p, const std::array<int, 3>& sides) {
    const auto numbers = p ? srgb_numbers(t, *p, RgbOf::matter) : std::vector<double>();
    return padded(
        sides, 3, [&](std::size_t i, std::size_t k) { return p ? numbers[3 * i + k] : 1; }, p ? 0 : 1);
  }
  double extinction(std::size_t i) const {
    return double{absorption_.values[i]} + double{scattering_.values[i]};
  }
  double albedo_around(const std::array<int, 3>& voxel, std::size_t channel) const {
    const std::array<int, 3>& sides = absorption_.sides;
    double scattering = 0, extinct = 0;
    std::array<int, 3> lo{}, hi{};
    for (std::size_t i = 0; i < 3; ++i) {
      lo[i] = std::max(0, voxel[i] - 1);
      hi[i] = std::min(sides[i] - 1, voxel[i] + 1);
    }
    for (int z = lo[2]; z <= hi[2]; ++z)
      for (int y = lo[1]; y <= hi[1]; ++y)
        for (int x = lo[0]; x <= hi[0]; ++x) {
          const std::size_t i =
              3 * ((std::size_t(z) * std::size_t(sides[1]) + std::size_t(y)) * std::size_t(sides[0]) +
                   std::size_t(x)) +
              channel;
          scattering += scattering_.values[i];
          extinct += extinction(i);
        }
    return extinct > 0 ? scattering / extinct : 0;
  }

  const MadeGrid absorption_, scattering_;
};

// Adds the emission of an "rgbgrid", an RGB value per voxel, to the medium's element.
bool add_colours(MediumSource& m, Element& out, const Param& light, const std::array<int, 3>& sides,
                 const Box& box) {
  const double scale = m.p.number("Lescale", 1);
  if (scale == 0) return true;
  add(out, "emission_scale", scale * kPhotometric * m.t.exposure(), m.p.at());
  const auto numbers = srgb_numbers(m.t, light, RgbOf::light);
  const MadeGrid grid = padded(sides, 3, [&](std::size_t i, std::size_t k) { return numbers[3 * i + k]; });
  return add_grid(m, out, "source_radiance", grid, box);
}

}  // namespace

bool read_box(MediumSource& m, Box& box) {
  box.low = m.p.triple("p0", box.low);
  box.high = m.p.triple("p1", box.high);
  for (std::size_t i = 0; i < 3; ++i)
    if (!(box.low[i] < box.high[i]))
      return m.wrong(m.p.at(), fmt::format("{}: p0 is not below p1 along all axes", m.p.title()));
  return true;
}

bool add_grid(MediumSource& m, Element& out, const char* name, const MadeGrid& grid, const Box& box) {
  const auto file = keep_made(m.t.assets, grid);
  if (!file) return m.wrong(m.p.at(), file.error().message);
  Element volume = made("volume", "gridvolume", m.p.at());
  set(volume, "name", name, m.p.at());
  add(volume, "string", "filename", *file, m.p.at());
  add(volume, "boolean", "border", "true", m.p.at());
  Vec3 size;
  for (std::size_t i = 0; i < 3; ++i) size[i] = box.high[i] - box.low[i];
  place(volume, multiply(m.ctm.to, multiply(moved(box.low).to, scaled(size).to)), m.p.at());
  add(out, std::move(volume));
  return true;
}

bool uniform_grid(MediumSource& m, Element& out) {
  const Coefficients c = coefficients(m);
  const Param* density = m.p.take("density");
  if (!density) m.p.missing("density");
  std::array<int, 3> sides{};
  Box box;
  if (!read_sides(m, sides) || !read_box(m, box) || !density || !fits(m, density, 1, sides)) return false;
  add_albedo(m, out, c.albedo);
  add_extinction(m, out, c.extinction);
  const MadeGrid grid = padded(sides, 1, [&](std::size_t i, std::size_t) { return density->numbers[i]; });
  return add_grid(m, out, "sigma_t", grid, box) && GridLight(m, sides, box).run(out);
}

bool rgb_grid(MediumSource& m, Element& out) {
  const Param *a = m.p.take("sigma_a"), *s = m.p.take("sigma_s"), *light = m.p.take("Le");
  if (!a && !s) m.p.missing("sigma_s");
  if (light && !a) m.p.missing("sigma_a");
  std::array<int, 3> sides{};
  Box box;
  if (!read_sides(m, sides) || !read_box(m, box) || (!a && !s) || (light && !a)) return false;
  for (const Param* p : {a, s, light})
    if (!fits(m, p, 3, sides)) return false;
  const Colours colours(m.t, a, s, sides);
  add(out, "scale", m.p.number("scale", 1), m.p.at());
  if (!add_grid(m, out, "sigma_t", colours.extinction(), box)) return false;
  if (const auto albedo = colours.one_albedo()) {
    add_albedo(m, out, *albedo);
  } else {
    m.t.warn_once(m.p.at(),
                  "of an \"rgbgrid\" extinction and albedo are interpolated between voxels, in pbrt "
                  "absorption and scattering");
    if (!add_grid(m, out, "albedo", colours.albedo(), box)) return false;
  }
  if (!light) return m.p.take("Lescale"), true;
  return add_colours(m, out, *light, sides, box);
}

}  // namespace ls::scene::pbrt
