// rendered_coverage SCENE [SIDE] [SPP] [IMAGES] [SEED] [PAIRS] [THREADS] [FOLDER]: how often the intervals of
// images of a scene file hold the true error, with default settings; a row of docs/measurements/error.md for
// each number of samples. FOLDER keeps the renders (rendered.h).
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "core/base/log.h"
#include "tests/coverage/rendered.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr,
               "usage: rendered_coverage SCENE [SIDE] [SPP] [IMAGES] [SEED] [PAIRS] [THREADS] [FOLDER]\n");
    return 2;
  }
  ls::test::RenderedJobs jobs;
  jobs.scene = argv[1];
  const auto number = [&](int i, long long otherwise) { return argc > i ? std::atoll(argv[i]) : otherwise; };
  const int side = static_cast<int>(number(2, 64));
  jobs.size = {side, side};
  jobs.spp = static_cast<std::uint64_t>(number(3, 64));
  jobs.images = static_cast<int>(number(4, 100));
  jobs.first_seed = static_cast<std::uint64_t>(number(5, 1));
  jobs.pairs = static_cast<int>(number(6, 1));
  jobs.threads = static_cast<int>(number(7, 2));
  if (argc > 8) jobs.kept = argv[8];
  ls::log_level(ls::LogLevel::off);
  try {
    const auto cells = ls::test::measure_rendered(jobs);
    fmt::print("{}\n", ls::test::rendered_head());
    for (const auto& cell : cells) fmt::print("{}\n", ls::test::rendered_line(jobs, cell));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
