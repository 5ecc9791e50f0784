#include "worker/render/lights/envmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "worker/render/base/work_counters.h"
#include "worker/render/math/equal_area.h"
#include "worker/render/math/transform.h"

namespace ls::render {
namespace {

constexpr double kWords = 0x1p32;
// The largest radiance of a texel. It equals the largest radiance that a sample may have (render_tile.cpp);
// larger samples could not be summed.
constexpr float kLargestTexel = 0x1p96f;
// An element of to_world may differ this much from that of the nearest rotation, for example because the
// matrix was written with six digits.
constexpr double kSlack = 1e-4;

// The orthogonal matrix nearest to t divided by its scale, by Newton's iteration X <- (X + X^-T) / 2 for the
// polar decomposition (Higham 1986). Returns nullopt if t does not scale all directions equally.
std::optional<Affine> rotation_of(const Transform& t) {
  Affine m(t);
  if (!m.invertible()) return std::nullopt;
  const double size = m.vector({1, 0, 0}).length();
  for (double& a : m.a) a /= size;
  Affine x = m;
  // Each iteration doubles the number of correct digits. Two suffice for a matrix that was written with six
  // digits; the others are a reserve.
  for (int round = 0; round < 8; ++round) {
    const Affine inverse = x.inverse();
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) x.a[3 * i + j] = .5 * (x.a[3 * i + j] + inverse.a[3 * j + i]);
  }
  for (std::size_t i = 0; i < 9; ++i)
    if (!(std::abs(x.a[i] - m.a[i]) <= kSlack)) return std::nullopt;
  return x;
}

// Divides the 2^32 random words among shares, in proportion to their sizes. Returns the first word that
// belongs to share i, or 2^32 if the share begins beyond the last word and so has none. before[i] is the sum
// of the sizes of the shares before share i; the last element is the sum of all sizes.
std::uint64_t first_word(const std::vector<double>& before, std::size_t i) {
  return static_cast<std::uint64_t>(std::llround(before[i] / before.back() * kWords));
}

// Samples x in (0, 1) with density proportional to a (1 - x) + b x, from the random number u in (0, 1). It is
// stable if a = b or one of them is 0. The result is never 1: there the density may be 0 and, at a pole of
// the map, the azimuth undefined.
float sample_linear(float a, float b, float u) {
  const float sum = a + b;
  if (!(sum > 0)) return u;
  const float p = a / sum, q = b / sum;
  return std::min(kBelowOne, u / (p + std::sqrt(std::max(0.f, p * p + u * (q - p)))));
}

float lerp(float a, float b, float t) { return a * (1 - t) + b * t; }

Result<void> check_values(std::string_view name, const Texels& t, float scale) {
  for (std::size_t i = 0; i < t.f32.size(); ++i) {
    if (t.f32[i] <= kLargestTexel && t.f32[i] * scale <= kLargestTexel) continue;
    const std::size_t p = i / t.channels;
    return fail(Errc::invalid_argument,
                fmt::format("environment map '{}': the texel at x {}, y {} (from the top left) is {:g} times "
                            "{:g}, more than samples of light may be ({:g})",
                            name, p % t.width, p / t.width, t.f32[i], scale, kLargestTexel));
  }
  return {};
}

}  // namespace

Result<EnvironmentMap> EnvironmentMap::build(std::string_view name, ImageData image, double scale,
                                             const Transform& to_world, SkyMapping mapping) {
  const auto refuse = [](const std::string& why) { return fail(Errc::invalid_argument, why); };
  const std::string size =
      fmt::format("environment map '{}' has {} x {} pixels; ", name, image.width, image.height);
  if (std::uint64_t{image.width} * image.height > kMaxEnvironmentPixels)
    return fail(
        Errc::resource_exhausted,
        size + fmt::format("scale it down to 8192 x 4096 ({} pixels) or less", kMaxEnvironmentPixels));
  if (mapping == SkyMapping::equal_area && image.width != image.height)
    return refuse(size + "an equal-area map is square: if it is in latitude-longitude form, say so");
  if (mapping == SkyMapping::latlong && (image.width < 2 || image.height < 3))
    return refuse(size + "it takes at least 2 x 3");
  const auto turn = rotation_of(to_world);
  if (!turn)
    return refuse(fmt::format(
        "environment map '{}': its to_world may turn and mirror it, not stretch or flatten it", name));
  if (!(scale >= 0 && scale <= double{kLargestTexel}))
    return refuse(
        fmt::format("environment map '{}': its scale is {}, not from 0 to {:g}", name, scale, kLargestTexel));
  auto texels = make_texels(name, std::move(image), /*raw=*/false);
  if (!texels) return tl::unexpected(texels.error());
  EnvironmentMap map;
  map.scale_ = static_cast<float>(scale);
  map.mapping_ = mapping;
  if (auto ok = check_values(name, *texels, map.scale_); !ok) return tl::unexpected(ok.error());
  map.texels_ = std::move(*texels);
  map.frame_ = Frame(V3(turn->vector({1, 0, 0})), V3(turn->vector({0, 1, 0})), V3(turn->vector({0, 0, 1})));
  map.build_table();
  return map;
}

