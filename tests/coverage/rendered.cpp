#include "tests/coverage/rendered.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <stdexcept>
#include <utility>

#include "cli/local/local_scene.h"
#include "core/image/error/convergence.h"
#include "core/image/error/relative_weights.h"
#include "core/image/film/film.h"
#include "tests/support/threads.h"
#include "worker/render/render.h"
#include "worker/render/world/world.h"

namespace ls::test {
namespace {

// Both halves of one image after each of its rounds: tile by tile, each as three planes (HalfMeans).
using Stage = std::array<std::vector<double>, 2>;
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

  Stages render(std::uint64_t seed) const {
    const auto world = world_of(seed);
    const TileGrid grid{jobs_.size, RenderSettings{}.tile};
    Film film(grid);
    Stages stages;
    for (RoundIndex k = 0; k < round_count(jobs_.spp); ++k) {
      const SampleRange range = cut_range(k, jobs_.spp);
      Stage& stage = stages.emplace_back();
      for (TileIndex t = 0; t < grid.count(); ++t) {
        Partial partial{{{}, {}, {}, grid.rect(t), range}, {}};
        partial.sums = render::render_tile(*world, grid.rect(t), range, nullptr, nullptr).sums;
        (void)rendered(film.fold(t, k, partial));
        const auto halves = film.half_means(t);
        for (std::size_t h = 0; h < 2; ++h)
          stage[h].insert(stage[h].end(), halves[h].begin(), halves[h].end());
      }
    }
    return stages;
  }
  // True if the errors of all pixels of an image are correlated (area_error.h).
  bool common() const { return world_of(jobs_.first_seed)->need.connected; }

 private:
  std::shared_ptr<const render::World> world_of(std::uint64_t seed) const {
    RenderSettings settings;
    settings.size = jobs_.size;
    settings.seed = seed;
    settings.integrator = scene_.scene.integrator.name;
    settings.max_depth = scene_.scene.integrator.max_depth;
    settings.rr_depth = scene_.scene.integrator.rr_depth;
    return rendered(render::build_world(scene_.scene, settings, files_, 1));
  }

  const RenderedJobs& jobs_;
  const cli::LocalScene scene_;
  render::AssetFiles files_;
};

// The halves of an image as float64, one round after the other.
void keep(const Stages& stages, const std::filesystem::path& path) {
  const std::filesystem::path unfinished = path.string() + ".part";
  std::ofstream file(unfinished, std::ios::binary);
  for (const Stage& stage : stages)
    for (const auto& half : stage)
      file.write(reinterpret_cast<const char*>(half.data()),
                 static_cast<std::streamsize>(half.size() * sizeof(double)));
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written", unfinished.string()));
  std::filesystem::rename(unfinished, path);
}

Stages read_kept(const RenderedJobs& jobs, const std::filesystem::path& path) {
  Stages stages(round_count(jobs.spp));
  const auto values = static_cast<std::size_t>(3 * jobs.size.width * jobs.size.height);
  const std::size_t bytes = 2 * stages.size() * values * sizeof(double);
  if (std::filesystem::file_size(path) != bytes)
    throw std::runtime_error(
        fmt::format("{}: is an image of another size or number of samples", path.string()));
  std::ifstream file(path, std::ios::binary);
  for (Stage& stage : stages)
    for (auto& half : stage) {
      half.resize(values);
      file.read(reinterpret_cast<char*>(half.data()), static_cast<std::streamsize>(values * sizeof(double)));
    }
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  return stages;
}

std::vector<Stages> render_all(const RenderedJobs& jobs, const Renders& renders) {
  if (!jobs.kept.empty()) std::filesystem::create_directories(jobs.kept);
  std::vector<Stages> out(static_cast<std::size_t>(jobs.images));
  on_threads(jobs.threads, out.size(), [&](std::size_t n) {
    const std::uint64_t seed = jobs.first_seed + n;
    const auto path = jobs.kept / fmt::format("{}.f64", seed);
    if (!jobs.kept.empty() && std::filesystem::exists(path)) {
      out[n] = read_kept(jobs, path);
      return;
    }
    out[n] = renders.render(seed);
    if (!jobs.kept.empty()) keep(out[n], path);
  });
  return out;
}

constexpr std::size_t kTile = 32, kTilePixels = kTile * kTile;

// The means of an image over squares of 16 x 16 pixels.
std::vector<double> square_means(const std::vector<double>& image) {
  constexpr std::size_t kAcross = kTile / kCorrelatedSide;
  std::vector<double> out(image.size() / (kCorrelatedSide * kCorrelatedSide));
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::size_t plane = i / kTilePixels, y = i / kTile % kTile, x = i % kTile;
    out[(plane * kAcross + y / kCorrelatedSide) * kAcross + x / kCorrelatedSide] +=
        image[i] / static_cast<double>(kCorrelatedSide * kCorrelatedSide);
  }
  return out;
}

