// ResultPipeline: handles results that workers send. A result contains the pixel sums of one unit. The farm
// decides whether a result is needed. Terms: docs/reference/glossary.md.
#include "coordinator/service/result_pipeline.h"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "coordinator/domain/limits.h"
#include "coordinator/service/core.h"
#include "core/base/failpoint.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

// While more background writes than this wait for the disk, new results wait too and are not made durable.
constexpr std::size_t kMaxBackgroundWrites = 4096;

using Verdict = Wanted::Verdict;

// Sets implausible times that a worker reported to 0: sums of these times are stored in the job's record, and
// a huge value would make the record unreadable. A result whose cpu_seconds are negative or NaN is rejected
// later (verify_result).
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
    // If the stream is closed already, the worker sends the result again over its next stream
    if (!from->open) return next();
    const Farm& farm = core->driver.farm();
    const UnitKey& unit = arrived.result.unit;
    const Wanted wanted = farm.wanted(unit, from->numeric_class);
    arrived.job = core->jobs.find(unit.job);
    if (!arrived.job || wanted.verdict == Verdict::no ||
        (!wanted.pinned && !farm.may_pin(unit.job, from->worker)))
      return acknowledge(*core, *from, unit), next();
    if (wanted.verdict == Verdict::other_class)
      return acknowledge(*core, *from, unit,
                         Error{Errc::failed_precondition,
                               "the job is pinned to another numeric class than this worker's"}),
             next();
    double& cpu = arrived.result.cpu_seconds;
    if (cpu > 0) cpu = farm.believable_seconds(unit, from->worker, cpu, arrived.at);
    arrived.expected = {arrived.job->stored.scene, arrived.job->settings_digest, from->numeric_class,
                        wanted.rect, wanted.samples};
  }
  // The result needs memory for the message and for the floats decoded from it. If there is no room, only
  // this worker's stream waits; no thread blocks.
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
      checked_.push({std::move(a), std::move(verified), begin, seconds(clock_.now() - begin)});
    }
}

void ResultPipeline::commit_loop(const std::stop_token& token) {
  while (!token.stop_requested()) {
    if (!writes_.wait_for_room(kMaxBackgroundWrites, token)) return;
    auto batch = checked_.pop(limits::kMaxCommitBatch, token);
    if (!batch.empty()) commit(std::move(batch));
  }
}

