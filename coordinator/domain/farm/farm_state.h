// The state of the farm, and its reaction to each event. The functions are grouped by subject into the files
// farm_jobs, farm_workers, farm_units, farm_leases, schedule, farm_stop and farm_trust (.cpp). A job that is
// pinned to a numeric class is rendered only by workers of this class. Terms: docs/reference/glossary.md.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "coordinator/domain/fair_share.h"
#include "coordinator/domain/farm/farm.h"
#include "coordinator/domain/worker_table.h"

namespace ls::coordinator {

// True if a unit that left a lease for this reason tells against the worker: it was lost, or did not render
// it.
constexpr bool is_fruitless(FreedCause why) {
  return why == FreedCause::worker_lost || why == FreedCause::newer_stream ||
         why == FreedCause::deadline_passed || why == FreedCause::returned;
}

// True if the worker may go on rendering units that were taken from it for this reason.
constexpr bool may_go_on(FreedCause why) {
  return why == FreedCause::worker_lost || why == FreedCause::newer_stream ||
         why == FreedCause::deadline_passed;
}

// Returns the smaller of two limits; a limit of 0 means no limit.
std::uint32_t tighter(std::uint32_t a, std::uint32_t b);

struct Farm::State {
  explicit State(Options given) : options(std::move(given)), leases(options.lease_prefix) {}

  const Options options;
  LeaseTable leases;
  WorkerTable workers;
  std::map<JobSeq, std::unique_ptr<Job>> jobs;
  std::unordered_map<JobId, Job*> by_id;
  JobSeq last_job = 0;
  FairShare shares;                    // the order in which jobs get workers
  std::map<std::string, Load> users;   // leased units by owner of the jobs, except the administrator
  std::map<std::string, Load> groups;  // leased units by sequence (JobPlan::group)
  std::map<WorkerId, std::string> quarantined;
  std::set<Digest> proven;  // numeric classes of which a result was accepted since the start
  AuditFigures audited;
  std::set<JobId> audits_changed;

  // Time of the event that is being handled
  TimePoint now{};
  // Time of the latest Tick. A worker that failed too often is blocked from a job for some time. Only a tick
  // ends blocks, because it then considers all workers for work; so blocks are checked at this time, not at
  // `now`
  TimePoint ticked{};
  std::vector<Effect> effects;
  // True if there may be new units that some worker can take: dispatch() then considers all workers that want
  // work, not only those in `dirty`
  bool work_appeared = false;
  // True if a job was just pinned to a numeric class that has workers with may_begin == false. These can take
  // units of the job from now on, so dispatch() considers all workers again
  bool pinned_for_others = false;
  std::set<WorkerIndex> dirty;  // workers that may want more work, since their state has changed
  // Workers that were lost before they finished a unit (kLostNewcomersKept), longest ago first. Some may have
  // come back since.
  std::deque<WorkerId> lost_newcomers;

  // Defined in farm_jobs.cpp
  void on(const JobSubmitted& event);
  void on(const JobRestored& event);
  void on(const JobCancelled& event);
  void on(const JobPaused& event);
  void on(const JobResumed& event);
  void on(const JobStopped& event);
  void on(const JobPriority& event);
  void on(const JobHeld& event);
  void on(const JobFocused& event);
  void on(const JobRetargeted& event);
  void on(const JobExtended& event);
  void on(const JobForgotten& event);
  static Result<JobPlan> retargeted(const Job& job, double target_error);
  static Result<JobPlan> extended(const Job& job, std::uint64_t spp, TimePoint now);
  void reopen(Job& job, RoundIndex last);  // queues round `last`, which was truncated, to be rendered in full
  void take_up_again(Job& job);            // lets a job go on after its samples or its target were changed
  Job* find(const JobId& id) const;
  bool in_good_hands(const Job& job) const;  // defined in farm_query.cpp
  Job& add(JobPlan plan);
  void set_state(Job& job, JobState to);
  // Updates in FairShare whether the job has units to lease. Call it after any change of the job's queue,
  // state or window (how far ahead rounds may be leased)
  void refresh(Job& job);
  void restore_tile(Job& job, TileIndex tile, const JobRestored& event);
  // Ends the job with the units that are begun and the first round of each tile
  void freeze(Job& job, StopReason reason);
  void watch_time(Job& job);  // freezes the job if its time limit has passed
  void finish_if_complete(Job& job);
  void fail(Job& job, std::string error, std::optional<JobFailure> failure = {});
  void end(Job& job);  // takes back all leases of a job that has failed or was cancelled

