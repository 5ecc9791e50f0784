// The state of the farm, and its reaction to each event. The functions are grouped by subject into the files
// farm_jobs, farm_workers, farm_units, farm_leases, schedule, farm_stop and farm_trust. A unit
// is one round (range of samples) of one tile; a lease is a list of units that is assigned to one worker.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "coordinator/domain/fair_share.h"
#include "coordinator/domain/farm/farm.h"
#include "coordinator/domain/worker_table.h"

namespace ls::coordinator {

// Returns the smaller of two limits, where 0 means no limit
std::uint32_t tighter(std::uint32_t a, std::uint32_t b);

struct Farm::State {
  explicit State(Options given) : options(std::move(given)), leases(options.lease_prefix) {}

  const Options options;
  LeaseTable leases;
  WorkerTable workers;
  std::map<JobSeq, std::unique_ptr<Job>> jobs;
  std::unordered_map<JobId, Job*> by_id;
  JobSeq last_job = 0;
  FairShare shares;                    // the jobs with units to lease, and their order
  std::map<std::string, Load> users;   // leased units of each owner, except the administrator
  std::map<std::string, Load> groups;  // leased units of each sequence (JobPlan::group)
  std::map<WorkerId, std::string> quarantined;
  AuditFigures audited;
  std::set<JobId> audits_changed;

  // State of the event being handled
  TimePoint now{};
  // Time of the latest Tick. Whether a worker is blocked from a job after failures is checked at this time,
  // not `now`, because only a tick, which checks all workers, ends such blocks
  TimePoint ticked{};
  std::vector<Effect> effects;
  // True if units may have appeared that some worker can take: dispatch() then considers all workers that
  // want work, not only those in `dirty`
  bool work_appeared = false;
  // True if a job was just pinned to a numeric class and some workers of this class may not begin jobs: they
  // can take its units from now on, so dispatch() considers all workers again
  bool pinned_for_others = false;
  std::set<WorkerIndex> dirty;  // workers whose state has changed, so that they may want more work

  // farm_jobs.cpp
  void on(const JobSubmitted& event);
  void on(const JobRestored& event);
  void on(const JobCancelled& event);
  void on(const JobPaused& event);
  void on(const JobResumed& event);
  void on(const JobStopped& event);
  void on(const JobPriority& event);
  void on(const JobFocused& event);
  void on(const JobRetargeted& event);
  void on(const JobExtended& event);
  void on(const JobForgotten& event);
  static Result<void> may_retarget(const Job& job, double target_error);
  static Result<void> may_extend(const Job& job, std::uint64_t spp);
  void reopen(Job& job, RoundIndex last);  // renders the truncated last round again in full
  void take_up_again(Job& job);            // resumes a job after its samples or its target were changed
  Job* find(const JobId& id) const;
  Job& add(JobPlan plan);
  void set_state(Job& job, JobState to);
  // Updates in FairShare whether the job has units to lease. Call it after any change of the job's queue,
  // state or window (how far ahead rounds may be leased)
  void refresh(Job& job);
  void restore_tile(Job& job, TileIndex tile, const JobRestored& event);
  void freeze(Job& job, StopReason reason);
  void finish_if_complete(Job& job);
  void fail(Job& job, std::string error);
  void end(Job& job);  // takes back all leases of a job that has ended

  // farm_workers.cpp
  void on(const WorkerJoined& event);
  void on(const WorkerQuarantined& event);
  void on(const WorkerLost& event);
  void on(const WorkerDrains& event);
  void on(const LeaseProgress& event);
  void on(const ResultsWait& event);
  void on(const LeaseCameBack& event);
  void on(const Tick& event);
  void lose(Worker& worker, FreedCause why);
  void touch(Worker& worker);
  void note_progress(Worker& worker);  // the worker has finished a unit
  void expire_leases();
  void forgive_and_forget();
  void forget_names();  // forgets names of workers that are gone and that no job refers to

