// rendered_coverage SCENE [SIDE] [SPP] [IMAGES] [SEED] [DUMP]: how often the intervals of images of a scene
// file hold the true error, with default settings; a row of docs/measurements/error.md for each number of
// samples.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "core/base/log.h"
#include "tests/coverage/rendered.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: rendered_coverage SCENE [SIDE] [SPP] [IMAGES] [SEED] [DUMP]\n");
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
  if (argc > 6) jobs.dump = argv[6];
  ls::log_level(ls::LogLevel::off);
  try {
    for (const auto& cell : ls::test::measure_rendered(jobs))
      fmt::print("{}\n", ls::test::rendered_line(jobs, cell));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