  // Defined in farm_workers.cpp
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
  // Notes that the worker makes progress, so it is not stuck: it has done something of its lease `from`. That
  // counts for its later leases, too, as it renders them in order, but not for earlier ones. 0: for all
  void note_progress(Worker& worker, LeaseSeq from = 0);
  // Notes that a lease of the job ended without results because of this worker
  void note_fruitless(Worker& worker, const Job& job, const std::string& why);
  void expire_leases();
  void forgive_and_forget();
  void forget(Worker& worker);
  void forget_names();  // forgets names of workers that are gone and that no job refers to

  // Defined in farm_units.cpp
  void on(const ClassChosen& event);
  void on(const UnitAccepted& event);
  void on(const UnitFolded& event);
  void on(const DenoisedChecked& event);
  void on(const UnitFailed& event);
  void accept(const UnitAccepted& event);
  // See Farm::believable_seconds. `since`: held_since(), or nullopt if the worker is unknown, too
  static double believable(const Job& job, UnitCode code, const Worker* worker,
                           std::optional<TimePoint> since, double reported, TimePoint at);
  // Returns since when the worker may have been rendering this unit: since its first lease, if it may have
  // kept on rendering when that one was taken from it, else since its present one. nullopt: never.
  std::optional<TimePoint> held_since(const Job& job, UnitCode code, const Worker& worker) const;
  // Notes that the worker has rendered a unit of the job, so that its leases are not fruitless (is_fruitless)
  void note_fruitful(Worker* worker, Job& job);
  void issue_folds(Job& job, TileIndex tile);
  void issue_folds(Job& job) {
    for (TileIndex t = 0; t < job.units.tiles(); ++t) issue_folds(job, t);
  }
  void checkpoint(Job& job, RoundIndex round);

  // Defined in farm_trust.cpp: audits and faulty workers. In an audit another worker renders a unit that has
  // an accepted result again, for comparison.

