#include "worker/fake/fake.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <vector>

#include "core/base/clock.h"
#include "core/base/parse_number.h"
#include "worker/fake/fake_pixels.h"

namespace ls::worker {
namespace {

constexpr std::size_t kAllocationChunk = 64 << 20;  // bytes that the fault `memory` allocates at a time
constexpr Duration kLongestNap = std::chrono::milliseconds(20);

class FakeBackend final : public LocalBackend {
 public:
  explicit FakeBackend(FakeOptions options) : options_(std::move(options)) {}

  Digest numeric_class() const override { return options_.numeric_class; }
  std::string platform() const override { return options_.platform; }
  tl::expected<void, UnitFailure> prepare(const LocalJob&, const std::atomic<bool>&) override { return {}; }
  void forget(const JobId&) override {}
  std::uint64_t rss_bytes() const override { return 0; }

  tl::expected<RenderedUnit, UnitFailure> render_marked(const LocalJob& job, const LeaseUnit& unit,
                                                        const std::atomic<bool>& stop,
                                                        render::Breadcrumb* where) override {
    const double start = thread_cpu_seconds();
    const auto begin = std::chrono::steady_clock::now();
    const JobBrief& brief = job.brief;
    if (where) {
      where->x.store(unit.rect.x0, std::memory_order_relaxed);
      where->y.store(unit.rect.y0, std::memory_order_relaxed);
      where->sample.store(unit.samples.s0, std::memory_order_relaxed);
    }
    const bool faulty = matches(brief.settings.seed, unit);
    if (faulty) inject_fault(stop);
    const double work = options_.sample_seconds * static_cast<double>(unit.rect.pixels()) *
                        static_cast<double>(unit.samples.count());
    if (!pause(options_.delay + from_seconds(work), stop)) return unit_failure("told to stop");
    RenderedUnit out;
    out.partial =
        fake_partial({brief.scene, brief.settings_digest, options_.numeric_class, unit.rect, unit.samples},
                     aovs_of(brief.settings));
    if (faulty && options_.fault.kind == FakeFault::Kind::wrong) out.partial.sums[0] += 1;
    if (faulty && options_.fault.kind == FakeFault::Kind::unhealthy)
      out.health.add(HealthCause::infinite, 2, {unit.rect.x0, unit.rect.y0, unit.samples.s0});
    out.cpu_seconds = thread_cpu_seconds() - start + work;
    out.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return out;
  }

 private:
  bool matches(std::uint64_t seed, const LeaseUnit& unit) const {
    const FakeFault& f = options_.fault;
    const auto is = [](std::int64_t wanted, std::uint64_t value) {
      return wanted < 0 || static_cast<std::uint64_t>(wanted) == value;
    };
    return f.kind != FakeFault::Kind::none && is(f.seed, seed) && is(f.tile, unit.tile) &&
           is(f.round, unit.round);
  }

  // Injects the faults that keep a unit from being finished.
  void inject_fault(const std::atomic<bool>& stop) {
    const FakeFault::Kind kind = options_.fault.kind;
    if (kind == FakeFault::Kind::crash) ::raise(SIGSEGV);
    while (kind == FakeFault::Kind::hang && !stop) ::usleep(1000);
    std::vector<std::vector<char>> chunks;
    while (kind == FakeFault::Kind::memory) chunks.emplace_back(kAllocationChunk, 'x');
  }

  // Sleeps for `delay`. Returns false if `stop` was set meanwhile. It checks `stop` every 1 to 20 ms (a
  // hundredth of the delay), not more often, since hundreds of fake workers may share a machine.
  static bool pause(Duration delay, const std::atomic<bool>& stop) {
    const auto end = std::chrono::steady_clock::now() + delay;
    const auto nap = std::clamp<Duration>(delay / 100, std::chrono::milliseconds(1), kLongestNap);
    for (auto left = delay; !stop && left > Duration{};
         left = std::chrono::duration_cast<Duration>(end - std::chrono::steady_clock::now()))
      ::usleep(static_cast<useconds_t>(
          std::chrono::duration_cast<std::chrono::microseconds>(std::min(left, nap)).count() + 1));
    return !stop;
  }

  const FakeOptions options_;
};

}  // namespace

Digest fake_numeric_class() { return sha256(std::string_view("fake")); }

std::unique_ptr<LocalBackend> make_fake_backend(FakeOptions options) {
  return std::make_unique<FakeBackend>(options);
}

Result<FakeFault> parse_fake_fault(std::string_view text) {
  FakeFault fault;
  if (text.empty()) return fault;
  std::size_t end = std::min(text.find(','), text.size());
  const std::string_view kind = text.substr(0, end);
  constexpr std::pair<std::string_view, FakeFault::Kind> kKinds[] = {{"crash", FakeFault::Kind::crash},
                                                                     {"hang", FakeFault::Kind::hang},
                                                                     {"memory", FakeFault::Kind::memory},
                                                                     {"wrong", FakeFault::Kind::wrong},
                                                                     {"unwell", FakeFault::Kind::unhealthy}};
  const auto known = std::ranges::find(kKinds, kind, &std::pair<std::string_view, FakeFault::Kind>::first);
  if (known == std::end(kKinds))
    return fail(Errc::invalid_argument,
                fmt::format("unknown fault '{}'; known: crash, hang, memory, wrong, unwell", kind));
  fault.kind = known->second;
  while (end < text.size()) {
    const std::size_t begin = end + 1;
    end = std::min(text.find(',', begin), text.size());
    const std::string_view item = text.substr(begin, end - begin);
    const std::size_t eq = item.find('=');
    const std::string_view name = item.substr(0, eq);
    std::int64_t* field = name == "seed"    ? &fault.seed
                          : name == "tile"  ? &fault.tile
                          : name == "round" ? &fault.round
                                            : nullptr;
    const auto value = parse_number<std::int64_t>(eq == std::string_view::npos ? "" : item.substr(eq + 1));
    if (!field || !value)
      return fail(Errc::invalid_argument,
                  fmt::format("'{}': expected seed=N, tile=N or round=N with an integer N", item));
    *field = *value;
  }
  return fault;
}

}  // namespace ls::worker