double mean_of_green(const std::vector<double>& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.size(); ++i) sum += i / kTilePixels % 3 == 1 ? image[i] : 0;
  return 3 * sum / static_cast<double>(image.size());
}

// Knows the right answer for any pair of images: the mean of the halves of all others.
class RightAnswer {
 public:
  // `halves`: the halves of all images, both halves of an image beside each other
  explicit RightAnswer(std::vector<std::vector<double>> halves)
      : halves_(std::move(halves)), sum_(halves_.front().size()), variance_(sum_.size()) {
    const auto n = static_cast<double>(halves_.size());
    for (const auto& half : halves_)
      for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += half[i];
    for (const auto& half : halves_)
      for (std::size_t i = 0; i < sum_.size(); ++i) {
        const double d = half[i] - sum_[i] / n;
        variance_[i] += d * d / (n - 1);
      }
  }

  // The right answer for value n of an image whose halves are of the images i and j.
  double right(std::size_t n, std::size_t i, std::size_t j) const {
    const double of_i = halves_[2 * i][n] + halves_[2 * i + 1][n],
                 of_j = i == j ? 0 : halves_[2 * j][n] + halves_[2 * j + 1][n];
    return (sum_[n] - of_i - of_j) / others(i, j);
  }
  // The standard error of right().
  double noise(std::size_t n, std::size_t i, std::size_t j) const {
    return std::sqrt(variance_[n] / others(i, j));
  }
  struct Errors {
    double mse = 0, relmse = 0;
  };
  Errors errors(const std::vector<double>& values, std::size_t i, std::size_t j) const {
    const auto count = static_cast<double>(values.size());
    Errors out;
    for (std::size_t n = 0; n < values.size(); ++n) {
      const double m = right(n, i, j), off = values[n] - m,
                   square = (off * off - variance_[n] / others(i, j)) / count;
      out.mse += square;
      out.relmse += square / (m * m + kRelMseDenominator);
    }
    return out;
  }

 private:
  double others(std::size_t i, std::size_t j) const {
    return static_cast<double>(halves_.size()) - (i == j ? 2 : 4);
  }

  std::vector<std::vector<double>> halves_;
  std::vector<double> sum_, variance_;
};

template <class Value>
RightAnswer right_answer_of(const std::vector<Stages>& all, const Value& value) {
  std::vector<std::vector<double>> halves;
  for (const Stages& s : all)
    for (const auto& half : s.back()) halves.push_back(value(half));
  return RightAnswer(std::move(halves));
}

// Where a true figure lies beside the stated interval.
enum class Place { unstated, below, held, above };
Place place(double lo, double real, double hi) {
  return real < lo ? Place::below : real > hi ? Place::above : Place::held;
}

// One pair of images after one round.
struct Look {
  std::size_t first = 0, second = 0;
  bool trusted = false;
  Place relmse{}, rmse{}, mean{}, squares{};
  double estimated_mse = 0, estimated_relmse = 0;
  RightAnswer::Errors real;
};

class Looks {
 public:
  Looks(const RenderedJobs& jobs, const std::vector<Stages>& all, bool common)
      : jobs_(jobs),
        all_(all),
        common_(common),
        pixels_(right_answer_of(all, [](const auto& half) { return half; })),
        squares_(right_answer_of(all, square_means)),
        green_(right_answer_of(all, [](const auto& half) { return std::vector{mean_of_green(half)}; })) {}