void EnvironmentMap::build_table() {
  const std::uint32_t n = is_square() ? texels_.height : texels_.height - 1;
  rows_.resize(n);
  first_.resize(std::size_t{n} * texels_.width);
  std::vector<double> cells(texels_.width + 1), before(n + 1, 0.);
  for (std::uint32_t j = 0; j < n; ++j) {
    // The height, a difference of cosines, is computed without cancellation as cos a - cos b = 2 sin((a + b)
    // / 2) sin((b - a) / 2).
    rows_[j].top = std::cos(std::numbers::pi * j / n);
    rows_[j].height = is_square() ? 2. / n
                                  : 2 * std::sin(std::numbers::pi * (2. * j + 1) / (2. * n)) *
                                        std::sin(std::numbers::pi / (2. * n));
    before[j + 1] = before[j] + build_row(j, cells) * rows_[j].height;
  }
  const double cell_width = 2 * std::numbers::pi / texels_.width;
  flux_ = before.back() * cell_width * static_cast<double>(scale_);
  if (!(flux_ > 0)) return;
  for (std::uint32_t j = 0; j < n; ++j) {
    const auto first = first_word(before, j), end = first_word(before, j + 1);
    if (static_cast<double>(first) >= kWords) break;
    rows_[j].first = static_cast<std::uint32_t>(first);
    rows_[j].density =
        static_cast<float>(static_cast<double>(end - first) / kWords / (cell_width * rows_[j].height));
    used_rows_ = j + 1;
  }
}

double EnvironmentMap::cell_luminance(std::uint32_t column, std::uint32_t row) const {
  if (is_square()) return luminance(texels_.texel(column, row));
  const Corners c = corners(column, row);
  return .25 * (double{c.l00} + double{c.l10} + double{c.l01} + double{c.l11});
}

// Returns the sum of the luminances of the cells of a row. `before` receives the cumulative sums.
double EnvironmentMap::build_row(std::uint32_t row, std::vector<double>& before) {
  for (std::uint32_t i = 0; i < texels_.width; ++i) before[i + 1] = before[i] + cell_luminance(i, row);
  if (!(before.back() > 0)) return 0;
  for (std::uint32_t i = 0; i < texels_.width; ++i) {
    const auto first = first_word(before, i);
    if (static_cast<double>(first) >= kWords) break;
    first_[std::size_t{row} * texels_.width + i] = static_cast<std::uint32_t>(first);
    rows_[row].used = i + 1;
  }
  return before.back();
}

EnvironmentMap::Corners EnvironmentMap::corners(std::uint32_t x, std::uint32_t y) const {
  const std::uint32_t r = right_of(x);
  return {luminance(texels_.texel(x, y)), luminance(texels_.texel(r, y)), luminance(texels_.texel(x, y + 1)),
          luminance(texels_.texel(r, y + 1))};
}

float EnvironmentMap::cell_share(std::uint32_t row, std::uint32_t cell) const {
  const std::uint32_t used = rows_[row].used;
  if (cell >= used) return 0;
  const std::uint32_t* first = &first_[std::size_t{row} * texels_.width];
  const std::uint64_t end = cell + 1 < used ? first[cell + 1] : std::uint64_t{1} << 32;
  return static_cast<float>(end - first[cell]) * 0x1p-32f;
}

