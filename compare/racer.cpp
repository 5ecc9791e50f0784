#include "compare/racer.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "compare/picture.h"
#include "core/base/clock.h"
#include "core/image/film/film.h"
#include "worker/render/render.h"

namespace ls::race {
namespace {

// A round (a range of samples that is rendered in all pixels) is shortened if it does not fit into the
// remaining time. It is left out if it would then add less than 1 / kLeastShare of the samples rendered so
// far.
constexpr std::uint64_t kLeastShare = 16;

// A turn ends after this many wall seconds, unless the round ends earlier. At the end of a turn threads wait
// until the last tile is rendered; the turn is long enough to make this wait a small part of it. It is short
// enough that changes of the machine's speed affect all racers.
constexpr double kTurnSeconds = 1;

// Runs `work` on `threads` threads at once; returns their total CPU seconds.
template <class Work>
double on_threads(int threads, const Work& work) {
  std::mutex mutex;
  double cpu = 0;
  const auto timed = [&] {
    const double start = thread_cpu_seconds();
    work();
    const double used = thread_cpu_seconds() - start;
    const std::lock_guard lock(mutex);
    cpu += used;
  };
  std::vector<std::jthread> team;
  for (int i = 1; i < threads; ++i) team.emplace_back(timed);
  timed();
  team.clear();
  return cpu;
}

class RenderRacer final : public Racer {
 public:
  RenderRacer(RenderEntry entry, const Conditions& conditions)
      : entry_(std::move(entry)),
        conditions_(conditions),
        film_(entry_.grid),
        sums_(2 * values(), 0.),
        range_(next_range(0, 0, conditions.time, conditions.most_spp)) {
    std::atomic<TileIndex> next{0};
    const auto tiles = std::min<TileIndex>(entry_.grid.count(), static_cast<TileIndex>(conditions_.threads));
    on_threads(conditions_.threads, [&] {
      for (TileIndex t = next++; t < tiles; t = next++)
        (void)render::render_tile(*entry_.world, entry_.grid.rect(t), {0, 2}, nullptr, nullptr);
    });
  }

  Turn next() const override {
    if (!range_) return {true, used(), 0};
    const double round = seconds_per_sample_ * static_cast<double>(range_->count());
    const double rest =
        round * (1 - static_cast<double>(next_tile_) / static_cast<double>(entry_.grid.count()));
    return {false, used(), std::min(rest, kTurnSeconds)};
  }

  Result<void> take_turn(const std::atomic<bool>& stop) override {
    const TimePoint begin = clock_.now();
    std::atomic<bool> ended{false};
    const double cpu = on_threads(conditions_.threads, [&] {
      while (!ended && !stop) {
        const auto ok = one_tile(stop);
        if (!ok || *ok || seconds(clock_.now() - begin) >= kTurnSeconds) ended = true;
      }
    });
    cost_ = cost_ + Cost{seconds(clock_.now() - begin), cpu};
    if (trouble_) return tl::unexpected(*trouble_);
    if (stop) return fail(Errc::failed_precondition, "told to stop");
    if (next_tile_ < entry_.grid.count()) return {};
    return end_round();
  }

  std::vector<Checkpoint> checkpoints() const override { return points_; }
  std::vector<std::filesystem::path> halves() const override { return {file("a"), file("b")}; }
  std::vector<std::string> notes() const override {
    std::vector<std::string> out;
    for (const auto& [cause, entry] : health_.causes) out.push_back(sentence(cause, entry.count));
    return out;
  }

 private:
  std::size_t values() const {
    return 3 * static_cast<std::size_t>(entry_.grid.frame.width) *
           static_cast<std::size_t>(entry_.grid.frame.height);
  }
  double used() const { return conditions_.seconds(cost_); }
  std::filesystem::path file(const std::string& what) const {
    return entry_.folder / fmt::format("{}.{}", entry_.name, what);
  }

  // Renders the next tile of the round and folds it (adds it to the image). Returns true if the turn ends
  // here: no other tile of the round is left, rendering was stopped, or another thread had an error. nullopt:
  // this tile had an error, which is in trouble_.
  std::optional<bool> one_tile(const std::atomic<bool>& stop) {
    TileIndex tile;
    {
      const std::lock_guard lock(mutex_);
      if (trouble_ || next_tile_ >= entry_.grid.count()) return true;
      tile = next_tile_++;
    }
    Partial partial;
    partial.header.tile = entry_.grid.rect(tile);
    partial.header.samples = *range_;
    auto rendered = render::render_tile(*entry_.world, partial.header.tile, *range_, &stop, nullptr);
    if (rendered.stopped) return true;
    partial.sums = std::move(rendered.sums);
    const Digest digest;  // zero, since a race does not use the film's tile_digest()
    const std::lock_guard lock(mutex_);
    const auto folded = film_.fold(tile, round_, partial, digest);
    if (!folded) {
      trouble_ = folded.error();
      return std::nullopt;
    }
    health_.merge(rendered.health);
    add(partial);
    return tile + 1 == entry_.grid.count();
  }