  // Compares a further result of a unit with the accepted result
  void compare(Job& job, UnitCode code, const UnitAccepted& event);
  void restore_audits(Job& job, const JobRestored& event);
  void consider_audit(Job& job, UnitCode code, WorkerIndex first);
  // Returns a unit of the job that waits for an audit and that this worker may render; nullopt: there is
  // none.
  std::optional<UnitCode> audit_for(const Job& job, const Worker& worker) const;
  bool audit_from(Job& job, Worker& worker);
  // True if this worker holds or held a lease on this unit. Only the result of such a worker counts as a
  // vote.
  bool was_asked(const Job& job, UnitCode code, WorkerIndex worker) const;
  void agreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked);
  void disagreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked);
  void claimed(Job& job, UnitCode code, const UnitAccepted& by);
  void undecided(Job& job, UnitCode code);
  // True if the worker may be asked to render the unit for the audit. Workers of other principals than those
  // of the results so far go first; others are asked only if no such worker can render the unit.
  bool may_vote(const Job& job, const Audit& audit, const Worker& worker) const;
  bool is_outsider(const Audit& audit, const Worker& worker) const;
  bool may_decide(const Job& job, const Audit& audit, const Worker& worker) const;
  // True if these two workers, whose results are equal, may outvote the third. They may if they are of two
  // principals, or if all three are of one: nobody can bar the worker of somebody else alone.
  bool outvote(WorkerIndex one, WorkerIndex other, WorkerIndex alone) const;
  void ignore_vote(Job& job, UnitCode code, WorkerIndex by);
  // Which workers can render the unit for the audit. `none`: no connected worker; `away`: only workers that
  // get no work at the moment or whose leases were fruitless; `there`: at least one that can render it now.
  enum class Deciders { none, away, there };
  Deciders deciders(const Job& job, const Audit& audit) const;
  void settle_audits(Job& job);  // decides or drops the open audits that no worker can render
  void audit_failed(Job& job, UnitCode code, Worker& worker, LeaseRecord& lease);
  void close_audits(Job& job, const std::function<bool(UnitCode, const Audit&)>& which);
  void found_faulty(const UnitKey& unit, WorkerIndex faulty, std::string evidence);
  // Takes the worker's leases back and voids its results. The caller must have added the worker to
  // `quarantined`
  void bar(const WorkerId& id, const std::string& why);
  void void_results(Job& job, WorkerIndex faulty);
  void void_tile(Job& job, TileIndex tile);
  static void steer_anew(Job& job);

  // Defined in farm_stop.cpp. The stop rule (adaptive_stop.h) of a target error stops tiles in groups. A
  // level is its threshold for stopping, which falls step by step.

  // Passes the tile's error after this round, which was just added to the image, to the stop rule. Then
  // applies the rule's decision on how many rounds the tiles get.
  void steer(Job& job, TileIndex tile, RoundIndex round);
  // Once all groups have stopped at the present level, judges whether the image meets the target. If it does,
  // ends the job. Otherwise goes to the next level, and repeats this as long as all groups have stopped.
  void judge(Job& job);
  // Judges the image at the present level, at which all groups must have stopped
  AdaptiveStop::Verdict verdict_on(Job& job);
  AdaptiveStop::Verdict denoised_verdict(Job& job);
  void mark_level(Job& job, bool last);
  void take_marks(Job& job);  // emits a Checkpoint for each LevelMark whose rounds are all in the image
  void stop_at_level(Job& job);
  // Decides, from measured costs of units, the last round of each tile that is rendered before the job's time
  // limit. Called shortly before the limit, and when all units that were chosen so are done before it.
  void plan_end(Job& job, TimePoint limit);
  void give_back_beyond(Job& job);  // takes back leased units of rounds after the tiles' last ones
  // Returns the lease under which the worker holds the unit; null: none. Defined in farm_units.cpp, as is
  // count_failure()
  const LeaseRecord* lease_of(const Job& job, UnitCode code, const Worker& worker) const;
  LeaseRecord* lease_of(const Job& job, UnitCode code, const Worker& worker) {
    return const_cast<LeaseRecord*>(std::as_const(*this).lease_of(job, code, worker));
  }
  void count_failure(Job& job, UnitCode code, Worker& worker, const UnitFailure& failure);

  // Defined in farm_leases.cpp
  void grant(Job& job, Worker& worker, std::vector<UnitCode> units, bool audit = false);
  void load(Job& job, const Worker& worker, std::uint32_t units);
  void unload(Job& job, std::uint32_t units);
  // Notes that the worker holds one lease fewer of this job. The counts of the job's owner and group fall,
  // too
  void leave_load(Job& job, const Worker& worker);
  // Returns how many more of the job's units may be leased to the worker under the limits on workers and
  // units. The limits do not apply to audits: the farm orders them, not the user, and an audit that waited
  // for the user's other work would delay the end of a job that is otherwise finished.
  std::uint32_t room(const Job& job, const Worker& worker) const;
  bool limited(const Job& job) const;
  static bool has(const LeaseRecord& lease, UnitCode code);  // true if the unit is still part of the lease
  // Removes the unit from the lease without queueing it. Returns true if no other lease holds the unit;
  // always false for the lease of an audit.
  bool detach(LeaseRecord& lease, UnitCode code);
  // Removes the unit from all leases because a result of it has arrived. `by` is the worker that delivered
  // the result; null: unknown.
  void settle_unit(Job& job, UnitCode code, const Worker* by);
  // Removes from the lease those of its units for which `which` is true, and queues them again. A lease
  // without units ends; if `send_worker` is true, its worker then gets a CancelLease.
  template <class Which>
  void free_units(LeaseRecord& lease, FreedCause why, bool send_worker, Which&& which);
  void free_lease(LeaseSeq seq, FreedCause why, bool send_worker);
  void close(LeaseRecord& lease, bool send_worker);
  // The leases of the job, oldest first: a copy, since they may end while the caller goes through them
  static std::vector<LeaseSeq> leases_of(const Job& job) { return {job.leases.begin(), job.leases.end()}; }
  std::uint32_t units_before(const LeaseRecord& lease) const;  // units of earlier leases of the same worker
  void renew(LeaseRecord& lease);
  // Asks the worker to give back the units of the lease that it has not begun (RecallLease), once.
  void recall(LeaseRecord& lease);
  void recall_all(const Job& job);
  void note_begun(Worker& worker);  // sets LeaseRecord::begun of leases that the worker may begin now
  // Recalls the leases that the worker has been rendering for longer than kLeaseLimit
  void end_long_leases(Worker& worker);
  // Returns how many of the units that the lease still holds, from the first on, its worker may have begun if
  // they are freed for this reason.
  std::uint32_t may_be_begun(const LeaseRecord& lease, FreedCause why) const;
  // If the job is frozen, cuts off units that came back before anybody had begun them.
  void cut_off_returned(Job& job);

  // Defined in schedule.cpp
  void dispatch();
  // Leases units to these workers in turn; true if any was leased.
  bool serve(const std::vector<Worker*>& candidates, bool only_uncovered, bool only_holders);
  bool assign(Worker& worker, bool only_held);
  Job* choose(const Worker& worker);  // the job whose units this worker gets next; null: none
  // True if units of the job that the worker was asked for will come back in a moment
  bool awaits_return(const Job& job, const Worker& worker) const;
  enum class Takes { nothing, later, now };
  Takes takes(Job& job, const Worker& worker);
  bool may_pin(const Job& job, const Worker& worker) const;
  void pin(Job& job, const Digest& numeric_class);         // does nothing if the job is pinned already
  void keep_class(Job& job, const Digest& numeric_class);  // pins the job for good
  // Releases the pin of a job of whose class no result was accepted: its leases are gone
  void unpin(Job& job);
  // Notes that a lease of the job ended without a result because of this worker
  static void pass_over(Job& job, const Worker& worker);
  // Takes the leases of the job back, and so releases its pin, if they bring no result for too long although
  // an idle worker of another class could render the job
  void doubt_pin(Job& job);
  bool lease_from(Job& job, Worker& worker);
  std::optional<UnitCode> next_for(Job& job, const Worker& worker);
  // True if the unit is speculative (the job may end without it) and the worker has enough other work for
  // now. `units` (number) and `cost` (predicted CPU seconds) are those of the lease that is being composed.
  bool too_early(const Job& job, const Worker& worker, UnitCode code, std::size_t units, double cost) const;
  // True if a connected worker other than `but` may take units of the job and has not failed on this unit.
  // `proven`: only workers that have delivered results count.
  bool others_may_take(const Job& job, UnitCode code, const Worker& but, bool proven) const;
  // Near the end of a job: takes back a lease that waits behind other work of its worker, so that an idle
  // worker can render its units. Returns true if a lease was taken back.
  bool take_back_for_idle();
  bool untouched(const LeaseRecord& lease) const;  // true if earlier leases still keep its worker busy
  double waits_behind_others(const LeaseRecord& lease) const;
  LeaseRecord* longest_waiting_for(const Worker& idle);
  void copy_overdue(Worker& worker);  // leases copies of overdue units to this idle worker
};

