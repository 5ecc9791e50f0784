#include "tests/coverage/mixes.h"

#include <fmt/format.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "cli/local/local_scene.h"
#include "core/image/error/relative_weights.h"
#include "core/image/light_mix/light_mix.h"
#include "core/scene/analysis/light_groups.h"
#include "tests/support/threads.h"
#include "worker/render/render.h"

namespace ls::test {
namespace {

// The groups of an image: [group][3 * pixel + channel], tile by tile.
using GroupMeans = std::vector<std::vector<double>>;

struct GroupsImage {
  Film film;
  GroupMeans means;
};

GroupMeans means_of(const Film& film) {
  const AovPlanes planes = planes_of(film.aovs());
  GroupMeans out(film.aovs().groups());
  for (TileIndex t = 0; t < film.grid().count(); ++t) {
    const TileAovs tile = film.aov_pixels(t);
    const auto n = static_cast<std::size_t>(tile.rect.pixels());
    const std::size_t begin = out[0].size();
    for (auto& group : out) group.resize(begin + 3 * n);
    for (std::size_t p = 0; p < planes.sums.size(); ++p) {
      const AovPlane& plane = planes.sums[p];
      for (std::size_t i = 0; i < n; ++i)
        out[plane.group][begin + 3 * i + static_cast<std::size_t>(plane.component)] +=
            tile.sums[p * n + i] / static_cast<double>(tile.spp);
    }
  }
  return out;
}

class MixRenders {
 public:
  explicit MixRenders(const MixJobs& jobs) : jobs_(jobs) {
    auto scene = cli::read_local_scene(jobs.scene, {}, false);
    if (!scene) throw std::runtime_error(scene.error().error.message);
    scene_ = std::move(*scene);
    settings_.size = jobs.size;
    settings_.integrator = scene_.scene.integrator.name;
    settings_.max_depth = scene_.scene.integrator.max_depth;
    settings_.rr_depth = scene_.scene.integrator.rr_depth;
    settings_.aov = {"light_groups"};
    settings_.light_groups = scene::light_groups_of(scene_.scene);
  }
  GroupsImage render(std::uint64_t seed) const {
    RenderSettings settings = settings_;
    settings.seed = seed;
    const auto world = render::build_world(scene_.scene, settings, {}, 1);
    if (!world) throw std::runtime_error(world.error().message);
    const TileGrid grid{jobs_.size, RenderSettings{}.tile};
    GroupsImage out{Film(grid, aovs_of(settings)), {}};
    for (TileIndex t = 0; t < grid.count(); ++t)
      for (RoundIndex k = 0; k < round_count(jobs_.spp); ++k) {
        const SampleRange range = cut_range(k, jobs_.spp);
        Partial partial{{{}, {}, {}, grid.rect(t), range}, {}, out.film.aovs()};
        partial.sums = render::render_tile(**world, grid.rect(t), range, nullptr, nullptr).sums;
        if (const auto folded = out.film.fold(t, k, partial); !folded)
          throw std::runtime_error(folded.error().message);
      }
    out.means = means_of(out.film);
    return out;
  }
  std::size_t groups() const { return settings_.light_groups.size(); }

 private:
  const MixJobs& jobs_;
  cli::LocalScene scene_;
  RenderSettings settings_;
};

// The sums over all images of the groups' values, and of the products of two groups' values.
struct GroupMoments {
  GroupMeans sum;
  std::vector<std::vector<std::vector<double>>> product;