  // Adds the partial (the pixel sums of one tile) to sums_, the sums of the frame for each half of the
  // samples. The film does not provide these.
  void add(const Partial& partial) {
    const PixelRect& rect = partial.header.tile;
    const auto pixels = static_cast<std::size_t>(rect.pixels());
    std::size_t p = 0;
    for (int y = rect.y0; y < rect.y1; ++y)
      for (int x = rect.x0; x < rect.x1; ++x, ++p)
        for (std::size_t c = 0; c < 6; ++c)
          sums_[c / 3 * values() + 3 * index(x, y) + c % 3] +=
              static_cast<double>(partial.sums[c * pixels + p]);
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(entry_.grid.frame.width) +
           static_cast<std::size_t>(x);
  }

  Result<void> end_round() {
    const std::uint64_t spp = range_->s1;
    const bool cut = *range_ != round_range(round_);
    seconds_per_sample_ = used() / static_cast<double>(spp);
    next_tile_ = 0;
    ++round_;
    range_ = cut ? std::nullopt
                 : next_range(round_, seconds_per_sample_, conditions_.time - used(), conditions_.most_spp);
    Checkpoint point{static_cast<double>(spp), cost_, !range_, image_error(film_.error()),
                     file(std::to_string(spp))};
    if (auto ok = keep(point.picture, means(0, 2, spp)); !ok) return ok;
    points_.push_back(std::move(point));
    if (range_) return {};
    if (auto ok = keep(file("a"), means(0, 1, spp / 2)); !ok) return ok;
    return keep(file("b"), means(1, 2, spp / 2));
  }

  // Returns the mean image of the halves [from, to) of the samples: [0, 1) is half A, [1, 2) is half B, and
  // [0, 2) is both. `samples` is the number of samples per pixel in these halves.
  Pixels means(std::size_t from, std::size_t to, std::uint64_t samples) const {
    Pixels out(values());
    for (std::size_t i = 0; i < out.size(); ++i) {
      double sum = 0;
      for (std::size_t h = from; h < to; ++h) sum += sums_[h * values() + i];
      out[i] = static_cast<float>(sum / static_cast<double>(samples));
    }
    return out;
  }

  const RenderEntry entry_;
  const Conditions conditions_;
  const SystemClock clock_;

  // Guards the data shared by the threads of a turn: film_, sums_, health_, next_tile_ and trouble_.
  std::mutex mutex_;
  Film film_;
  std::vector<double> sums_;  // pixel sums of half A, then of half B; R, G, B interleaved
  Health health_;
  TileIndex next_tile_ = 0;
  std::optional<Error> trouble_;

  RoundIndex round_ = 0;
  std::optional<SampleRange> range_;  // the samples of the current round; nullopt: the racer has finished
  double seconds_per_sample_ = 0;
  Cost cost_;
  std::vector<Checkpoint> points_;
};

}  // namespace

std::optional<SampleRange> next_range(RoundIndex k, double seconds_per_sample, double seconds_left,
                                      std::uint64_t most_spp) {
  SampleRange range = round_range(k);
  const std::uint64_t most = even_spp(most_spp);
  if (range.s0 >= most) return std::nullopt;
  range.s1 = std::min(range.s1, most);
  if (k == 0) return range;
  if (!(seconds_left > 0)) return std::nullopt;
  const double fits = seconds_left / seconds_per_sample;
  if (fits >= static_cast<double>(range.count())) return range;
  const auto whole = static_cast<std::uint64_t>(fits);
  const std::uint64_t count = whole - whole % 2;
  if (count < 2 || count * kLeastShare < range.s0) return std::nullopt;
  range.s1 = range.s0 + count;
  return range;
}

std::unique_ptr<Racer> make_render_racer(RenderEntry entry, const Conditions& conditions) {
  return std::make_unique<RenderRacer>(std::move(entry), conditions);
}

}  // namespace ls::race