template <class Which>
void Farm::State::free_units(LeaseRecord& lease, FreedCause why, bool send_worker, Which&& which) {
  Job& job = *lease.job;
  UnitsFreed freed{job.plan.brief.job, leases.id_of(lease.seq), lease.worker->id, {}, why, lease.audit};
  const std::uint32_t begun = may_be_begun(lease, why);
  lease.worker->interrupted |= may_go_on(why);
  if (!lease.audit && (is_fruitless(why) || why == FreedCause::failed)) pass_over(job, *lease.worker);
  std::uint32_t held = 0;
  for (const UnitCode code : lease.units) {
    if (!has(lease, code)) continue;
    const bool may_be_begun = held++ < begun;
    if (!which(code)) continue;
    freed.units.push_back(job.key(code));
    if (!lease.audit && may_go_on(why))
      job.voters.note(code, lease.worker->index, lease.issued);
    else if (!lease.audit)
      job.voters.note(code, lease.worker->index);
    if (lease.audit && is_fruitless(why)) job.audits.at(code).fruitless.push_back(lease.worker->index);
    work_appeared |= lease.audit;
    if (!detach(lease, code)) continue;
    job.queue.put_back(code, may_be_begun);
    work_appeared = true;
  }
  if (!freed.units.empty()) effects.emplace_back(std::move(freed));
  if (lease.remaining == 0) close(lease, send_worker);
  refresh(job);
}

}  // namespace ls::coordinator
