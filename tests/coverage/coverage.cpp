#include "tests/coverage/coverage.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/image/error/convergence.h"
#include "core/image/film/film.h"
#include "formats/read.h"
#include "tests/coverage/job.h"
#include "validation/measure/hypothesis_tests.h"
#include "worker/render/render.h"

namespace ls::test {
namespace {

constexpr int kSide = 32;
constexpr TileGrid kGrid{{kSide, kSide}, kSide};
constexpr double kDark = 0.01;  // of relMSE's denominator

class NoFiles final : public AssetSource {
 public:
  Result<Asset> find(std::string_view) override { return fail(Errc::not_found, "there are no files"); }
  Result<std::string> text(std::string_view) override { return fail(Errc::not_found, "there are no files"); }
};

Scene parsed(const CoverageScene& scene) {
  NoFiles files;
  auto read = read_scene(scene.name, scene.xml, files);
  if (!read.scene) throw std::runtime_error(format_diagnostic(read.diagnostics.front()));
  return std::move(*read.scene);
}

template <class T>
T checked_job(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

constexpr std::uint64_t kUniformSpp = 128, kOtherSeeds = 1'000'000;

std::vector<CoverageJob> run_jobs(int jobs, int threads, const std::function<CoverageJob(std::size_t)>& run) {
  std::vector<CoverageJob> out(static_cast<std::size_t>(jobs));
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i; (i = next++) < out.size();) out[i] = run(i);
  };
  std::vector<std::jthread> pool;
  for (int i = 0; i < threads; ++i) pool.emplace_back(work);
  pool.clear();
  return out;
}

// Per value: sums over jobs, and the variance among them.
struct Truth {
  std::vector<double> sum, variance;
};

Truth truth_of(const std::vector<CoverageJob>& jobs) {
  const std::size_t values = jobs.front().image.size();
  const auto n = static_cast<double>(jobs.size());
  Truth t{std::vector<double>(values), std::vector<double>(values)};
  for (const CoverageJob& job : jobs)
    for (std::size_t i = 0; i < values; ++i) t.sum[i] += job.image[i];
  for (const CoverageJob& job : jobs)
    for (std::size_t i = 0; i < values; ++i) {
      const double d = job.image[i] - t.sum[i] / n;
      t.variance[i] += d * d / (n - 1);
    }
  return t;
}

struct Realised {
  double mse = 0, relmse = 0;
};

// `own`: the job is one of those that the truth was made of.
Realised realised(const CoverageJob& job, const Truth& truth, std::size_t jobs, bool own) {
  Realised out;
  const auto others = static_cast<double>(own ? jobs - 1 : jobs),
             values = static_cast<double>(job.image.size());
  for (std::size_t i = 0; i < job.image.size(); ++i) {
    const double right = (truth.sum[i] - (own ? job.image[i] : 0)) / others, d = job.image[i] - right;
    const double square = d * d - truth.variance[i] / others;
    out.mse += square / values;
    out.relmse += square / (right * right + kDark) / values;
  }
  return out;
}

}  // namespace

namespace {

bool holds(double lo, double value, double hi, double real, double width) {
  return value * std::pow(lo / value, width) <= real && real <= value * std::pow(hi / value, width);
}

void count(Shares& shares, const ImageError& e, const Realised& real, double width) {
  const double part = 1.0 / shares.jobs;
  // the mean so far, over the jobs that state an interval of RMSE
  if (e.rmse_hi > 0) {
    const bool held = holds(e.rmse_lo, e.rmse, e.rmse_hi, std::sqrt(std::max(0.0, real.mse)), width);
    shares.rmse += ((held ? 1 : 0) - shares.rmse) / ++shares.rmse_stated;
  }
  shares.relmse += holds(e.relmse_lo, e.relmse, e.relmse_hi, real.relmse, width) ? part : 0;
}

// Jobs whose pixels take their halves from any of `jobs`.
void pair_anew(const std::vector<CoverageJob>& jobs, std::uint64_t seed, Coverage& out) {
  const std::size_t pixels = kSide * kSide, values = 3 * pixels;
  std::vector<double> right(values);
  for (const CoverageJob& job : jobs)
    for (const auto& half : job.halves)
      for (std::size_t i = 0; i < values; ++i) right[i] += half[i] / (2 * static_cast<double>(jobs.size()));
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::size_t> any(0, 2 * jobs.size() - 1);
  for (int n = 0; n < out.paired.jobs; ++n) {
    std::array<std::vector<double>, 2> halves, earlier;
    for (std::size_t h = 0; h < 2; ++h) halves[h].resize(values), earlier[h].resize(values);
    Realised real;
    for (std::size_t p = 0; p < pixels; ++p) {
      for (std::size_t h = 0; h < 2; ++h) {
        const std::size_t from = any(random);
        const CoverageJob& job = jobs[from / 2];
        for (std::size_t i = p; i < values; i += pixels) {
          halves[h][i] = job.halves[from % 2][i];
          earlier[h][i] = job.earlier[from % 2][i];
        }
      }
      for (std::size_t i = p; i < values; i += pixels) {
        const double d = (halves[0][i] + halves[1][i]) / 2 - right[i],
                     square = d * d / static_cast<double>(values);
        real.mse += square;
        real.relmse += square / (right[i] * right[i] + kDark);
      }
    }
    const EarlierMeans before{{kSide, kSide, earlier[0], earlier[1]}, jobs.front().earlier_spp};
    const ImageError e =
        image_error(estimate_error({kSide, kSide, halves[0], halves[1]}, jobs.front().spp, &before));
    count(out.paired, e, real, 1);
    count(out.paired_narrow, e, real, kNarrow);
  }
}

}  // namespace

