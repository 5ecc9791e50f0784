#include "coordinator/domain/adaptive_stop.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "coordinator/domain/limits.h"
#include "core/base/check.h"

namespace ls::coordinator {
namespace {

std::int64_t divided_up(std::int64_t a, std::int64_t b) { return (a + b - 1) / b; }

// How the tiles along one side of the frame form blocks. `tiles` is the number of tiles along this side, and
// `whole` the number of those that the frame's edge does not cut (1 if it cuts all). A block consists of
// `block` neighbouring whole tiles; the remaining tiles join the last block.
struct Side {
  int tiles, whole, block;
  int blocks() const { return std::max(1, whole / block); }
  int block_of(int tile) const { return std::min(tile / block, blocks() - 1); }
};

// Divides a side of `frame` pixels into blocks. A tile has `tile` pixels along this side, and a block has
// `across` pixels along the other side. A block gets as many tiles as it needs to reach kMinStopPixels
// pixels, or all whole tiles if they do not suffice.
Side side_of(int frame, int tile, int across) {
  const int whole = std::max(1, frame / tile);
  const auto wanted = divided_up(kMinStopPixels, std::int64_t{across} * std::min(tile, frame));
  return {(frame + tile - 1) / tile, whole, static_cast<int>(std::min<std::int64_t>(wanted, whole))};
}

}  // namespace

std::vector<std::vector<TileIndex>> stop_groups(const TileGrid& grid) {
  const int width = grid.frame.width, height = grid.frame.height;
  int square = grid.tile;
  while (std::int64_t{square} * square < kMinStopPixels) square += grid.tile;
  // Blocks are about square, unless the frame is too narrow in one direction: blocks are then longer in the
  // other.
  const Side x = side_of(width, grid.tile, std::min(square, height));
  const Side y = side_of(height, grid.tile, std::min(width, x.block * grid.tile));
  std::vector<std::vector<TileIndex>> groups(static_cast<std::size_t>(x.blocks()) *
                                             static_cast<std::size_t>(y.blocks()));
  for (TileIndex t = 0; t < grid.count(); ++t) {
    const int column = static_cast<int>(t) % x.tiles, row = static_cast<int>(t) / x.tiles;
    const auto group = static_cast<std::size_t>(y.block_of(row)) * static_cast<std::size_t>(x.blocks()) +
                       static_cast<std::size_t>(x.block_of(column));
    groups[group].push_back(t);
  }
  return groups;
}

namespace {

// The earliest round after which a tile may stop. After this round every pixel has kMinSppBeforeStop samples.
constexpr RoundIndex kFirstStop = round_count(kMinSppBeforeStop) - 1;
// A forecast needs this many rounds of every group of tiles. The first 3 rounds together have 8 samples per
// pixel
constexpr RoundIndex kFirstForecast = 3;

constexpr double samples_after(RoundIndex round) { return static_cast<double>(round_range(round).s1); }

double pixels_of(const TileGrid& grid, TileIndex tile) {
  return static_cast<double>(grid.rect(tile).pixels());
}

}  // namespace

double level_below(double gain) {
  if (!(gain > 0)) return 0;
  if (std::isinf(gain)) return std::numeric_limits<double>::max();
  // These steps are 2^(-1/4), 2^(-1/2), 2^(-3/4) and 1/2. They are constants, since exp2() may differ in its
  // last bits between machines.
  constexpr double kSteps[] = {0.84089641525371454303, 0.70710678118654752440, 0.59460355750136053336, .5};
  int exponent = 0;
  const double mantissa = std::frexp(gain, &exponent);  // in [1/2, 1)
  for (const double step : kSteps)
    if (step < mantissa) return std::ldexp(step, exponent);
  return std::ldexp(kSteps[0], exponent - 1);  // no step was smaller, since the mantissa is exactly 1/2
}

AdaptiveStop::AdaptiveStop(const TileGrid& grid, std::uint64_t spp)
    : grid_(grid),
      spp_(even_spp(spp)),
      last_(round_count(spp) - 1),
      group_of_(grid.count()),
      waiting_(grid.count()) {
  for (std::vector<TileIndex>& tiles : stop_groups(grid)) {
    Group g;
    for (const TileIndex t : tiles) {
      group_of_[t] = static_cast<std::uint32_t>(groups_.size());
      g.pixels += pixels_of(grid, t);
    }
    g.tiles = std::move(tiles);
    g.stop = g.predicted_last = std::min(kFirstStop, last_);
    groups_.push_back(std::move(g));
    advance(groups_.back());
  }
}

void AdaptiveStop::folded(TileIndex tile, RoundIndex round, double rel_error_sum) {
  Group& g = groups_[group_of_[tile]];
  CHECK(round == g.sums.size() + waiting_[tile].size(), "tile {}: round {} after {}", tile, round,
        g.sums.size() + waiting_[tile].size());
  waiting_[tile].push_back(rel_error_sum);
  const auto has_next = [&](TileIndex t) { return !waiting_[t].empty(); };
  while (std::all_of(g.tiles.begin(), g.tiles.end(), has_next)) {
    double sum = 0;
    for (const TileIndex t : g.tiles) {
      sum += waiting_[t].front();
      waiting_[t].erase(waiting_[t].begin());
    }
    g.sums.push_back(sum);
    ++rounds_seen_;
  }
  advance(g);
}

double AdaptiveStop::variance(const Group& g, RoundIndex round) const {
  return g.sums[round] * static_cast<double>(cut_range(round, spp_).s1) / (3 * g.pixels);
}

double AdaptiveStop::gain(const Group& g) const {
  return variance(g, g.stop - 1) / (samples_after(g.stop) * samples_after(g.stop + 1));
}

void AdaptiveStop::advance(Group& g) {
  while (!g.settled && g.stop <= g.sums.size()) {  // gain() needs the error after round stop - 1
    if (g.stop == last_ || gain(g) <= level_) {
      g.settled = true;
      ++settled_;
    } else {
      ++g.stop;
    }
  }
  g.predicted_last = std::max(g.predicted_last, g.stop);
}

double AdaptiveStop::predicted() const {
  if (last_ == 0) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0, pixels = 0;
  for (const Group& g : groups_) {
    sum += g.pixels * variance(g, g.stop - 1) / static_cast<double>(cut_range(g.stop, spp_).s1);
    pixels += g.pixels;
  }
  return sum / pixels;
}

double AdaptiveStop::measured() const {
  double sum = 0, pixels = 0;
  for (const Group& g : groups_) {
    sum += g.sums[g.stop];
    pixels += g.pixels;
  }
  return sum / (3 * pixels);
}

AdaptiveStop::Verdict AdaptiveStop::judge(double target) const {
  if (!settled()) return Verdict::unknown;
  if (!(predicted() <= target)) return Verdict::no;
  if (!std::all_of(groups_.begin(), groups_.end(), whole)) return Verdict::unknown;
  return measured() <= target ? Verdict::yes : Verdict::no;
}

bool AdaptiveStop::exhausted() const {
  return std::all_of(groups_.begin(), groups_.end(), [&](const Group& g) { return g.stop == last_; });
}

void AdaptiveStop::lower() {
  CHECK(settled(), "a level is left before all groups have come to it");
  double most = 0;
  for (const Group& g : groups_)
    if (g.stop != last_) most = std::max(most, gain(g));
  level_ = level_below(most);
  for (Group& g : groups_) {
    const bool ends_here = most > 0 ? gain(g) <= level_ : g.stop == last_;
    if (g.stop == last_ || ends_here) continue;
    g.settled = false;
    --settled_;
    g.stop = most > 0 ? g.stop + 1 : last_;
    advance(g);
  }
}

std::vector<RoundIndex> AdaptiveStop::ends() const {
  std::vector<RoundIndex> rounds(group_of_.size());
  for (const Group& g : groups_)
    for (const TileIndex t : g.tiles) rounds[t] = g.stop + 1;
  return rounds;
}

double AdaptiveStop::mean_spp() const {
  double samples = 0, pixels = 0;
  for (const Group& g : groups_) {
    samples += g.pixels * static_cast<double>(cut_range(g.stop, spp_).s1);
    pixels += g.pixels;
  }
  return samples / pixels;
}

bool AdaptiveStop::bound() const {
  return std::any_of(groups_.begin(), groups_.end(), [&](const Group& g) { return g.stop == last_; });
}

void AdaptiveStop::extend(std::uint64_t spp) {
  CHECK(!bound() && even_spp(spp) >= spp_, "from {} samples to {}", spp_, spp);
  spp_ = even_spp(spp);
  last_ = round_count(spp) - 1;
}

void AdaptiveStop::foresee(double target) {
  double pixels = 0;
  std::vector<double> a(groups_.size());
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const Group& g = groups_[i];
    if (g.sums.size() < kFirstForecast) return;
    a[i] = variance(g, static_cast<RoundIndex>(g.sums.size() - 1));
    pixels += g.pixels;
  }
  const double most = static_cast<double>(spp_), least = std::min(samples_after(kFirstStop), most);
  const auto samples = [&](double variance, double root_level) {
    return std::clamp(std::sqrt(variance) / root_level, least, most);
  };
  // The error of the image grows with the level (the threshold at which groups of tiles stop). So bisection
  // finds the square root of the level for `target`. It bisects the logarithm, so the middle is
  // sqrt(low * high); a square root has the same bits on every machine.
  double low = 0x1p-100, high = 0x1p40;
  for (int i = 0; i < 40; ++i) {
    const double middle = std::sqrt(low * high);
    double sum = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) sum += groups_[g].pixels * a[g] / samples(a[g], middle);
    (sum <= target * pixels ? low : high) = middle;
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const double n = samples(a[i], low);
    groups_[i].predicted_last =
        std::max(groups_[i].stop, round_count(static_cast<std::uint64_t>(std::ceil(n))) - 1);
  }
  speculative_ = true;
}

