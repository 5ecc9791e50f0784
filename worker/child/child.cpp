#include "worker/child/child.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <csignal>
#include <map>
#include <mutex>

#include "core/base/check.h"
#include "core/base/log.h"
#include "core/base/program_output.h"
#include "core/base/safe_text.h"
#include "worker/child/process.h"
#include "worker/child/protocol.h"

namespace ls::worker {
namespace {

using child::Kind;
using child::Outcome;
using child::Process;
using child::Reply;
using child::Request;
using child::Slot;

// A unit is innocent of the death of the child process that was rendering it if another unit caused the
// death. The next child then renders it again. After this many such deaths in a row the unit is reported as
// failed all the same. Normally that does not happen: each death is reported as a failure of the unit that
// caused it, and after three failures in a job the coordinator gives this worker no more units of that job.
constexpr int kInnocentDeaths = 64;

std::size_t floats_of(const LocalJob& job, const LeaseUnit& unit) {
  return static_cast<std::size_t>(unit.rect.pixels()) *
         (kPartialChannels + planes_of(aovs_of(job.brief.settings)).count());
}
// If this many children in a row exit before they are ready, the backend is broken.
constexpr int kUnreadyChildren = 5;
// Longest time from a child's start to its hello. This includes the computations that determine the numeric
// class.
constexpr Duration kStartLimit = std::chrono::minutes(2);
// Longest time that the child may take to answer after the agent has set a slot's stop flag, or the stop flag
// of a build; then it is killed
constexpr Duration kStopLimit = std::chrono::seconds(10);
// The same for a build while no unit is being rendered, so that killing the child costs little.
constexpr Duration kLoneBuildStopLimit = std::chrono::milliseconds(500);

// Sets in `failure` the pixel and the number of the sample that the slot was rendering. Sets nothing if the
// slot had not begun a sample, or names no pixel of the image.
void note_place(const Slot& slot, const LocalJob& job, UnitFailure& failure) {
  const FrameSize size = job.brief.settings.size;
  const std::int32_t x = slot.where.x, y = slot.where.y;
  if (x < 0 || y < 0 || x >= size.width || y >= size.height) return;
  failure.pixel = {x, y};
  failure.sample = slot.where.sample;
}

// The child's measurement of seconds within `elapsed`, which this process has measured around it.
double measured(double reported, double elapsed) { return reported > 0 ? std::min(reported, elapsed) : 0; }

// A failure with the child's reason, which is cut if no renderer of ours would give one of such a length.
UnitFailure refused(const Process::Answer& answer) {
  constexpr std::size_t kLongestReason = 4096;
  return {.scene_at_fault = answer.reply.outcome == Outcome::scene_at_fault,
          .reason = plain_text(std::string_view(answer.text).substr(0, kLongestReason))};
}

class ChildBackend final : public RenderBackend {
 public:
  explicit ChildBackend(ChildOptions options) : options_(std::move(options)) {
    for (int i = 0; i < options_.slots; ++i) free_slots_.push_back(i);
  }

  Result<void> start() {
    const std::lock_guard control(control_mutex_);
    if (auto process = living_process(); !process) return tl::unexpected<Error>(process.error());
    return {};
  }

  Digest numeric_class() const override { return numeric_class_; }
  std::string platform() const override { return platform_; }
  tl::expected<void, UnitFailure> prepare(const LocalJob& job, const std::atomic<bool>& stop) override;
  tl::expected<RenderedUnit, UnitFailure> render(const LocalJob& job, const LeaseUnit& unit,
                                                 const std::atomic<bool>& stop) override;
  void forget(const JobId& job) override;
  std::uint64_t rss_bytes() const override;
  std::optional<Error> broken() const override;
  void shutdown() override;