// Makes a batch of results durable, with one sync for each log file, and passes the results to the farm.
// While the disk syncs one batch, the next batch collects results, so a result waits for the syncs of at most
// two batches.
void ResultPipeline::commit(std::vector<Checked> batch) {
  std::vector<Stored> stored = prepare(batch);
  append(batch, stored);
  {
    const auto core = core_.lock();
    for (std::size_t i = 0; i < batch.size(); ++i) conclude(*core, batch[i], stored[i]);
  }
  // release() may call the functions of results that wait for memory, on this thread. These functions take
  // the lock, so release() is called without it.
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
    // The farm's verdict is read again, since the farm's state may have changed while the result was
    // verified.
    const Wanted wanted = farm.wanted(a.result.unit, a.from->numeric_class);
    const bool accept = wanted.verdict == Verdict::yes;
    const bool sound = !farm.quarantined(a.from->worker) && std::holds_alternative<Partial>(item.verified);
    // The first result decides the job's numeric class. The class is stored in the job's record before any
    // result is stored in the job's log. So the record always states the class of the results in the log.
    if (accept && sound && !wanted.pinned)
      core->driver.run(ClassChosen{a.result.unit.job, a.from->numeric_class});
    // A job that accepts a result of a fake worker (which invents pixels, for tests) is marked as fake. The
    // numeric class cannot show this, since a fake worker may claim any class.
    if (a.from->fake && accept && !std::exchange(a.job->stored.fake, true)) a.job->pin_unsaved = true;
    if (const auto saved = core->records.put_pin(a.job); !saved) stored.error = saved.error();
    if (const auto saved = core->records.put_quarantined(); !saved) stored.error = saved.error();
    if (accept && sound && !stored.error) stored.log = a.job->log;
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
  const bool quarantined = core.driver.farm().quarantined(a.from->worker);
  if (a.job->trace)
    a.job->trace->result(a.result, a.from->worker, item.began, item.seconds, clock_.now(),
                         quarantined || stored.error || !std::holds_alternative<Partial>(item.verified));
  if (quarantined)
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
  const Wanted wanted = core.driver.farm().wanted(r.unit, a.from->numeric_class);
  const bool accepted = wanted.verdict == Verdict::yes;
  // True if the result was not stored, because the farm did not need it when storing began.
  const bool lost = entry.log && !place;
  if (accepted && wanted.samples == a.expected.samples && !lost) {
    ++core.figures.accepted;
    entry.stored.totals.core_seconds += r.cpu_seconds;
    entry.stored.techniques.add(r.techniques);
    entry.stored.totals.time.add(
        {r.times.load, r.times.build, 0, r.times.transfer, item.seconds, r.times.idle});
    if (entry.assembly) {
      entry.assembly->costs().add(r.unit.tile, r.unit.round, r.cpu_seconds);
      entry.assembly->hold(
          r.unit.tile, r.unit.round,
          {std::move(std::get<Partial>(item.verified)), place, a.expected.samples, r.digest, r.health, a.at});
    }
  }
  // Reports the result to the farm, which compares it with other results of the unit. Two kinds of results
  // must not count as accepted; for these the farm only learns that the worker no longer works on the unit.
  // The first is a result that the farm needs now but that is not in the log (`lost`). The second is a result
  // of another numeric class than the job's: the farm knows only the worker's present class, and the worker
  // may have joined again with the job's class meanwhile; then the farm would take the result for one of the
  // job's class.
  if ((accepted && lost) || wanted.verdict == Verdict::other_class)
    core.driver.run(LeaseCameBack{a.from->worker, {r.lease, {r.unit}}, true});
  else
    core.driver.run(
        UnitAccepted{r.unit, a.expected.samples, r.digest, a.from->worker, r.cpu_seconds, r.times.wait});
  acknowledge(core, *a.from, r.unit);
}

// Handles a result that failed verification. The worker is presumably at fault, so this counts as a failure
// of the unit and the worker.
void ResultPipeline::refuse(Core& core, const Arrived& a, const Error& error) {
  const UnitKey& unit = a.result.unit;
  ++core.figures.refused;
  log_warn(fmt::format("job={} tile={} round={} worker={}", unit.job.value, unit.tile, unit.round,
                       a.from->worker.value),
           error.message);
  if (core.driver.farm().failure_is_new(a.from->worker, unit)) {
    core.records.log(unit.job, fmt::format("{} (worker {})", error.message, a.from->worker.value));
    if (const auto w = core.workers.find(a.from->worker); w != core.workers.end())
      w->second.note(fmt::format("a result of job {} is refused: {}", unit.job.value, error.message));
  }
  UnitFailure failure;
  failure.unit = unit;
  failure.lease = a.result.lease;
  failure.reason = error.message;
  core.driver.run(UnitFailed{a.from->worker, std::move(failure)});
  acknowledge(core, *a.from, unit, error);
}

// Handles a result that could not be stored. The coordinator is at fault: the unit waits again, and the job
// is paused until a user resumes it, so that workers do not render for a full disk. If a user has resumed the
// job since storing began, the cause may have been removed already: the job is not paused again, and the next
// result shows whether the error persists.
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
  core.driver.run(LeaseCameBack{a.from->worker, {a.result.lease, {unit}}, true});
  acknowledge(core, *a.from, unit, error);
}

void ResultPipeline::put_figures(FarmFigures& figures) const {
  figures.arrived_now = arrived_.size() + checked_.size();
  figures.arrived_bytes = budget_.used();
}

}  // namespace ls::coordinator
