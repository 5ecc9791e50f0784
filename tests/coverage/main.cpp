// error_coverage [JOBS] [THREADS] [NAME] [SEED]: the tables of docs/measurements/error.md, or those rows of
// the first whose name begins so; with JOBS seeds from SEED on (1), and 10,000 jobs paired anew of those.
// Exit code 1: a row, or the mean of all, is not what docs/measurements/error.md promises.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "core/base/log.h"
#include "tests/coverage/coverage.h"
#include "tests/coverage/denominators.h"
#include "validation/measure/hypothesis_tests.h"

namespace {

constexpr int kPaired = 10'000;
// An estimator that keeps its promises fails one run of all rows in a hundred.
constexpr double kFalseAlarms = .01;

// Number of figures that a run of all rows tests: those of each row, and the mean of the rows.
std::size_t figures_tested() {
  std::size_t figures = 1;
  for (const auto& scene : ls::test::coverage_scenes())
    figures += scene.fireflies ? 1 : scene.target > 0 ? 5 : 7;
  return figures;
}

}  // namespace

int main(int argc, char** argv) {
  const int jobs = argc > 1 ? std::atoi(argv[1]) : 1000, threads = argc > 2 ? std::atoi(argv[2]) : 2;
  const std::string wanted = argc > 3 ? argv[3] : "";
  const long long first = argc > 4 ? std::atoll(argv[4]) : 1;
  if (jobs < 2 || threads < 1 || first < 0) {
    fmt::print(stderr, "usage: error_coverage [JOBS] [THREADS] [NAME] [SEED]\n");
    return 2;
  }
  ls::log_level(ls::LogLevel::off);
  fmt::print(
      "| scene | spp | jobs | true relMSE | RMSE covered | relMSE covered | paired anew | estimated / true "
      "MSE | "
      "relMSE | \"don't trust yet\" |\n|---|---|---|---|---|---|---|---|---|---|\n");
  try {
    bool right = true;
    const double level = ls::cli::sidak(kFalseAlarms, figures_tested());
    double covered = 0;
    int shares = 0;
    for (const auto& scene : ls::test::coverage_scenes()) {
      if (!scene.name.starts_with(wanted)) continue;
      const auto found =
          ls::test::measure_coverage(scene, jobs, threads, static_cast<std::uint64_t>(first), kPaired);
      fmt::print("{}\n", coverage_line(scene, found));
      std::fflush(stdout);
      if (!scene.fireflies && found.paired.jobs > 0)
        covered += found.paired.rmse + found.paired.relmse, shares += 2;
      if (as_promised(scene, found, level)) continue;
      fmt::print(stderr, "{}: not what docs/measurements/error.md promises\n", scene.name);
      right = false;
    }
    if (!wanted.empty()) return right ? 0 : 1;
    // A row's two shares are of the same jobs, and count as one.
    const double slack = ls::test::kMeanMayBeOff + ls::cli::student_quantile(level, 1e9) *
                                                       std::sqrt(.95 * .05 / kPaired / (shares / 2.));
    fmt::print("\npaired anew, all rows: {:.2f} %\n", 100 * covered / shares);
    right = right && std::abs(covered / shares - ls::test::kCovered) <= slack;
    fmt::print(
        "\n| picture | true relMSE | estimated / true | with the pixel itself | with its neighbours |\n"
        "|---|---|---|---|---|\n");
    for (const auto& row : ls::test::measure_denominators(jobs)) fmt::print("{}\n", denominator_line(row));
    if (!right) return 1;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
