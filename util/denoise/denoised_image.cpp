#include "util/denoise/denoised_image.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/check.h"
#include "core/image/error/error_estimate.h"
#include "core/image/frame/frame.h"

namespace ls {
namespace {

constexpr double kInterval = 1.96;  // half the width of a 95 % interval, in standard errors

// An interval is given only if at least this many pixels carry the noise, measured as (sum n^2)^2 / sum n^4
// (denoised_image.h).
constexpr double kFewestPixels = 4;
// The fourth moment E (a - b)^4 divided by Var^2, where a and b are independent Gaussian variables of
// variance Var.
constexpr double kFourthMoment = 12;

struct Noisy {
  std::array<NoisyImage, 2> halves;
  std::vector<bool> counts;
};

// The indices in TileAovs::sums of the three planes of a guide (an AOV for the denoiser), for one half of the
// samples. They are in the order red, green, blue or x, y, z. In TileAovs::sums itself planes are sorted by
// name: blue before green before red, or x, y, z.
struct GuidePlanes {
  std::array<std::size_t, 3> plane{};
};
GuidePlanes planes_of_guide(const AovPlanes& planes, Aov aov, int half) {
  GuidePlanes out;
  for (std::size_t p = 0; p < planes.sums.size(); ++p)
    if (planes.sums[p].aov == aov && planes.sums[p].half == half && !planes.sums[p].hits)
      out.plane[static_cast<std::size_t>(planes.sums[p].component)] = p;
  return out;
}

Noisy gather(const Film& film) {
  const FrameSize frame = film.grid().frame;
  const std::size_t pixels = frame.pixels();
  Noisy out;
  out.counts.assign(pixels, false);
  for (NoisyImage& half : out.halves)
    for (std::vector<float>* plane : {&half.color, &half.albedo, &half.normal})
      plane->assign(3 * pixels, 0.f);
  const AovPlanes planes = planes_of(film.aovs());
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    if (film.spp(t) == 0) continue;
    const PixelRect rect = film.grid().rect(t);
    const auto n = static_cast<std::size_t>(rect.pixels());
    const auto means = film.half_means(t);
    const TileAovs aovs = film.aov_pixels(t);
    const double samples = static_cast<double>(aovs.spp / 2);
    for (std::size_t h = 0; h < 2; ++h) {
      const auto albedo = planes_of_guide(planes, Aov::denoising_albedo, static_cast<int>(h)),
                 normal = planes_of_guide(planes, Aov::denoising_normal, static_cast<int>(h));
      NoisyImage& half = out.halves[h];
      each_pixel(rect, frame, [&](std::size_t to, std::size_t from) {
        out.counts[to] = true;
        for (std::size_t c = 0; c < 3; ++c) {
          half.color[3 * to + c] = static_cast<float>(means[h][c * n + from]);
          half.albedo[3 * to + c] = static_cast<float>(aovs.sums[albedo.plane[c] * n + from] / samples);
          half.normal[3 * to + c] = static_cast<float>(aovs.sums[normal.plane[c] * n + from] / samples);
        }
      });
    }
  }
  return out;
}

// Sums over pixels of the estimated squared error, and of the second and fourth powers of n, the noise of
// that estimate (denoised_image.h).
struct Sums {
  double estimate = 0, squares = 0, fourths = 0;
  void add_noise(double product, double apart) {
    const double square = product * product + apart * apart / kFourthMoment;
    squares += square;
    fourths += square * square;
  }
  bool has_interval() const { return squares * squares >= kFewestPixels * fourths; }
};

}  // namespace

DenoisedError denoised_error(const DenoisedHalves& h) {
  Sums plain, relative;
  std::size_t pixels = 0;
  for (std::size_t p = 0; p < h.counts.size(); ++p) {
    if (!h.counts[p]) continue;
    ++pixels;
    double product_sum = 0, apart_sum = 0, weighted_product = 0, weighted_apart = 0;
    for (std::size_t i = 3 * p; i < 3 * p + 3; ++i) {
      const double product = (double{h.a[i]} - h.denoised_a[i]) * (double{h.b[i]} - h.denoised_b[i]);
      const double apart = double{h.denoised_a[i]} - h.denoised_b[i];
      const double mean = (double{h.denoised_a[i]} + h.denoised_b[i]) / 2;
      const double weight = relative_weight(mean, 0), estimate = product + apart * apart / 4;
      plain.estimate += estimate;
      relative.estimate += weight * estimate;
      product_sum += product;
      apart_sum += apart * apart;
      weighted_product += weight * product;
      weighted_apart += weight * apart * apart;
    }
    plain.add_noise(product_sum, apart_sum);
    relative.add_noise(weighted_product, weighted_apart);
  }
  DenoisedError out;
  if (pixels == 0) return out;
  const auto values = 3 * static_cast<double>(pixels);
  const double half_width = kInterval * std::sqrt(plain.squares) / values;
  out.mse = plain.estimate / values;
  out.rmse = std::sqrt(std::max(0.0, out.mse));
  out.rmse_lo = std::sqrt(std::max(0.0, out.mse - half_width));
  out.rmse_hi = std::sqrt(std::max(0.0, out.mse + half_width));
  out.rmse_interval = plain.has_interval();
  const double relative_half_width = kInterval * std::sqrt(relative.squares) / values;
  out.relmse = relative.estimate / values;
  out.relmse_lo = std::max(0.0, out.relmse - relative_half_width);
  out.relmse_hi = std::max(0.0, out.relmse + relative_half_width);
  out.relmse_interval = relative.has_interval();
  return out;
}

Result<DenoisedImage> denoised_image(const Film& film, const Denoiser& denoiser) {
  const std::uint32_t needed = aovs_of(AovKind::guide).bits();
  CHECK((film.aovs().bits() & needed) == needed, "a film without the AOVs that denoising needs");
  Noisy noisy = gather(film);
  auto denoised = denoiser.denoise(film.grid().frame, noisy.halves);
  if (!denoised) return tl::unexpected(denoised.error());
  DenoisedHalves halves{std::move(noisy.halves[0].color), std::move(noisy.halves[1].color),
                        std::move((*denoised)[0]), std::move((*denoised)[1]), std::move(noisy.counts)};
  DenoisedImage out{film.grid().frame, {}, denoised_error(halves), denoiser.name()};
  out.rgb.resize(halves.a.size());
  for (std::size_t i = 0; i < out.rgb.size(); ++i)
    if (halves.counts[i / 3]) out.rgb[i] = (halves.denoised_a[i] + halves.denoised_b[i]) / 2;
  return out;
}

}  // namespace ls
