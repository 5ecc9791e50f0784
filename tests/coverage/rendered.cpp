#include "tests/coverage/rendered.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "cli/local/local_scene.h"
#include "core/image/error/convergence.h"
#include "core/image/film/film.h"
#include "worker/render/render.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

constexpr double kOfDenominator = 0.01;  // relMSE's

// One image after each of its rounds.
struct Stage {
  std::vector<float> image;  // tile by tile
  ImageError error;
  AreaError areas;
  bool trusted = false;
};
using Stages = std::vector<Stage>;

template <class T, class E>
T rendered(tl::expected<T, E> result) {
  if (result) return std::move(*result);
  if constexpr (requires { result.error().message; })
    throw std::runtime_error(result.error().message);
  else
    throw std::runtime_error(result.error().error.message);
}

class Renders {
 public:
  explicit Renders(const RenderedJobs& jobs)
      : jobs_(jobs), scene_(rendered(cli::read_local_scene(jobs.scene, {}, false))) {
    for (const auto& [name, file] : scene_.files)
      if (!file.is_text) files_.emplace(file.digest, file.path);
  }

  Stages render(std::uint64_t seed, std::vector<double>* halves) const {
    RenderSettings settings;
    settings.size = jobs_.size;
    settings.seed = seed;
    settings.integrator = scene_.scene.integrator.name;
    settings.max_depth = scene_.scene.integrator.max_depth;
    settings.rr_depth = scene_.scene.integrator.rr_depth;
    const auto world = rendered(render::build_world(scene_.scene, settings, files_, 1));
    const TileGrid grid{settings.size, settings.tile};
    Film film(grid);
    Stages stages;
    std::vector<ErrorPoint> points;
    for (RoundIndex k = 0; k < round_count(jobs_.spp); ++k) {
      const SampleRange range = cut_range(k, jobs_.spp);
      for (TileIndex t = 0; t < grid.count(); ++t) {
        Partial partial{{{}, {}, {}, grid.rect(t), range}, {}};
        partial.sums = render::render_tile(*world, grid.rect(t), range, nullptr, nullptr).sums;
        (void)rendered(film.fold(t, k, partial));
      }
      const ImageError e = image_error(film.error());
      points.push_back({e.spp, e.spp, e.relmse, e.relmse_lo, e.relmse_hi});
      Stage stage{
          {}, e, area_error(film.error().areas, world->need.connected), judge(points, e.verdict).trusted};
      for (TileIndex t = 0; t < grid.count(); ++t) {
        const auto mean = film.pixels(t).mean;
        stage.image.insert(stage.image.end(), mean.begin(), mean.end());
        if (halves)
          for (const auto& half : film.half_means(t)) halves->insert(halves->end(), half.begin(), half.end());
      }
      stages.push_back(std::move(stage));
    }
    return stages;
  }

 private:
  const RenderedJobs& jobs_;
  const cli::LocalScene scene_;
  render::AssetFiles files_;
};

std::vector<Stages> render_all(const RenderedJobs& jobs) {
  const Renders renders(jobs);
  std::vector<Stages> out(static_cast<std::size_t>(jobs.images));
  std::vector<std::vector<double>> halves(jobs.dump.empty() ? 0 : out.size());
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> pool;
  for (int i = 0; i < jobs.threads; ++i)
    pool.emplace_back([&] {
      for (std::size_t n; (n = next++) < out.size();)
        out[n] = renders.render(jobs.first_seed + n, halves.empty() ? nullptr : &halves[n]);
    });
  pool.clear();
  if (!jobs.dump.empty()) {
    std::ofstream file(jobs.dump, std::ios::binary);
    for (const auto& h : halves)
      file.write(reinterpret_cast<const char*>(h.data()),
                 static_cast<std::streamsize>(h.size() * sizeof(double)));
  }
  return out;
}

}  // namespace

namespace {

// The means of an image over squares of 16 x 16 pixels. The image is stored tile by tile, each as three
// planes of 32 x 32 pixels.
std::vector<double> square_means(const std::vector<float>& image) {
  constexpr std::size_t kTile = 32, kSquare = 16, kAcross = kTile / kSquare;
  std::vector<double> out(image.size() / (kSquare * kSquare));
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::size_t plane = i / (kTile * kTile), y = i / kTile % kTile, x = i % kTile;
    out[(plane * kAcross + y / kSquare) * kAcross + x / kSquare] += double{image[i]} / (kSquare * kSquare);
  }
  return out;
}

