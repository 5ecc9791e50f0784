#include "coordinator/service/result_pipeline.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "common/base/failpoint.h"
#include "common/base/log.h"
#include "coordinator/domain/limits.h"
#include "coordinator/service/core.h"

namespace ls::coordinator {
namespace {

// Writes that wait for the disk; above this number, results wait, too
constexpr std::size_t kMaxBackgroundWrites = 4096;

// How to handle a result. It is decided anew when the result arrives, before it is stored and before it is
// accepted, since the farm's state may have changed.
enum class Disposition {
  drop,         // nobody needs it
  other_class,  // it is of another numeric class than its job
  compare,      // its unit has an accepted result, with which the farm compares it
  accept
};
Disposition disposition(const Wanted& wanted, const Connection& from) {
  if (wanted.verdict == Wanted::Verdict::no) return Disposition::drop;
  if (wanted.numeric_class.value_or(from.numeric_class) != from.numeric_class)
    return Disposition::other_class;
  return wanted.verdict == Wanted::Verdict::yes ? Disposition::accept : Disposition::compare;
}

// Sets implausible times that the worker reports to 0: their sums go into records that must stay readable.
// Values that are not numbers are rejected with the result (verify_result).
void drop_impossible_times(UnitResult& result) {
  if (result.cpu_seconds > kMostUnitSeconds) result.cpu_seconds = 0;
  for (double* part : {&result.times.load, &result.times.build, &result.times.transfer, &result.times.idle,
                       &result.times.wait})
    *part = plausible_seconds(*part);
}

void acknowledge(Core&, Connection& to, const UnitKey& unit, std::optional<Error> refused = std::nullopt) {
  if (to.open) to.sink->send(ResultAck{unit, std::move(refused)});
  failpoint("result-acknowledged");
}

}  // namespace

void ResultPipeline::receive(const std::shared_ptr<Connection>& from, UnitResult result,
                             std::function<void()> next) {
  failpoint("result-arrived");
  Arrived arrived{from, std::move(result)};
  arrived.at = clock_.now();
  drop_impossible_times(arrived.result);
  {
    const auto core = core_.lock();
    core->figures.result_bytes += arrived.result.exr.size();
    if (!from->open) return next();  // the worker sends it again over its newer stream
    const Farm& farm = core->driver.farm();
    const UnitKey& unit = arrived.result.unit;
    const Wanted wanted = farm.wanted(unit);
    const Disposition what = disposition(wanted, *from);
    arrived.job = core->jobs.find(unit.job);
    if (!arrived.job || what == Disposition::drop ||
        (!wanted.numeric_class && !farm.may_pin(unit.job, from->worker)))
      return acknowledge(*core, *from, unit), next();
    if (what == Disposition::other_class)
      return acknowledge(*core, *from, unit,
                         Error{Errc::failed_precondition,
                               "the job is pinned to another numeric class than this worker's"}),
             next();
    arrived.expected = {arrived.job->stored.scene, arrived.job->settings_digest, from->numeric_class,
                        wanted.rect, wanted.samples};
  }
  // The bytes of the message and of the floats decoded from it. If there is no room for them, only this
  // worker's stream is held back; no thread blocks.
  arrived.bytes = 2 * arrived.result.exr.size();
  const std::size_t bytes = arrived.bytes;
  from->held_back = true;
  budget_.ask(bytes, [this, waiting = std::make_shared<Arrived>(std::move(arrived)), next = std::move(next)] {
    waiting->from->held_back = false;
    arrived_.push(std::move(*waiting));
    next();
  });
}

void ResultPipeline::verify_loop(const std::stop_token& token) {
  while (!token.stop_requested())
    for (Arrived& a : arrived_.pop(1, token)) {
      const TimePoint begin = clock_.now();
      Verified verified =
          verify_result(a.result, a.expected, a.job->grid.frame, aovs_of(a.job->stored.settings));
      failpoint("result-checked");
      checked_.push({std::move(a), std::move(verified), seconds(clock_.now() - begin)});
    }
}

void ResultPipeline::commit_loop(const std::stop_token& token) {
  while (!token.stop_requested()) {
    if (!writes_.wait_for_room(kMaxBackgroundWrites, token)) return;
    auto batch = checked_.pop(limits::kMaxCommitBatch, token);
    if (!batch.empty()) commit(std::move(batch));
  }
}

// Makes a batch of results durable, with one sync for each log file, and has the farm accept them. Under load
// a batch grows while the disk works on the one before, so a result waits for at most two syncs.
void ResultPipeline::commit(std::vector<Checked> batch) {
  std::vector<Stored> stored = prepare(batch);
  append(batch, stored);
  {
    const auto core = core_.lock();
    for (std::size_t i = 0; i < batch.size(); ++i) conclude(*core, batch[i], stored[i]);
  }
  // Requests that release() grants may continue on this thread, before it returns: so not under the lock.
  for (const Checked& item : batch) budget_.release(item.arrived.bytes);
}

std::vector<ResultPipeline::Stored> ResultPipeline::prepare(const std::vector<Checked>& batch) {
  std::vector<Stored> all;
  const auto core = core_.lock();
  const Farm& farm = core->driver.farm();
  for (const Checked& item : batch) {
    const Arrived& a = item.arrived;
    Stored& stored = all.emplace_back();
    stored.resumes = a.job->resumes;
    stored.at_seconds = a.job->elapsed(clock_.now());
    // If the unit has an accepted result meanwhile, this further one need not be stored; the farm compares
    // its digest.
    const bool accept = disposition(farm.wanted(a.result.unit), *a.from) == Disposition::accept;
    // Pinning to a fake worker's class marks the job as fake; this does so whatever class the worker names.
    if (a.from->fake && accept && !std::exchange(a.job->stored.fake, true)) a.job->pin_unsaved = true;
    if (const auto saved = core->records.put_pin(a.job); !saved) stored.error = saved.error();
    if (const auto saved = core->records.put_quarantined(); !saved) stored.error = saved.error();
    if (accept && !farm.quarantined(a.from->worker) && !stored.error &&
        std::holds_alternative<Partial>(item.verified))
      stored.log = a.job->log;
  }
  return all;
}

void ResultPipeline::append(const std::vector<Checked>& batch, std::vector<Stored>& stored) {
  std::set<std::shared_ptr<PartialLog>> written;
  for (std::size_t i = 0; i < batch.size(); ++i) {
    if (!stored[i].log) continue;
    const Arrived& a = batch[i].arrived;
    const UnitResult& r = a.result;
    auto place = stored[i].log->append({r.unit.tile, r.unit.round, a.expected.samples, r.digest,
                                        a.from->worker, r.cpu_seconds, stored[i].at_seconds, r.health},
                                       r.exr);
    if (place)
      stored[i].place = *place, written.insert(stored[i].log);
    else
      stored[i].error = place.error();
    failpoint("result-appended");
  }
  for (const auto& log : written)
    if (const auto synced = log->sync(); !synced)
      for (Stored& one : stored)
        if (one.log == log && one.place) one.error = synced.error();
  if (!written.empty()) failpoint("result-durable");
}

void ResultPipeline::conclude(Core& core, Checked& item, const Stored& stored) {
  const Arrived& a = item.arrived;
  if (core.driver.farm().quarantined(a.from->worker))
    acknowledge(core, *a.from, a.result.unit,
                Error{Errc::failed_precondition, "this worker is quarantined: it rendered wrong pixels"});
  else if (stored.error)
    cannot_store(core, a, *stored.error, stored.resumes);
  else if (const auto* bad = std::get_if<BadResult>(&item.verified))
    refuse(core, a, bad->error);
  else if (std::holds_alternative<OtherRange>(item.verified))
    acknowledge(core, *a.from, a.result.unit);
  else
    accept(core, item, stored.place);
}

void ResultPipeline::accept(Core& core, Checked& item, std::optional<PartialLog::Place> place) {
  const Arrived& a = item.arrived;
  const UnitResult& r = a.result;
  JobEntry& entry = *a.job;
  core.records.set_trouble("");
  const Wanted wanted = core.driver.farm().wanted(r.unit);
  const Disposition what = disposition(wanted, *a.from);
  const bool accepted = what == Disposition::accept;
  const bool lost = entry.log && !place;  // a race has left it unstored
  if (accepted && wanted.samples == a.expected.samples && !lost) {
    ++core.figures.accepted;
    entry.stored.totals.core_seconds += r.cpu_seconds;
    entry.stored.totals.time.add(
        {r.times.load, r.times.build, 0, r.times.transfer, item.seconds, r.times.idle});
    if (entry.assembly) {
      entry.assembly->costs().add(r.unit.tile, r.unit.round, r.cpu_seconds);
      entry.assembly->hold(
          r.unit.tile, r.unit.round,
          {std::move(std::get<Partial>(item.verified)), place, a.expected.samples, r.digest, r.health, a.at});
    }
  }
  // The farm compares duplicates it knows about. Of a copy that is not stored just the lease is returned: the
  // stored copy stands, and a further copy would be equal or evidence. So of a result of another class: the
  // farm knows the worker's class of now, which may be the job's if the worker has joined again meanwhile.
  if ((accepted && lost) || what == Disposition::other_class)
    core.driver.run(LeaseCameBack{a.from->worker, {r.lease, {r.unit}}});
  else
    core.driver.run(
        UnitAccepted{r.unit, a.expected.samples, r.digest, a.from->worker, r.cpu_seconds, r.times.wait});
  acknowledge(core, *a.from, r.unit);
}

// Handles a result that failed verification. This is presumably the worker's fault: it counts as a failure of
// the unit and the worker.
void ResultPipeline::refuse(Core& core, const Arrived& a, const Error& error) {
  const UnitKey& unit = a.result.unit;
  ++core.figures.refused;
  log_warn(fmt::format("job={} tile={} round={} worker={}", unit.job.value, unit.tile, unit.round,
                       a.from->worker.value),
           error.message);
  core.records.log(unit.job, fmt::format("{} (worker {})", error.message, a.from->worker.value));
  UnitFailure failure;
  failure.unit = unit;
  failure.lease = a.result.lease;
  failure.reason = error.message;
  core.driver.run(UnitFailed{a.from->worker, std::move(failure)});
  acknowledge(core, *a.from, unit, error);
}

// Handles a result that could not be stored. This is the coordinator's fault: the unit waits again, and the
// job is paused until a person resumes it. Otherwise workers would render for a full disk. If a person has
// resumed it since storing began, the error may be of what that person mended: the job is not paused again,
// and the next result shows whether it is.
void ResultPipeline::cannot_store(Core& core, const Arrived& a, const Error& error, std::uint64_t resumes) {
  const UnitKey& unit = a.result.unit;
  ++core.figures.not_stored;
  log_error(fmt::format("job={} tile={} round={}", unit.job.value, unit.tile, unit.round), error.message);
  core.records.set_trouble(error.message);
  if (a.job->resumes == resumes) {
    core.records.log(unit.job, "paused: " + error.message);
    a.job->trouble = error.message + "; then resume the job";
    core.driver.run(JobPaused{unit.job});
  }
  core.driver.run(LeaseCameBack{a.from->worker, {a.result.lease, {unit}}});
  acknowledge(core, *a.from, unit, error);
}

void ResultPipeline::put_figures(FarmFigures& figures) const {
  figures.arrived_now = arrived_.size() + checked_.size();
  figures.arrived_bytes = budget_.used();
}

}  // namespace ls::coordinator
