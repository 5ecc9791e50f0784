// The agent's render threads. Each takes one unit at a time: the first waiting unit of the leases, which are
// the lists of units assigned to this worker.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "core/base/failpoint.h"
#include "core/image/film/partial_size.h"
#include "util/protocol/limits.h"
#include "worker/agent/agent_impl.h"

namespace ls::worker {
namespace {

// Returns a failure if the result of this unit would not fit into a message; otherwise nullopt. The check is
// made before rendering, so that no unit is rendered in vain.
std::optional<UnitFailure> too_large(const LocalJob& job, const LeaseUnit& unit) {
  const std::uint64_t bytes =
      most_partial_file_bytes(static_cast<std::uint64_t>(unit.rect.pixels()), aovs_of(job.brief.settings));
  if (bytes <= limits::kPartialBytes) return std::nullopt;
  return UnitFailure{
      .scene_at_fault = true,
      .reason = fmt::format("a tile of {} x {} pixels makes a result of {} bytes, more than the {} that "
                            "one message takes; choose a smaller tile",
                            unit.rect.width(), unit.rect.height(), bytes, limits::kPartialBytes)};
}

}  // namespace

tl::expected<UnitResult, UnitFailure> Agent::Impl::rendered_unit(RenderSlot& slot, const LocalJob& job,
                                                                 const HeldLeases::Held& held) {
  if (options.tracer) slot.began = clock.now();
  if (auto failure = too_large(job, held.unit)) return tl::unexpected<UnitFailure>(std::move(*failure));
  auto rendered = backend.render(job, held.unit, slot.stop);
  if (!rendered) {
    slot.last_job = {};
    return tl::unexpected<UnitFailure>(std::move(rendered.error()));
  }
  const double gap = note_gap(slot, held.key.job, rendered->wall_seconds);
  const TimePoint packing = clock.now();
  auto exr = encode_partial(rendered->partial, job.brief.settings.size);
  if (!exr) return unit_failure("cannot encode the result: " + exr.error().message);
  UnitResult result;
  result.unit = held.key;
  result.exr = std::move(*exr);
  result.digest = unit_digest(rendered->partial);
  result.cpu_seconds = rendered->cpu_seconds;
  result.health = rendered->health;
  result.techniques = rendered->techniques;
  result.times.idle = std::max(0., gap - std::exchange(slot.last_transfer, 0));
  result.times.wait = std::max(0., rendered->wall_seconds - rendered->cpu_seconds);
  result.times.transfer = slot.last_transfer = seconds(clock.now() - packing);
  return result;
}

// Renders the unit through the backend. If a backend in this process runs out of memory, the unit fails and
// the process continues.
tl::expected<UnitResult, UnitFailure> Agent::Impl::render(RenderSlot& slot, const LocalJob& job,
                                                          const HeldLeases::Held& held) {
  try {
    return rendered_unit(slot, job, held);
  } catch (const std::bad_alloc&) {
    return unit_failure("out of memory while rendering");
  } catch (const std::exception& e) {
    return unit_failure(std::string("the renderer failed: ") + e.what());
  }
}

double Agent::Impl::note_gap(RenderSlot& slot, const JobId& job, double wall_seconds) {
  const TimePoint now = clock.now();
  double gap = 0;
  if (slot.last_job == job) {
    gap = seconds(now - slot.last_end) - wall_seconds;
    const std::lock_guard lock(mutex);
    gaps.add(gap);
  } else {
    slot.last_transfer = 0;
  }
  slot.last_job = job;
  slot.last_end = now;
  return gap;
}

void Agent::Impl::render_loop(RenderSlot& slot, std::stop_token token) {
  std::shared_ptr<const LocalJob> job;
  while (const auto held = next_unit(slot, token, job)) {
    auto outcome = render(slot, *job, *held);
    std::string missing = outcome ? "" : lost_file(*job);
    finished(slot, held->key, std::move(outcome), *job, std::move(missing));
    job.reset();
  }
}

// Waits until there is a unit to render, takes it and sets `job` to the unit's job. Returns nullopt if the
// thread should end.
std::optional<HeldLeases::Held> Agent::Impl::next_unit(RenderSlot& slot, std::stop_token token,
                                                       std::shared_ptr<const LocalJob>& job) {
  std::unique_lock lock(mutex);
  std::optional<HeldLeases::Held> held;
  const auto ready = [this](const JobId& id) {
    const auto it = jobs.find(id);
    return it != jobs.end() && it->second.state == Job::State::ready;
  };
  const auto found = [&] {
    const JobId* before = room_overdue() ? &room_wanted->job : nullptr;
    if (!draining && outbox.bytes() < options.outbox_bytes) held = table.take(ready, before);
    return held.has_value();
  };
  if (!work.wait(lock, token, found)) return std::nullopt;
  Job& current = jobs.at(held->key.job);
  current.last_use = ++uses;
  job = current.local;
  slot.unit = held->key;
  slot.stop = false;
  return held;
}

// Records the trace spans of a unit: that of rendering it and, unless it failed, that of packing its result.
// Call with the mutex held, before the unit is removed from `table`, the units that this worker holds.
void Agent::Impl::trace_unit(const RenderSlot& slot, const HeldLeases::Held& held,
                             tl::expected<UnitResult, UnitFailure>& outcome) {
  trace::Attributes attributes{{"lightshaft.job", held.key.job.value},
                               {"lightshaft.worker", options.hello.name},
                               {"lightshaft.tile", std::int64_t{held.key.tile}},
                               {"lightshaft.round", std::int64_t{held.key.round}},
                               {"lightshaft.first_sample", static_cast<std::int64_t>(held.unit.samples.s0)},
                               {"lightshaft.last_sample", static_cast<std::int64_t>(held.unit.samples.s1)}};
  if (!outcome) {
    return record("render unit", *held.trace, slot.began, clock.now(), std::move(attributes), true);
  }
  attributes.emplace_back("lightshaft.core_seconds", outcome->cpu_seconds);
  record("render unit", *held.trace, slot.began, slot.last_end, std::move(attributes));
  const TimePoint packed = slot.last_end + from_seconds(outcome->times.transfer);
  record("encode partial", *held.trace, slot.last_end, packed,
         {{"lightshaft.job", held.key.job.value},
          {"lightshaft.bytes", static_cast<std::int64_t>(outcome->exr.size())}});
  outcome->held_unix_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(held.since_unix_ns, 0));
  unsent.insert_or_assign(held.key, Unsent{*held.trace, packed});
}