  // Looks at a pair after each round but the first.
  std::vector<Look> look(std::size_t first, std::size_t second) const {
    std::vector<Look> out;
    std::vector<ErrorPoint> points;
    for (std::size_t k = 0; k < all_[first].size(); ++k) {
      const TileError sums = sums_of(first, second, k);
      const ImageError e = image_error(sums);
      points.push_back({e.spp, e.spp, e.relmse, e.relmse_lo, e.relmse_hi});
      if (k == 0) continue;
      Look look{first, second, judge(points, e.verdict).trusted};
      look.estimated_mse = e.rmse * e.rmse;
      look.estimated_relmse = e.relmse;
      std::vector<double> image = all_[first][k][0];
      const std::vector<double>& other = all_[second][k][1];
      for (std::size_t i = 0; i < image.size(); ++i) image[i] = (image[i] + other[i]) / 2;
      look.real = pixels_.errors(image, first, second);
      if (look.trusted) {
        look.relmse = place(e.relmse_lo, look.real.relmse, e.relmse_hi);
        if (e.rmse_hi > 0) look.rmse = place(e.rmse_lo, std::sqrt(std::max(0.0, look.real.mse)), e.rmse_hi);
        if (e.settled) look_at_areas(area_error(sums.areas, common_), image, look);
      }
      out.push_back(look);
    }
    return out;
  }

 private:
  // The figures of the image that has half A of one image and half B of another.
  TileError sums_of(std::size_t first, std::size_t second, std::size_t k) const {
    const auto part = [&](std::size_t round, std::size_t tile) {
      constexpr std::size_t kValues = 3 * kTilePixels;
      const auto of = [&](std::size_t image, std::size_t half) {
        return std::span(all_[image][round][half]).subspan(tile * kValues, kValues);
      };
      return HalfMeans{kTile, kTile, of(first, 0), of(second, 1)};
    };
    const auto spp = [&](std::size_t round) {
      return cut_range(static_cast<RoundIndex>(round), jobs_.spp).s1;
    };
    TileError sums;
    for (std::size_t t = 0; t < all_[first][k][0].size() / (3 * kTilePixels); ++t) {
      if (k == 0) {
        sums.add(estimate_error(part(k, t), spp(k)));
        continue;
      }
      const EarlierMeans earlier{part(k - 1, t), spp(k - 1)};
      sums.add(estimate_error(part(k, t), spp(k), &earlier));
    }
    return sums;
  }

  void look_at_areas(const AreaError& areas, const std::vector<double>& image, Look& look) const {
    // The distance of two noisy means has the variances of both: the interval is as much wider.
    const double noise = green_.noise(0, look.first, look.second), mean = areas.mean[1],
                 half = std::hypot(areas.half_width[1], kNormal95 * noise);
    look.mean = place(mean - half, green_.right(0, look.first, look.second), mean + half);
    if (areas.relmse_hi > 0)
      look.squares =
          place(areas.relmse_lo, squares_.errors(square_means(image), look.first, look.second).relmse,
                areas.relmse_hi);
  }

  const RenderedJobs& jobs_;
  const std::vector<Stages>& all_;
  const bool common_;
  const RightAnswer pixels_, squares_, green_;
};

// Returns statistic(looks), and its standard error from leaving out each image with all of its pairs.
template <class Statistic>
Ratio jackknifed(const std::vector<Look>& looks, int images, const Statistic& statistic) {
  const double all = statistic(looks), n = images;
  double squares = 0;
  for (std::size_t image = 0; image < static_cast<std::size_t>(images); ++image) {
    std::vector<Look> others;
    for (const Look& l : looks)
      if (l.first != image && l.second != image) others.push_back(l);
    const double d = statistic(others) - all;
    squares += d * d;
  }
  return {all, std::sqrt(squares * (n - 1) / n)};
}

Held held_of(const std::vector<Look>& looks, int images, Place Look::*interval) {
  Held out;
  int above = 0, all_held = 0;
  for (const Look& l : looks) {
    out.stated += l.*interval != Place::unstated;
    above += l.*interval == Place::above;
    all_held += l.*interval == Place::held;
  }
  if (out.stated == 0) return out;
  out.above = static_cast<double>(above) / out.stated;
  const Ratio share = jackknifed(looks, images, [&](const std::vector<Look>& some) {
    double stated = 0, held = 0;
    for (const Look& l : some) {
      stated += l.*interval != Place::unstated;
      held += l.*interval == Place::held;
    }
    // An image without which no pair states the interval says nothing of the share.
    return stated > 0 ? held / stated : static_cast<double>(all_held) / out.stated;
  });
  out.share = share.value;
  out.sigma = share.sigma;
  return out;
}