RoundIndex AdaptiveStop::predicted_last(TileIndex tile) const {
  return std::min(groups_[group_of_[tile]].predicted_last, last_) + 1;
}

double AdaptiveStop::variance(TileIndex tile) const {
  const Group& g = groups_[group_of_[tile]];
  return g.sums.empty() ? std::numeric_limits<double>::quiet_NaN()
                        : variance(g, static_cast<RoundIndex>(g.sums.size() - 1));
}

double AdaptiveStop::samples_missing(const Group& g, RoundIndex last) const {
  const auto samples_to = [this](std::size_t round) {
    return static_cast<double>(cut_range(static_cast<RoundIndex>(round), spp_).s1);
  };
  const double there = g.sums.empty() ? 0 : samples_to(g.sums.size() - 1);
  return g.pixels * std::max(0., samples_to(last) - there);
}

std::optional<double> AdaptiveStop::samples_left() const {
  if (!speculative_) return std::nullopt;
  double samples = 0;
  for (const Group& g : groups_) samples += samples_missing(g, std::min(g.predicted_last, last_));
  return samples;
}

double AdaptiveStop::samples_to_limit() const {
  double samples = 0;
  for (const Group& g : groups_) samples += samples_missing(g, last_);
  return samples;
}

namespace {

bool meets(const DenoisedCheck* check, double target) {
  return check != nullptr && check->at_most && *check->at_most <= target;
}

}  // namespace