void Agent::Impl::finished(RenderSlot& slot, const UnitKey& key,
                           tl::expected<UnitResult, UnitFailure> outcome, const LocalJob& from,
                           std::string missing) {
  failpoint("unit-rendered");
  const bool broken_backend = !outcome && backend.broken();
  {
    const std::lock_guard lock(mutex);
    slot.unit.reset();
    if (const auto job = jobs.find(key.job);
        !outcome && job != jobs.end() && job->second.local.get() == &from) {
      std::string& lost = job->second.lost;
      if (lost.empty() && !missing.empty()) {
        lost = missing;
        job->second.state = Job::State::idle;  // its files are fetched again
      }
      // If another unit has found that a file is missing, this one may have missed it, too, even if the file
      // is there again
      missing = lost;
    }
    if (outcome) cpu_seconds += outcome->cpu_seconds;
    if (options.tracer && !slot.stop)
      if (const auto* held = table.find(key); held && held->trace) trace_unit(slot, *held, outcome);
    // A unit that was stopped no longer belongs to this worker, so its outcome is dropped.
    const auto lease = slot.stop ? std::nullopt : table.finish(key);
    if (lease && outcome) {
      outcome->lease = *lease;
      if (const auto job = jobs.find(key.job); job != jobs.end()) {
        const UnitTimes load_times = std::exchange(job->second.unreported, {});
        outcome->times.load = load_times.load;
        outcome->times.build = load_times.build;
      }
      outbox.add(std::move(*outcome));
    } else if (lease && (broken_backend || !missing.empty())) {
      outgoing.push_back(LeaseReturned{*lease, {key}, missing});
    } else if (lease) {
      outcome.error().unit = key;
      outcome.error().lease = *lease;
      outbox.add(std::move(outcome.error()));
    }
    free_lost_world(key.job);
    work.notify_all();
  }
  inbox->nudge();
}

void Agent::Impl::free_lost_world(const JobId& id) {
  const auto job = jobs.find(id);
  if (job == jobs.end() || job->second.lost.empty()) return;
  for (const auto& slot : slots)
    if (slot->unit && slot->unit->job == id) return;
  backend.forget(id);
  job->second.local.reset();
  job->second.files.clear();
  job->second.lost.clear();
}

}  // namespace ls::worker