  // farm_units.cpp
  void on(const ClassChosen& event);
  void on(const UnitAccepted& event);
  void on(const UnitFolded& event);
  void on(const DenoisedChecked& event);
  void on(const UnitFailed& event);
  void charge(Job& job, double cpu_seconds);  // adds these seconds to the share of the job's owner
  void issue_folds(Job& job, TileIndex tile);
  void issue_folds(Job& job) {
    for (TileIndex t = 0; t < job.units.tiles(); ++t) issue_folds(job, t);
  }
  void checkpoint(Job& job, RoundIndex round);

  // farm_trust.cpp: audits and faulty workers

  // Compares a further result of a unit with the accepted one
  void compare(Job& job, UnitCode code, const UnitAccepted& event);
  void restore_audits(Job& job, const JobRestored& event);
  void consider_audit(Job& job, UnitCode code, WorkerIndex first);
  // Returns a unit of the job that this worker may render again for an audit; nullopt if there is none.
  std::optional<UnitCode> audit_for(const Job& job, const Worker& worker) const;
  bool audit_from(Job& job, Worker& worker);
  // True if this worker held or holds a lease on this unit, so that its result counts as a vote.
  bool was_asked(const Job& job, UnitCode code, WorkerIndex worker) const;
  void agreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked);
  void disagreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked);
  void claimed(Job& job, UnitCode code, const UnitAccepted& by);
  void undecided(Job& job, UnitCode code);
  // Whether any worker can render the unit for the audit. `none`: no connected worker; `away`: only workers
  // that get no work at the moment; `there`: at least one that can render it now.
  enum class Deciders { none, away, there };
  Deciders deciders(const Job& job, const Audit& audit) const;
  void settle_audits(Job& job);  // decides or drops the open audits that no worker can render
  void audit_failed(Job& job, UnitCode code, Worker& worker, LeaseRecord& lease);
  void close_audits(Job& job, const std::function<bool(UnitCode, const Audit&)>& which);
  void found_faulty(const UnitKey& unit, WorkerIndex faulty, std::string evidence);
  // Takes the worker's leases back and voids its results; the caller has added it to `quarantined`
  void bar(const WorkerId& id, const std::string& why);
  void void_results(Job& job, WorkerIndex faulty);
  void void_tile(Job& job, TileIndex tile);
  static void steer_anew(Job& job);

  // farm_stop.cpp. Levels, and groups of tiles that stop together, are those of the stop rule
  // (adaptive_stop.h).

  // Passes the tile's error after this round, which was just added to the image, to the stop rule, and
  // applies the rule's decision on how many rounds the tiles get.
  void steer(Job& job, TileIndex tile, RoundIndex round);
  // Judges the image at the present level of the stop rule once all groups have reached it. While it misses
  // the target, goes to the next level and judges again; if it meets the target, ends the job.
  void judge(Job& job);
  // Judges the image once, at the present level; requires that all groups have reached it
  AdaptiveStop::Verdict verdict_on(Job& job);
  AdaptiveStop::Verdict denoised_verdict(Job& job);
  void mark_level(Job& job, bool last);
  void take_marks(Job& job);  // emits a Checkpoint for each mark (job.h) whose rounds are all in the image
  void stop_at_level(Job& job);
  // Decides the last round of each tile from measured unit costs; called shortly before the job's time limit.
  void plan_end(Job& job, TimePoint limit);
  void give_back_beyond(Job& job);  // takes back leased units beyond the tiles' last rounds
  // Returns the lease under which the worker holds the unit; null: it does not
  LeaseRecord* lease_of(const Job& job, UnitCode code, const Worker& worker);
  void count_failure(Job& job, UnitCode code, Worker& worker, const UnitFailure& failure);

  // farm_leases.cpp
  void grant(Job& job, Worker& worker, std::vector<UnitCode> units, bool audit = false);
  void load(Job& job, const Worker& worker, std::uint32_t units);
  void unload(Job& job, std::uint32_t units);
  // Counts one lease less that the worker holds of this job, its owner and its group
  void leave_load(Job& job, const Worker& worker);
  // Returns how many more of the job's units may be leased to the worker under the limits on workers and
  // units. Audits (second renderings, for comparison) are exempt: the farm orders them, not the user, and an
  // audit that waited for the user's other work would delay the end of a finished job.
  std::uint32_t room(const Job& job, const Worker& worker) const;
  bool limited(const Job& job) const;
  static bool has(const LeaseRecord& lease, UnitCode code);  // true if the unit is still leased under it
  // Removes the unit from the lease without queueing it. Returns true if no lease holds the unit any more;
  // always false for an audit.
  bool detach(LeaseRecord& lease, UnitCode code);
  // Removes the unit from all leases because its result arrived. `by` is the worker that delivered the
  // result; null: unknown.
  void settle_unit(Job& job, UnitCode code, const Worker* by);
  // Removes the units for which `which` is true from the lease and queues them again. A lease without units
  // ends; if `send_worker`, its worker then gets a CancelLease.
  template <class Which>
  void free_units(LeaseRecord& lease, FreedCause why, bool send_worker, Which&& which);
  void free_lease(LeaseSeq seq, FreedCause why, bool send_worker);
  void close(LeaseRecord& lease, bool send_worker);
  std::vector<LeaseSeq> leases_of(const Job& job) const;
  void renew(LeaseRecord& lease);

  // schedule.cpp
  void dispatch();
  void serve(const std::vector<Worker*>& candidates, bool only_uncovered, bool only_holders);
  bool assign(Worker& worker, bool only_held);
  Job* choose(const Worker& worker);  // the job whose units this worker gets next; null: none
  enum class Takes { nothing, later, now };
  Takes takes(Job& job, const Worker& worker);
  bool may_pin(const Job& job, const Worker& worker) const;
  void pin(Job& job, const Digest& numeric_class);  // does nothing if the job is pinned already
  bool lease_from(Job& job, Worker& worker);
  std::optional<UnitCode> next_for(Job& job, const Worker& worker);
  // True if the unit is speculative (the job may end without it) and the worker has enough other work for
  // now. `units` and `cost` (predicted CPU seconds) describe the lease being made so far.
  bool too_early(const Job& job, const Worker& worker, UnitCode code, std::size_t units, double cost) const;
  // True if a connected worker other than `but` may take units of the job and has not failed on this one.
  bool others_may_take(const Job& job, UnitCode code, const Worker& but) const;
  // Near the end of a job: takes back a lease that waits behind other work of its worker, so that an idle
  // worker can render its units. True if units were queued again.
  bool take_back_for_idle();
  bool untouched(const LeaseRecord& lease) const;  // true if its worker is still busy with earlier leases
  double waits_behind_others(const LeaseRecord& lease) const;
  LeaseRecord* longest_waiting_for(const Worker& idle);
  void copy_overdue(Worker& worker);  // near the end of a job: leases copies of overdue units to the worker
};

template <class Which>
void Farm::State::free_units(LeaseRecord& lease, FreedCause why, bool send_worker, Which&& which) {
  Job& job = *lease.job;
  UnitsFreed freed{job.plan.brief.job, leases.id_of(lease.seq), lease.worker->id, {}, why, lease.audit};
  for (const UnitCode code : lease.units) {
    if (!has(lease, code) || !which(code)) continue;
    freed.units.push_back(job.key(code));
    if (!lease.audit) job.voters.note(code, lease.worker->index);
    work_appeared |= lease.audit;
    if (!detach(lease, code)) continue;
    job.queue.put_back(code);
    work_appeared = true;
  }
  if (!freed.units.empty()) effects.emplace_back(std::move(freed));
  if (lease.remaining == 0) close(lease, send_worker);
  refresh(job);
}

}  // namespace ls::coordinator