const DenoisedCheck* DenoisedTarget::find(double spp) const {
  const auto found = std::ranges::find(made_, spp, &DenoisedCheck::spp);
  return found == made_.end() ? nullptr : &*found;
}

DenoisedTarget::Answer DenoisedTarget::judge(double spp, double target) {
  if (spp != due_) {
    if (spp < kDenoisedCheckGrowth * due_) return Answer::go_on;
    before_ = due_;
    due_ = spp;
  }
  const DenoisedCheck* now = find(due_);
  if (now == nullptr) return Answer::check;
  return meets(now, target) && meets(find(before_), target) ? Answer::end : Answer::go_on;
}

bool DenoisedTarget::met(double target) const { return meets(find(due_), target); }

void DenoisedTarget::add(const DenoisedCheck& check) {
  if (find(check.spp) == nullptr) made_.push_back(check);
}

double DenoisedTarget::error_left(double target) const {
  const DenoisedCheck* now = find(due_);
  // The job cannot end before the next check, at which there are kDenoisedCheckGrowth times as many samples.
  // The error is assumed to fall as 1 / samples.
  const double next = 1 / kDenoisedCheckGrowth;
  return now != nullptr && now->at_most && *now->at_most > 0 ? std::min(next, target / *now->at_most) : next;
}

}  // namespace ls::coordinator