 private:
  struct Attempt {
    tl::expected<RenderedUnit, UnitFailure> outcome;
    bool innocent = false;  // true if the child died because of another unit
  };
  Result<std::shared_ptr<Process>> living_process();
  Result<std::shared_ptr<Process>> spawn_greeted();
  Result<void> greet(Process& process);
  tl::unexpected<Error> broken_by(std::string why);
  bool send_forgotten(Process& process);
  // Returns a child that has built the job's world (its scene, ready to render). Sets `number` to the number
  // that stands for the job in requests to the child.
  tl::expected<std::shared_ptr<Process>, UnitFailure> ready_process(const LocalJob& job,
                                                                    const std::atomic<bool>& stop,
                                                                    std::uint64_t& number);
  tl::expected<void, UnitFailure> prepare_in(Process& process, const LocalJob& job,
                                             const std::atomic<bool>& stop, std::uint64_t number);
  Attempt attempt(Process& process, int index, std::uint64_t number, const LocalJob& job,
                  const LeaseUnit& unit, const std::atomic<bool>& stop);
  Attempt judge_death(Process& process, int index, const LocalJob& job);
  std::uint64_t number_of(const JobBrief& brief);

  const ChildOptions options_;
  const SystemClock clock_;
  LineBudget lines_;  // of all children together
  Digest numeric_class_;
  std::string platform_;
  // Held during each request on the control channel and while a new child is started, so that only one thread
  // at a time does either.
  std::mutex control_mutex_;
  mutable std::mutex mutex_;
  std::shared_ptr<Process> process_;  // guarded by mutex_, as are all members below
  std::map<WorldKey, std::uint64_t> numbers_;
  // Numbers of the jobs whose worlds the child should free. They are sent to the child before it builds its
  // next world.
  std::vector<std::uint64_t> forgotten_;
  std::uint64_t next_number_ = 1;
  std::vector<int> free_slots_;
  bool shut_down_ = false;
  std::condition_variable ending_;  // signalled when shut_down_ is set
  std::optional<Error> broken_;
};

// Returns the child, and starts a new one if it has ended. Call with control_mutex_ held.
Result<std::shared_ptr<Process>> ChildBackend::living_process() {
  {
    const std::lock_guard lock(mutex_);
    if (shut_down_) return fail(Errc::unavailable, "the worker is ending");
    if (process_ && process_->alive()) return process_;
  }
  auto process = spawn_greeted();
  if (!process) return process;
  const std::lock_guard lock(mutex_);
  if (shut_down_) return fail(Errc::unavailable, "the worker is ending");
  process_ = *process;
  forgotten_.clear();
  return process;
}

// Starts a child and waits for its hello. Repeats a failed start, because the resources that were missing
// (address space, descriptors) may be available a little later.
Result<std::shared_ptr<Process>> ChildBackend::spawn_greeted() {
  Duration pause = options_.respawn_pause;
  for (int tries = 1;; ++tries, pause *= 2) {
    auto process = Process::spawn(options_, lines_);
    if (!process) return process;
    const auto ok = greet(**process);
    if (ok) return process;
    if (ok.error().code != Errc::unavailable) return tl::unexpected<Error>(ok.error());
    if (tries == kUnreadyChildren) return broken_by(ok.error().message);
    log_warn("", ok.error().message);
    std::unique_lock lock(mutex_);
    if (ending_.wait_for(lock, pause, [&] { return shut_down_; }))
      return fail(Errc::unavailable, "the worker is ending");
  }
}

// Waits for the child's hello. Returns unavailable if another child may succeed: this one exited before its
// hello and did not die of a signal, and an earlier child did send its hello.
Result<void> ChildBackend::greet(Process& process) {
  const TimePoint deadline = clock_.now() + kStartLimit;
  const auto answer = process.ask(Process::kControl, Request{.kind = Kind::hello}, {}, [&] {
    if (clock_.now() > deadline) process.kill();
  });
  if (!answer) {
    const Process::End end = process.end();
    std::string why = fmt::format("the render child {} before it was ready", end.text);
    const bool first = numeric_class_ == Digest{};
    if (first) why += "; run the worker with --fake to see whether the renderer is the cause";
    return fail(first || end.signal ? Errc::internal : Errc::unavailable, std::move(why));
  }
  // The first child determines numeric_class_ and platform_, before any other thread is started
  if (numeric_class_ == Digest{}) {
    numeric_class_ = answer->reply.numeric_class;
    platform_ = answer->text;
  }
  if (numeric_class_ != answer->reply.numeric_class)
    return broken_by(
        fmt::format("a new render child has the numeric class {}, not {} as this worker began with",
                    answer->reply.numeric_class.hex(), numeric_class_.hex()));
  return {};
}

tl::unexpected<Error> ChildBackend::broken_by(std::string why) {
  std::error_code unknown;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  Error error{Errc::failed_precondition,
              fmt::format("{}: {} or one of its libraries has been replaced, or this machine's arithmetic is "
                          "at fault; start the worker again",
                          why, program.string())};
  const std::lock_guard lock(mutex_);
  broken_ = error;
  return tl::unexpected<Error>(std::move(error));
}

std::optional<Error> ChildBackend::broken() const {
  const std::lock_guard lock(mutex_);
  return broken_;
}

std::uint64_t ChildBackend::number_of(const JobBrief& brief) {
  const std::lock_guard lock(mutex_);
  const auto [it, is_new] = numbers_.try_emplace(key_of(brief), next_number_);
  if (is_new) ++next_number_;
  return it->second;
}

tl::expected<void, UnitFailure> ChildBackend::prepare(const LocalJob& job, const std::atomic<bool>& stop) {
  std::uint64_t number = 0;
  if (auto process = ready_process(job, stop, number); !process)
    return tl::unexpected<UnitFailure>(process.error());
  return {};
}

tl::expected<std::shared_ptr<Process>, UnitFailure> ChildBackend::ready_process(const LocalJob& job,
                                                                                const std::atomic<bool>& stop,
                                                                                std::uint64_t& number) {
  number = number_of(job.brief);
  const auto knows = [&](Process& process) {
    const std::lock_guard lock(process.prepared_mutex);
    return process.prepared.contains(number);
  };
  const auto current = [&] {
    const std::lock_guard lock(mutex_);
    return process_;
  }();
  if (current && knows(*current) && current->alive()) return current;
  const std::lock_guard control(control_mutex_);
  auto process = living_process();
  // If the child dies while it frees worlds, a new child is started, which has no worlds to free.
  if (process && !send_forgotten(**process)) process = living_process();
  if (!process) return unit_failure(process.error().message);
  if (knows(**process)) return *process;
  if (auto ok = prepare_in(**process, job, stop, number); !ok) return tl::unexpected<UnitFailure>(ok.error());
  return *process;
}

// Makes the child free the worlds of the jobs in `forgotten_`. Returns false if the child has died.
bool ChildBackend::send_forgotten(Process& process) {
  std::vector<std::uint64_t> forgotten;
  {
    const std::lock_guard lock(mutex_);
    forgotten.swap(forgotten_);
  }
  for (const std::uint64_t old : forgotten) {
    const TimePoint deadline = clock_.now() + options_.forget_limit;
    const Request request{.kind = Kind::forget, .job = old};
    const auto answer = process.ask(Process::kControl, request, {}, [&] {
      if (clock_.now() > deadline) process.condemn(Process::kControl, Process::Fault::hung);
    });
    if (!answer) {
      log_warn("", fmt::format("the renderer {} while it freed a scene", process.end().text));
      return false;
    }
    const std::lock_guard lock(process.prepared_mutex);
    process.prepared.erase(old);
  }
  return true;
}

// Builds the job's world in the child. If `stop` becomes true, the child is told to abandon it. A child that
// does not obey is killed: soon if it does nothing else, later if that costs other units.
tl::expected<void, UnitFailure> ChildBackend::prepare_in(Process& process, const LocalJob& job,
                                                         const std::atomic<bool>& stop,
                                                         std::uint64_t number) {
  const std::string text = child::to_text(job);
  if (text.size() > child::kTextBytes)
    return unit_failure("the the job names more files than a message to the render child holds");
  const TimePoint deadline = clock_.now() + options_.prepare_limit;
  bool too_long = false;
  std::optional<TimePoint> stop_since;
  process.stop_build() = false;
  process.preparing = true;
  const Request request{.kind = Kind::prepare, .job = number};
  const auto answer = process.ask(Process::kControl, request, text, [&] {
    const TimePoint now = clock_.now();
    too_long = now > deadline;
    if (stop && !stop_since) {
      process.stop_build() = true;
      stop_since = now;
    }
    const Duration limit = process.rendering == 0 ? kLoneBuildStopLimit : kStopLimit;
    if (too_long || (stop_since && now - *stop_since > limit))
      process.condemn(Process::kControl, Process::Fault::hung);
  });
  if (!answer) {
    const Process::End end = process.end();
    if (stop_since) return unit_failure("told to stop");
    return tl::unexpected<UnitFailure>(
        UnitFailure{.reason = too_long ? fmt::format("building the scene took longer than {:.0f} s",
                                                     seconds(options_.prepare_limit))
                                       : fmt::format("the renderer {} while it built the scene", end.text),
                    .signal = end.signal});
  }
  process.preparing = false;
  if (answer->reply.outcome == Outcome::stopped) return unit_failure("told to stop");
  if (answer->reply.outcome != Outcome::ok) return tl::unexpected<UnitFailure>(refused(*answer));
  const std::lock_guard lock(process.prepared_mutex);
  process.prepared.insert(number);
  return {};
}

tl::expected<RenderedUnit, UnitFailure> ChildBackend::render(const LocalJob& job, const LeaseUnit& unit,
                                                             const std::atomic<bool>& stop) {
  if (floats_of(job, unit) > child::kSlotFloats) return unit_failure("the tile is too large");
  int slot = -1;
  {
    const std::lock_guard lock(mutex_);
    CHECK(!free_slots_.empty(), "more threads render than the child has slots ({})", options_.slots);
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  Attempt last{unit_failure("the renderer kept dying of other units"), true};
  for (int i = 0; i < kInnocentDeaths && last.innocent && !stop; ++i) {
    std::uint64_t number = 0;
    const auto process = ready_process(job, stop, number);
    last = process ? attempt(**process, slot, number, job, unit, stop)
                   : Attempt{tl::unexpected<UnitFailure>(process.error()), false};
  }
  const std::lock_guard lock(mutex_);
  free_slots_.push_back(slot);
  return std::move(last.outcome);
}

ChildBackend::Attempt ChildBackend::attempt(Process& process, int index, std::uint64_t number,
                                            const LocalJob& job, const LeaseUnit& unit,
                                            const std::atomic<bool>& stop) {
  Slot& slot = process.slot(index);
  slot.stop = false;
  slot.where.x = slot.where.y = -1;
  std::uint64_t seen = 0;
  TimePoint since = clock_.now();
  std::optional<TimePoint> stop_since;
  const auto watch = [&] {
    const TimePoint now = clock_.now();
    if (stop && !stop_since) {
      slot.stop = true;
      stop_since = now;
    }
    const std::uint64_t place =
        slot.where.sample * 0x9e3779b97f4a7c15ULL ^
        (static_cast<std::uint64_t>(static_cast<std::uint32_t>(slot.where.x.load())) << 32 |
         static_cast<std::uint32_t>(slot.where.y.load()));
    if (place != seen) {
      seen = place;
      since = now;
    }
    const bool hangs = now - since > options_.hang_limit || (stop_since && now - *stop_since > kStopLimit);
    if (hangs && process.alive()) process.condemn(index, Process::Fault::hung);
  };
  const Request request{Kind::render, 0, number, unit.tile, unit.round, unit.rect, unit.samples};
  const TimePoint asked = clock_.now();
  ++process.rendering;
  const auto answer = process.ask(index, request, {}, watch);
  --process.rendering;
  if (!answer) return judge_death(process, index, job);
  const double elapsed = seconds(clock_.now() - asked);
  const Reply& reply = answer->reply;
  if (reply.outcome != Outcome::ok) {
    UnitFailure failure = refused(*answer);
    note_place(slot, job, failure);
    return {tl::unexpected<UnitFailure>(std::move(failure)), false};
  }
  RenderedUnit out;
  const JobBrief& brief = job.brief;
  out.partial.header = {brief.scene, brief.settings_digest, numeric_class_, unit.rect, unit.samples};
  out.partial.sums.assign(slot.sums, slot.sums + floats_of(job, unit));
  out.partial.aovs = aovs_of(brief.settings);
  out.cpu_seconds = measured(reply.cpu_seconds, elapsed);
  out.wall_seconds = measured(reply.wall_seconds, elapsed);
  out.techniques = TechniqueSet::of_bits(reply.techniques);
  if (!answer->text.empty()) {
    auto health = parse_health(answer->text);
    if (!health)
      return {unit_failure("the renderer's answer cannot be read: " + plain_text(health.error().message)),
              false};
    out.health = std::move(*health);
  }
  return {std::move(out)};
}

ChildBackend::Attempt ChildBackend::judge_death(Process& process, int index, const LocalJob& job) {
  const Process::End end = process.end();
  const Slot& slot = process.slot(index);
  const bool crash = process.some_slot_crashed();
  const auto condemned = crash ? std::nullopt : process.condemned();
  const bool guilty = crash       ? slot.crashed.load(std::memory_order_relaxed)
                      : condemned ? condemned->slot == index
                                  : !process.preparing;
  if (!guilty) return {unit_failure("the renderer died of another unit"), true};
  UnitFailure failure{.reason = fmt::format("the renderer {}", end.text), .signal = end.signal};
  if (condemned) {
    switch (condemned->fault) {
      case Process::Fault::hung:
        failure.reason = fmt::format("the renderer hung: no sample finished within {:.3g} s",
                                     seconds(options_.hang_limit));
        break;
      case Process::Fault::answered_nonsense:
        failure.reason = "the renderer answered nonsense";
        break;
      case Process::Fault::closed_its_channel:
        failure.reason = "the renderer closed its channel without an answer";
        break;
    }
  } else if (end.signal == SIGKILL) {
    failure.reason += "; the system may have run out of memory";
  }
  note_place(slot, job, failure);
  log_warn(fmt::format("slot={}", index), failure.reason);
  return {tl::unexpected<UnitFailure>(std::move(failure)), false};
}

void ChildBackend::forget(const JobId& job) {
  const std::lock_guard lock(mutex_);
  std::erase_if(numbers_, [&](const auto& entry) {
    if (entry.first.job == job) forgotten_.push_back(entry.second);
    return entry.first.job == job;
  });
}

std::uint64_t ChildBackend::rss_bytes() const {
  const std::lock_guard lock(mutex_);
  return process_ ? process_->rss_bytes() : 0;
}

void ChildBackend::shutdown() {
  const std::lock_guard lock(mutex_);
  shut_down_ = true;
  ending_.notify_all();
  if (process_) process_->kill();
}

}  // namespace

Result<std::unique_ptr<RenderBackend>> make_child_backend(ChildOptions options) {
  if (options.slots < 1 || options.slots > child::kMostSlots)
    return fail(Errc::invalid_argument, fmt::format("--threads must be 1 to {}", child::kMostSlots));
  auto backend = std::make_unique<ChildBackend>(std::move(options));
  if (auto ok = backend->start(); !ok) return tl::unexpected<Error>(ok.error());
  return backend;
}

}  // namespace ls::worker