Ratio ratio_of(const std::vector<Look>& looks, int images, double Look::*estimated,
               double RightAnswer::Errors::*real) {
  return jackknifed(looks, images, [&](const std::vector<Look>& some) {
    double above = 0, below = 0;
    for (const Look& l : some) above += l.*estimated, below += l.real.*real;
    return above / below;
  });
}

RenderedCell cell_of(const std::vector<Look>& looks, int images, std::uint64_t spp) {
  RenderedCell cell;
  cell.spp = spp;
  cell.images = static_cast<int>(looks.size());
  for (const Look& l : looks) {
    cell.trusted += l.trusted;
    cell.true_relmse += l.real.relmse / static_cast<double>(looks.size());
  }
  cell.relmse = held_of(looks, images, &Look::relmse);
  cell.rmse = held_of(looks, images, &Look::rmse);
  cell.mean = held_of(looks, images, &Look::mean);
  cell.squares = held_of(looks, images, &Look::squares);
  cell.mse_ratio = ratio_of(looks, images, &Look::estimated_mse, &RightAnswer::Errors::mse);
  cell.relmse_ratio = ratio_of(looks, images, &Look::estimated_relmse, &RightAnswer::Errors::relmse);
  return cell;
}

std::string share(const Held& h) {
  return h.stated == 0 ? "-"
                       : fmt::format("{:.1f} +- {:.1f} % of {}", 100 * h.share, 100 * h.sigma, h.stated);
}

}  // namespace

std::vector<RenderedCell> measure_rendered(const RenderedJobs& jobs) {
  if (jobs.size.width % 32 != 0 || jobs.size.height % 32 != 0)
    throw std::runtime_error("the sides of the images must be multiples of 32 pixels");
  if (jobs.images < 3 || jobs.pairs < 1 || jobs.pairs > jobs.images)
    throw std::runtime_error("there must be at least 3 images, and at most as many pairs of each");
  const Renders renders(jobs);
  const std::vector<Stages> all = render_all(jobs, renders);
  const Looks looks(jobs, all, renders.common());
  const std::size_t pairs = all.size() * static_cast<std::size_t>(jobs.pairs);
  std::vector<std::vector<Look>> looked(pairs);
  on_threads(jobs.threads, pairs, [&](std::size_t n) {
    const std::size_t first = n % all.size();
    looked[n] = looks.look(first, (first + n / all.size()) % all.size());
  });
  std::vector<RenderedCell> cells;
  for (std::size_t k = 0; k < looked.front().size(); ++k) {
    std::vector<Look> of_round;
    for (const auto& pair : looked) of_round.push_back(pair[k]);
    cells.push_back(cell_of(of_round, jobs.images, cut_range(static_cast<RoundIndex>(k + 1), jobs.spp).s1));
  }
  return cells;
}

std::string rendered_head() {
  return "| scene | pixels | spp | true relMSE | trusted | relMSE covered | above | RMSE covered | mean "
         "covered | "
         "16 x 16 covered | estimated / true MSE | relMSE "
         "|\n|---|---|---|---|---|---|---|---|---|---|---|---|";
}

std::string rendered_line(const RenderedJobs& jobs, const RenderedCell& c) {
  return fmt::format(
      "| {} | {} x {} | {} | {:.2g} | {} of {} | {} | {} | {} | {} | {} | {:.3f} +- {:.3f} | {:.3f} +- "
      "{:.3f} |",
      std::filesystem::path(jobs.scene).stem().string(), jobs.size.width, jobs.size.height, c.spp,
      c.true_relmse, c.trusted, c.images, share(c.relmse),
      c.relmse.stated > 0 ? fmt::format("{:.1f} %", 100 * c.relmse.above) : "-", share(c.rmse), share(c.mean),
      share(c.squares), c.mse_ratio.value, c.mse_ratio.sigma, c.relmse_ratio.value, c.relmse_ratio.sigma);
}

}  // namespace ls::test