  explicit GroupMoments(const std::vector<GroupsImage>& all) {
    const std::size_t groups = all.front().means.size(), values = all.front().means.front().size();
    sum.assign(groups, std::vector<double>(values));
    product.assign(groups, GroupMeans(groups, std::vector<double>(values)));
    for (const GroupsImage& image : all)
      for (std::size_t g = 0; g < groups; ++g)
        for (std::size_t i = 0; i < values; ++i) {
          sum[g][i] += image.means[g][i];
          for (std::size_t h = 0; h < groups; ++h) product[g][h][i] += image.means[g][i] * image.means[h][i];
        }
  }
};

// Factors from 1/8 to 8 for each colour, evenly spread on a logarithmic scale; one group in five is off.
std::vector<GroupFactors> random_factors(std::size_t groups, std::mt19937_64& random) {
  std::uniform_real_distribution<double> stops(-3, 3), coin(0, 1);
  std::vector<GroupFactors> out(groups);
  for (GroupFactors& f : out) {
    const bool off = coin(random) < .2;
    for (double& x : f.surface) x = off ? 0 : std::exp2(stops(random));
    f.volume = f.surface;
  }
  return out;
}

struct MixLook {
  double estimated = 0, real = 0;
  bool trusted = false, held = false;
};

MixLook look_at(const GroupsImage& image, const GroupMoments& all, std::size_t images,
                const std::vector<GroupFactors>& factors) {
  MixedError sum;
  sum.mix(image.film, factors);
  const ImageError e = sum.error();
  MixLook look{.estimated = e.relmse, .trusted = e.trusted};
  const auto n = static_cast<double>(images), others = n - 1;
  const std::size_t values = all.sum.front().size();
  for (std::size_t i = 0; i < values; ++i) {
    const std::size_t c = i % 3;
    double mixed = 0, mean = 0, variance = 0;
    for (std::size_t g = 0; g < factors.size(); ++g) {
      const double f = factors[g].surface[c];
      mixed += f * image.means[g][i];
      mean += f * (all.sum[g][i] - image.means[g][i]) / others;
      for (std::size_t h = 0; h < factors.size(); ++h) {
        const double covariance = (all.product[g][h][i] - all.sum[g][i] * all.sum[h][i] / n) / (n - 1);
        variance += f * factors[h].surface[c] * covariance;
      }
    }
    const double off = mixed - mean, weight = 1 / (mean * mean + kRelMseDenominator);
    look.real += (off * off - variance / others) * weight / static_cast<double>(values);
  }
  look.held = e.relmse_lo <= look.real && look.real <= e.relmse_hi;
  return look;
}

}  // namespace

MixCoverage measure_mixes(const MixJobs& jobs) {
  const MixRenders renders(jobs);
  std::vector<GroupsImage> all(static_cast<std::size_t>(jobs.images), {Film({jobs.size, 32}), {}});
  on_threads(jobs.threads, all.size(), [&](std::size_t n) { all[n] = renders.render(jobs.first_seed + n); });
  const GroupMoments moments(all);
  std::vector<MixLook> looks(all.size() * static_cast<std::size_t>(jobs.mixes));
  on_threads(jobs.threads, all.size(), [&](std::size_t n) {
    std::mt19937_64 random(jobs.first_seed + n);
    for (std::size_t m = 0; m < static_cast<std::size_t>(jobs.mixes); ++m)
      looks[n * static_cast<std::size_t>(jobs.mixes) + m] =
          look_at(all[n], moments, all.size(), random_factors(renders.groups(), random));
  });
  MixCoverage out{.mixes = static_cast<int>(looks.size())};
  Quotient ratio;
  for (const MixLook& l : looks) {
    out.trusted += l.trusted;
    out.held += l.trusted && l.held;
    ratio.add(l.estimated, l.real);
  }
  out.held /= std::max(out.trusted, 1);
  out.relmse_ratio = ratio.ratio();
  return out;
}

std::string mix_line(const MixJobs& jobs, const MixCoverage& c) {
  return fmt::format(
      "{} x {}, {} spp: {} mixes, {} trusted, {:.1f} % held, "
      "estimated / true relMSE {:.3f} +- {:.3f}",
      jobs.size.width, jobs.size.height, jobs.spp, c.mixes, c.trusted, 100 * c.held, c.relmse_ratio.value,
      c.relmse_ratio.sigma);
}

}  // namespace ls::test
