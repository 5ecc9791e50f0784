// error_coverage [JOBS] [THREADS] [NAME] [SEED]: the tables of docs/error.md, or those rows of the first
// whose name begins so; with JOBS seeds from SEED on (1). Exit code 1: a row is not what docs/error.md
// promises.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "common/base/log.h"
#include "tests/coverage/coverage.h"
#include "tests/coverage/denominators.h"

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
      "| scene | spp | jobs | true relMSE | RMSE covered | relMSE covered | estimated / true MSE | relMSE | "
      "\"don't trust yet\" |\n|---|---|---|---|---|---|---|---|---|\n");
  try {
    bool right = true;
    for (const auto& scene : ls::test::coverage_scenes()) {
      if (!scene.name.starts_with(wanted)) continue;
      const auto found = ls::test::measure_coverage(scene, jobs, threads, static_cast<std::uint64_t>(first));
      fmt::print("{}\n", coverage_line(scene, found));
      std::fflush(stdout);
      if (as_promised(scene, found)) continue;
      fmt::print(stderr, "{}: not what docs/error.md promises\n", scene.name);
      right = false;
    }
    if (!wanted.empty()) return right ? 0 : 1;
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