// Counts how often intervals of errors of areas hold, in the trusted images at one stage.
void measure_areas(const std::vector<Stages>& all, std::size_t k, RenderedCell& cell) {
  const auto n = static_cast<double>(all.size());
  std::vector<std::vector<double>> last;
  for (const Stages& s : all) last.push_back(square_means(s.back().image));
  const std::size_t squares = last.front().size();
  std::vector<double> sum(squares), variance(squares);
  double green = 0;
  for (const auto& means : last)
    for (std::size_t i = 0; i < squares; ++i) sum[i] += means[i];
  for (const auto& means : last)
    for (std::size_t i = 0; i < squares; ++i) {
      const double d = means[i] - sum[i] / n;
      variance[i] += d * d / (n - 1);
    }
  for (const Stages& s : all) green += s.back().areas.mean[1];
  for (std::size_t j = 0; j < all.size(); ++j) {
    const Stage& stage = all[j][k];
    if (!stage.trusted || !stage.error.settled) continue;
    const double right = (green - all[j].back().areas.mean[1]) / (n - 1);
    ++cell.mean_known;
    cell.mean += std::abs(stage.areas.mean[1] - right) <= stage.areas.half_width[1];
    const std::vector<double> means = square_means(stage.image);
    double relmse = 0;
    for (std::size_t i = 0; i < squares; ++i) {
      const double m = (sum[i] - last[j][i]) / (n - 1), d = means[i] - m;
      relmse += (d * d - variance[i] / (n - 1)) / (m * m + kOfDenominator) / static_cast<double>(squares);
    }
    cell.squares_known += stage.areas.relmse_hi > 0;
    cell.squares +=
        stage.areas.relmse_hi > 0 && stage.areas.relmse_lo <= relmse && relmse <= stage.areas.relmse_hi;
  }
}

}  // namespace

std::vector<RenderedCell> measure_rendered(const RenderedJobs& jobs) {
  if (jobs.size.width % 32 != 0 || jobs.size.height % 32 != 0)
    throw std::runtime_error("the sides of the images must be multiples of 32 pixels");
  const std::vector<Stages> all = render_all(jobs);
  const std::size_t values = all.front().front().image.size();
  const auto n = static_cast<double>(all.size());
  std::vector<double> sum(values), variance(values);
  for (const Stages& s : all)
    for (std::size_t i = 0; i < values; ++i) sum[i] += s.back().image[i];
  for (const Stages& s : all)
    for (std::size_t i = 0; i < values; ++i) {
      const double d = s.back().image[i] - sum[i] / n;
      variance[i] += d * d / (n - 1);
    }
  std::vector<RenderedCell> cells;
  for (std::size_t k = 1; k < all.front().size(); ++k) {
    RenderedCell cell;
    cell.images = jobs.images;
    cell.spp = static_cast<std::uint64_t>(all.front()[k].error.spp);
    Quotient mse, relmse;
    for (const Stages& s : all) {
      const ImageError& e = s[k].error;
      double true_mse = 0, true_relmse = 0;
      for (std::size_t i = 0; i < values; ++i) {
        const double right = (sum[i] - s.back().image[i]) / (n - 1), d = s[k].image[i] - right;
        const double square = (d * d - variance[i] / (n - 1)) / static_cast<double>(values);
        true_mse += square;
        true_relmse += square / (right * right + kOfDenominator);
      }
      const double rmse = std::sqrt(std::max(0.0, true_mse));
      cell.true_relmse += true_relmse / n;
      mse.add(e.rmse * e.rmse, true_mse);
      relmse.add(e.relmse, true_relmse);
      if (!s[k].trusted) continue;
      ++cell.trusted;
      cell.rmse_known += e.rmse_hi > 0;
      cell.rmse += e.rmse_hi > 0 && e.rmse_lo <= rmse && rmse <= e.rmse_hi;
      cell.relmse += e.relmse_lo <= true_relmse && true_relmse <= e.relmse_hi;
    }
    measure_areas(all, k, cell);
    cell.mse_ratio = mse.ratio();
    cell.relmse_ratio = relmse.ratio();
    cells.push_back(cell);
  }
  return cells;
}

std::string rendered_line(const RenderedJobs& jobs, const RenderedCell& c) {
  const auto share = [](int held, int of) {
    return of == 0 ? std::string("-") : fmt::format("{:.0f} %", 100.0 * held / of);
  };
  return fmt::format(
      "| {} | {} x {} | {} | {:.2g} | {} of {} | {} of {} | {} | {} of {} | {} of {} | {:.3f} +- {:.3f} | "
      "{:.3f} "
      "+- {:.3f} |",
      std::filesystem::path(jobs.scene).stem().string(), jobs.size.width, jobs.size.height, c.spp,
      c.true_relmse, c.trusted, c.images, share(c.rmse, c.rmse_known), c.rmse_known,
      share(c.relmse, c.trusted), share(c.mean, c.mean_known), c.mean_known,
      share(c.squares, c.squares_known), c.squares_known, c.mse_ratio.value, c.mse_ratio.sigma,
      c.relmse_ratio.value, c.relmse_ratio.sigma);
}

}  // namespace ls::test