CoverageJob run_plain_job(const Scene& scene, std::uint64_t spp, std::uint64_t seed) {
  RenderSettings settings;
  settings.size = kGrid.frame;
  settings.seed = seed;
  settings.integrator = scene.integrator.name;
  settings.max_depth = scene.integrator.max_depth;
  settings.rr_depth = scene.integrator.rr_depth;
  const auto world = checked_job(render::build_world(scene, settings, {}, 1));
  Film film(kGrid);
  CoverageJob job;
  std::vector<ErrorPoint> points;
  for (RoundIndex k = 0; k < round_count(spp); ++k) {
    job.earlier = film.half_means(0);
    job.earlier_spp = film.spp(0);
    const SampleRange range = cut_range(k, spp);
    Partial partial{{{}, {}, {}, kGrid.rect(0), range}, {}};
    partial.sums = render::render_tile(*world, kGrid.rect(0), range, nullptr, nullptr).sums;
    job.error = image_error(checked_job(film.fold(0, k, partial)));
    points.push_back(
        {job.error.spp, job.error.spp, job.error.relmse, job.error.relmse_lo, job.error.relmse_hi});
  }
  job.image = film.pixels(0).mean;
  job.halves = film.half_means(0);
  job.spp = film.spp(0);
  job.heavy_tail =
      !job.error.trusted || judge(points, job.error.verdict).kind == ConvergenceStatus::Kind::heavy_tail;
  return job;
}

Ratio Quotient::ratio() const {
  double a = 0, b = 0, squares = 0;
  for (const auto& [x, y] : pairs_) a += x, b += y;
  const double r = a / b;
  for (const auto& [x, y] : pairs_) squares += (x - r * y) * (x - r * y);
  return {r, std::sqrt(squares) / b};
}

Coverage measure_coverage(const CoverageScene& scene, int count, int threads, std::uint64_t first,
                          int paired) {
  const Scene description = parsed(scene);
  const bool stops = scene.target > 0;
  const std::vector<CoverageJob> jobs = run_jobs(count, threads, [&](std::size_t i) {
    return stops ? run_adaptive_job(scene, first + i) : run_plain_job(description, scene.spp, first + i);
  });
  const Truth truth = truth_of(!stops ? jobs : run_jobs(count, threads, [&](std::size_t i) {
    return run_uniform_job(scene, kUniformSpp, kOtherSeeds + first + i);
  }));
  Coverage out;
  out.jobs = count;
  Shares rendered{.jobs = count};
  Quotient mse, relmse;
  for (const CoverageJob& job : jobs) {
    const Realised real = realised(job, truth, jobs.size(), !stops);
    const ImageError& e = job.error;
    const double share = 1.0 / count;
    ls::test::count(rendered, e, real, 1);
    out.heavy_tail += job.heavy_tail ? share : 0;
    out.true_relmse += real.relmse * share;
    out.spp += e.spp * share;
    mse.add(e.rmse * e.rmse, real.mse);
    relmse.add(e.relmse, real.relmse);
  }
  out.rmse = rendered.rmse;
  out.relmse = rendered.relmse;
  out.mse_ratio = mse.ratio();
  out.relmse_ratio = relmse.ratio();
  if (stops) return out;
  out.paired.jobs = out.paired_narrow.jobs = paired;
  pair_anew(jobs, first, out);
  return out;
}

double share_slack(int n, double level) {
  return kMayBeOff + cli::student_quantile(level, 1e9) * std::sqrt(kCovered * (1 - kCovered) / n);
}

bool as_promised(const CoverageScene& scene, const Coverage& c, double level) {
  const double z = cli::student_quantile(level, 1e9), n = c.jobs;
  // Of fireflies the share that says so is .95 at least, of others .05 at most.
  const double doubt = z * std::sqrt(kWronglyDoubted * (1 - kWronglyDoubted) / n);
  if (scene.fireflies) return c.heavy_tail >= 1 - kWronglyDoubted - doubt;
  const auto covered = [&](double share, int jobs) {
    return std::abs(share - kCovered) <= share_slack(jobs, level);
  };
  const auto right = [&](const Ratio& r) {
    return std::abs(r.value - 1) <= kRatioMayBeOff + cli::student_quantile(level, n - 1) * r.sigma;
  };
  const Shares& p = c.paired;
  return covered(c.rmse, c.jobs) && covered(c.relmse, c.jobs) &&
         (p.jobs == 0 || (covered(p.rmse, p.jobs) && covered(p.relmse, p.jobs))) && right(c.mse_ratio) &&
         right(c.relmse_ratio) && c.heavy_tail <= kWronglyDoubted + doubt;
}

std::string coverage_line(const CoverageScene& scene, const Coverage& c) {
  return fmt::format(
      "| {} | {:.0f} | {} | {:.2g} | {:.1f} % | {:.1f} % | {} | {:.3f} +- {:.3f} | {:.3f} +- {:.3f} | {:.1f} "
      "% |",
      scene.name, c.spp, c.jobs, c.true_relmse, 100 * c.rmse, 100 * c.relmse,
      c.paired.jobs > 0 ? fmt::format("{:.1f} %, {:.1f} %", 100 * c.paired.rmse, 100 * c.paired.relmse) : "",
      c.mse_ratio.value, c.mse_ratio.sigma, c.relmse_ratio.value, c.relmse_ratio.sigma, 100 * c.heavy_tail);
}

}  // namespace ls::test
