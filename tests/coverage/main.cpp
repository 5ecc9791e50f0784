// error_coverage [JOBS] [THREADS] [NAME] [SEED]: the tables of docs/error.md, or those rows of the first
// whose name begins so; with JOBS seeds from SEED on (1).
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
    for (const auto& scene : ls::test::coverage_scenes()) {
      if (!scene.name.starts_with(wanted)) continue;
      fmt::print("{}\n", coverage_line(scene, ls::test::measure_coverage(scene, jobs, threads,
                                                                         static_cast<std::uint64_t>(first))));
      std::fflush(stdout);
    }
    if (!wanted.empty()) return 0;
    fmt::print(
        "\n| picture | true relMSE | estimated / true | with the pixel itself | with its neighbours |\n"
        "|---|---|---|---|---|\n");
    for (const auto& row : ls::test::measure_denominators(jobs)) fmt::print("{}\n", denominator_line(row));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