EnvironmentMap::Light EnvironmentMap::at(const V3& direction) const {
  LS_COUNT(environment_map);
  const V3 d = frame_.to_local(direction);
  if (is_square()) return at_square(d);
  const float across = std::atan2(d.x, -d.z) * kInvTwoPi * static_cast<float>(texels_.width) - .5f;
  const float column = std::floor(across), x = across - column;
  auto i = static_cast<std::int64_t>(column);
  if (i < 0) i += texels_.width;
  const auto last = static_cast<float>(rows_.size());
  const float down = std::min(std::atan2(std::sqrt(d.x * d.x + d.z * d.z), d.y) * kInvPi * last, last);
  const float row_edge = std::min(std::floor(down), last - 1), y = down - row_edge;
  const auto cell = static_cast<std::uint32_t>(i), j = static_cast<std::uint32_t>(row_edge);

  const std::uint32_t right = right_of(cell);
  const C3 c00 = texels_.texel(cell, j), c10 = texels_.texel(right, j), c01 = texels_.texel(cell, j + 1),
           c11 = texels_.texel(right, j + 1);
  Light light{((c00 * (1 - x) + c10 * x) * (1 - y) + (c01 * (1 - x) + c11 * x) * y) * scale_, 0};
  const Row& row = rows_[j];
  const float l00 = luminance(c00), l10 = luminance(c10), l01 = luminance(c01), l11 = luminance(c11);
  const float mean = .25f * (l00 + l10 + l01 + l11);
  if (j >= used_rows_ || !(mean > 0)) return light;
  // The cosine is computed in double: next to a pole a whole row spans less than float32 resolves near 1.
  const double dx = d.x, dy = d.y, dz = d.z, z = dy / std::sqrt(dx * dx + dy * dy + dz * dz);
  const auto t = static_cast<float>(std::clamp((row.top - z) / row.height, 0., 1.));
  light.pdf = row.density * cell_share(j, cell) * (lerp(lerp(l00, l10, x), lerp(l01, l11, x), t) / mean);
  return light;
}

EnvironmentMap::Light EnvironmentMap::at_square(const V3& d) const {
  const V2 place = equal_area_place(d);
  const std::uint32_t side = texels_.width;
  const auto texel = [side](float s) {
    return std::min(static_cast<std::uint32_t>(s * static_cast<float>(side)), side - 1);
  };
  const std::uint32_t i = texel(place.x), j = texel(place.y);
  return {texels_.texel(i, j) * scale_, j < used_rows_ ? rows_[j].density * cell_share(j, i) : 0};
}

V3 EnvironmentMap::sample(std::uint32_t x, std::uint32_t y) const {
  LS_COUNT(environment_map);
  // `row` is the last row whose words begin at or before the word y. The position of y among the row's words
  // is reused to sample within the row.
  const auto row = std::upper_bound(rows_.begin(), rows_.begin() + used_rows_, y,
                                    [](std::uint32_t word, const Row& r) { return word < r.first; }) -
                   1;
  const auto j = static_cast<std::uint32_t>(row - rows_.begin());
  const auto place = [](std::uint32_t word, std::uint32_t first, std::uint64_t end) {
    return std::min(kBelowOne, static_cast<float>((static_cast<double>(word - first) + .5) /
                                                  static_cast<double>(end - first)));
  };
  constexpr std::uint64_t kEnd = std::uint64_t{1} << 32;
  const float v = place(y, row->first, j + 1 < used_rows_ ? row[1].first : kEnd);
  const std::uint32_t* cells = &first_[std::size_t{j} * texels_.width];
  const std::uint32_t* cell = std::upper_bound(cells, cells + row->used, x) - 1;
  const auto i = static_cast<std::uint32_t>(cell - cells);
  const float u = place(x, *cell, i + 1 < row->used ? cell[1] : kEnd);
  return normalize(frame_.to_world(within_cell(i, j, u, v)));
}

// Returns the direction, in the map's own space, that the random numbers u and v choose in a cell.
V3 EnvironmentMap::within_cell(std::uint32_t i, std::uint32_t j, float u, float v) const {
  if (is_square()) {
    const auto side = static_cast<float>(texels_.width);
    return equal_area_direction({(static_cast<float>(i) + u) / side, (static_cast<float>(j) + v) / side});
  }
  const Corners c = corners(i, j);
  const float t = sample_linear(c.l00 + c.l10, c.l01 + c.l11, v);
  const float s = sample_linear(lerp(c.l00, c.l01, t), lerp(c.l10, c.l11, t), u);
  const double z = rows_[j].top - rows_[j].height * double{t};
  const auto radius = static_cast<float>(safe_sqrt((1 - z) * (1 + z)));
  const float turns = (static_cast<float>(i) + .5f + s) / static_cast<float>(texels_.width);
  const V2 circle = unit_circle(turns > 1 ? turns - 1 : turns);
  return {circle.y * radius, static_cast<float>(z), -circle.x * radius};
}

std::uint64_t EnvironmentMap::bytes() const {
  return texels_.u8.size() + (texels_.f32.size() + first_.size()) * sizeof(float) +
         rows_.size() * sizeof(Row);
}

}  // namespace ls::render
