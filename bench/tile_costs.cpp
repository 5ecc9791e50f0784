// What could adaptive sampling gain on a scene, with samples and with seconds as its cost?
//   tile_costs SPP WIDTHxHEIGHT SCENE.xml...
// Every tile is rendered with SPP samples; its variance per sample a (relative, over its pixels) and the CPU
// seconds of a sample c are measured. To bring the image's error, sum of p a / n over tiles of p pixels, to a
// target, sampling with n ~ w costs sum(p a / w) sum(p c w) of seconds (and c = 1: of samples). Shown are the
// factors by which that is less than with w = 1:
//   per sample         w = sqrt(a), which is the best for samples
//   per second         the same w, its cost in seconds
//   best per second    w = sqrt(a / c)
// One table row a scene. CPU seconds of a busy machine stray; that makes the last column too large
// rather than too small.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "cli/local/local_scene.h"
#include "cli/local/local_world.h"
#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/image/film/film.h"
#include "worker/render/render.h"

namespace ls::test {
namespace {

struct Tile {
  double pixels = 0, variance = 0, seconds = 0;  // per pixel and sample
};

using Weight = std::function<double(const Tile&)>;

// Error times seconds (or samples) with n ~ weight.
double price(const std::vector<Tile>& tiles, const Weight& weight, bool in_seconds) {
  double error = 0, cost = 0;
  for (const Tile& t : tiles) {
    if (t.variance > 0) error += t.pixels * t.variance / weight(t);  // what has no noise needs no sample
    cost += t.pixels * weight(t) * (in_seconds ? t.seconds : 1);
  }
  return error * cost;
}

// The largest over the smallest of what 9 of 10 tiles with any noise lie within.
double spread(const std::vector<Tile>& tiles, double Tile::*what) {
  std::vector<double> values;
  for (const Tile& t : tiles)
    if (t.variance > 0) values.push_back(t.*what);
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
  };
  return at(.95) / at(.05);
}

std::vector<Tile> measured(const render::World& world, FrameSize size, std::uint64_t spp) {
  const TileGrid grid{size};
  std::vector<Tile> tiles;
  for (TileIndex i = 0; i < grid.count(); ++i) {
    Film film(grid);
    double seconds = 0;
    for (RoundIndex k = 0; k < round_count(spp); ++k) {
      Partial partial{{{}, {}, {}, grid.rect(i), cut_range(k, spp)}, {}, {}};
      const double start = thread_cpu_seconds();
      partial.sums = render::render_tile(world, grid.rect(i), partial.header.samples, nullptr, nullptr).sums;
      seconds += thread_cpu_seconds() - start;
      (void)film.fold(i, k, partial, {});
    }
    const auto pixels = static_cast<double>(grid.rect(i).pixels()), n = static_cast<double>(spp);
    tiles.push_back({pixels, film.error(i).relative.squares / (3 * pixels) * n, seconds / (pixels * n)});
  }
  return tiles;
}

void row(const std::string& path, FrameSize size, std::uint64_t spp) {
  const auto scene = cli::read_local_scene(path, {}, false);
  JobSpec spec;
  spec.size = size;
  spec.seed = 5001;
  const auto built = scene ? cli::build_local_world(*scene, spec, 1) : tl::unexpected(scene.error());
  if (!built) return fmt::print(stderr, "{}: {}\n", path, built.error().error.message);
  const std::vector<Tile> tiles = measured(*built->world, size, spp);
  const Weight even = [](const Tile&) { return 1.; };
  const Weight ours = [](const Tile& t) { return std::sqrt(t.variance); };
  const Weight best = [](const Tile& t) { return std::sqrt(t.variance / t.seconds); };
  const double uniform = price(tiles, even, true);
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.2f} | {:.2f} | {:.2f} |\n",
             path.substr(path.find_last_of('/') + 1), tiles.size(), spread(tiles, &Tile::variance),
             spread(tiles, &Tile::seconds), price(tiles, even, false) / price(tiles, ours, false),
             uniform / price(tiles, ours, true), uniform / price(tiles, best, true));
  std::fflush(stdout);
}

}  // namespace
}  // namespace ls::test

int main(int argc, char** argv) {
  ls::FrameSize size;
  const long spp = argc > 3 ? std::atol(argv[1]) : 0;
  if (spp < 2 || std::sscanf(argv[2], "%dx%d", &size.width, &size.height) != 2 || size.width < 1 ||
      size.height < 1)
    return fmt::print(stderr, "usage: {} SPP WIDTHxHEIGHT SCENE.xml...\n", argv[0]), 2;
  ls::log_level(ls::LogLevel::off);
  fmt::print(
      "| scene | tiles | spread of variance | of seconds | gain per sample | per second | at best |\n"
      "|---|---|---|---|---|---|---|\n");
  for (const char* path : std::span(argv + 3, static_cast<std::size_t>(argc - 3)))
    ls::test::row(path, size, static_cast<std::uint64_t>(spp));
}
