// What the stop rule gains and what it costs, on images whose truth is known: docs/measurements/stopping.md
// is made by it.
//   stopping_bench [JOBS] [SEED]     jobs of each image and target, 100 unless told otherwise; seeds from
//   SEED on (1)
#include <fmt/format.h>

#include <cstdlib>

#include "tests/support/synthetic_film.h"

namespace ls::test {
namespace {

constexpr TileGrid kGrid{{256, 192}, 32};

struct Row {
  double spp = 0;  // mean over pixels and jobs
  double realised = 0, estimated = 0;
  double over = 0;                           // share of jobs whose realised error is above the target
  double brightness = 0, brightness_se = 0;  // of the image: mean difference over mean truth
  double tile_bias = 0;   // root of the mean squared bias of a tile's brightness, less what chance gives
  double pixel_bias = 0;  // the same of pixels, as a relative error squared, over the target
};

// Sums over jobs of a quantity and of its square: the squared mean, without the part that scatter gives it.
struct Moments {
  double sum = 0, squares = 0;
  void add(double x) { sum += x, squares += x * x; }
  double mean(double n) const { return sum / n; }
  double variance_of_mean(double n) const { return (squares - sum * sum / n) / (n - 1) / n; }
  double squared_bias(double n) const { return mean(n) * mean(n) - variance_of_mean(n); }
};

Row measure(const SyntheticFilm& film, double target, int jobs, std::uint64_t first) {
  Row row;
  const double n = jobs;
  std::vector<Moments> pixels(film.pixels()), tiles(film.grid().count());
  Moments whole;
  double truth = 0;
  for (TileIndex t = 0; t < film.grid().count(); ++t)
    for (const SyntheticPixel& p : film.tile(t)) truth += p.truth();
  for (int j = 0; j < jobs; ++j) {
    const StoppedJob job = run_to_target(film, target, first + static_cast<std::uint64_t>(j));
    row.spp += job.stop.mean_spp / n;
    row.realised += job.realised / n;
    row.estimated += job.estimated / n;
    row.over += (job.realised > target) / n;
    double all = 0;
    std::size_t i = 0;
    for (TileIndex t = 0; t < film.grid().count(); ++t) {
      double sum = 0, of_tile = 0;
      for (const SyntheticPixel& p : film.tile(t)) {
        pixels[i].add(job.errors[i]);
        sum += job.errors[i++];
        of_tile += p.truth();
      }
      tiles[t].add(sum / of_tile);
      all += sum;
    }
    whole.add(all / truth);
  }
  row.brightness = whole.mean(n);
  row.brightness_se = std::sqrt(whole.variance_of_mean(n));
  double of_tiles = 0, of_pixels = 0;
  for (const Moments& m : tiles) of_tiles += m.squared_bias(n) / static_cast<double>(tiles.size());
  std::size_t i = 0;
  for (TileIndex t = 0; t < film.grid().count(); ++t)
    for (const SyntheticPixel& p : film.tile(t))
      of_pixels +=
          SyntheticFilm::relative(p, pixels[i++].squared_bias(n)) / static_cast<double>(film.pixels());
  row.tile_bias = std::sqrt(std::max(0., of_tiles));
  row.pixel_bias = of_pixels / target;
  return row;
}

// What uniform sampling gives at `spp`, and the least that any choice of samples by tiles gives.
double ideal_gain(const SyntheticFilm& film) {
  double roots = 0;
  for (TileIndex t = 0; t < film.grid().count(); ++t)
    roots += std::sqrt(film.relative_variance(t)) * static_cast<double>(film.tile(t).size());
  roots /= static_cast<double>(film.pixels());
  return film.relative_variance() / (roots * roots);
}

void table(int jobs, std::uint64_t first) {
  fmt::print(
      "| image | target | samples a pixel | true relMSE / target | estimated / true | above the target "
      "| error of uniform sampling at equal cost / adaptive | best possible "
      "|\n|---|---|---|---|---|---|---|---|\n");
  std::string bias =
      "| image | target | promised error, % | brightness of the image, % | bias of tiles' brightness, rms, % "
      "| squared bias of pixels / target, % |\n|---|---|---|---|---|---|\n";
  for (const SyntheticScene& scene : synthetic_scenes()) {
    const SyntheticFilm film(kGrid, scene.pixel);
    const double variance = film.relative_variance();
    for (const double samples : {150., 600., 2400.}) {
      const double target = variance / samples;
      const Row r = measure(film, target, jobs, first);
      fmt::print("| {} | {:.2g} | {:.0f} | {:.3f} | {:.3f} | {:.0f} % | {:.2f} | {:.2f} |\n", scene.name,
                 target, r.spp, r.realised / target, r.estimated / r.realised, 100 * r.over,
                 variance / r.spp / r.realised, ideal_gain(film));
      bias += fmt::format("| {} | {:.2g} | {:.2f} | {:+.4f} +- {:.4f} | {:.4f} | {:.2f} |\n", scene.name,
                          target, 100 * std::sqrt(target), 100 * r.brightness, 100 * r.brightness_se,
                          100 * r.tile_bias, 100 * r.pixel_bias);
      std::fflush(stdout);
    }
  }
  fmt::print("\n{}", bias);
}

}  // namespace
}  // namespace ls::test

int main(int argc, char** argv) {
  const int jobs = argc > 1 ? std::atoi(argv[1]) : 100;
  const long long first = argc > 2 ? std::atoll(argv[2]) : 1;
  if (jobs < 2 || first < 0)
    return fmt::print(stderr, "usage: {} [JOBS] [SEED]    at least 2 jobs\n", argv[0]), 2;
  ls::test::table(jobs, static_cast<std::uint64_t>(first));
}
