// The inside of the farm. Handlers are grouped by subject: farm_jobs, farm_workers, farm_units, farm_leases,
// schedule, farm_stop, farm_trust.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "coordinator/domain/farm.h"
#include "coordinator/domain/lease_book.h"
#include "coordinator/domain/share_book.h"

namespace ls::coordinator {

// The smaller of two limits, where 0 is none.
std::uint32_t tighter(std::uint32_t a, std::uint32_t b);

struct Farm::State {
  explicit State(Options given) : options(std::move(given)), leases(options.lease_prefix) {}

  const Options options;
  LeaseBook leases;
  WorkerBook workers;
  std::map<JobSeq, std::unique_ptr<Job>> jobs;
  std::unordered_map<JobId, Job*> by_id;
  JobSeq last_job = 0;
  ShareBook shares;                    // the jobs with something to lease, and whose turn it is
  std::map<std::string, Load> users;   // by owner; the administrator is none
  std::map<std::string, Load> groups;  // of jobs that have one
  std::map<WorkerId, std::string> barred;
  AuditFigures audited;
  std::set<JobId> audits_changed;

  // Of the event in hand.
  TimePoint now{};
  TimePoint ticked{};  // of the last Tick: blocks are forgiven at ticks, when all workers are looked at
  std::vector<Effect> effects;
  bool work_appeared = false;     // units have come (back) that any worker may want
  std::set<WorkerIndex> touched;  // workers that may want more

  // ---- farm_jobs.cpp, farm_changes.cpp ----
  void on(const JobSubmitted& event);
  void on(const JobRestored& event);
  void on(const JobCancelled& event);
  void on(const JobPaused& event);
  void on(const JobResumed& event);
  void on(const JobStopped& event);
  void on(const JobPriority& event);
  void on(const JobRetargeted& event);
  void on(const JobExtended& event);
  void on(const JobForgotten& event);
  static Result<void> may_retarget(const Job& job, double target_error);
  static Result<void> may_extend(const Job& job, std::uint64_t spp);
  void reopen(Job& job, RoundIndex last);  // the cut last round, to be rendered in full
  void take_up_again(Job& job);            // with another end
  Job* find(const JobId& id) const;
  Job& add(JobPlan plan);
  void set_state(Job& job, JobState to);
  void refresh(Job& job);  // is it offered as it should be? After any change of its queue, state or window
  void restore_tile(Job& job, TileIndex tile, const JobRestored& event);
  void freeze(Job& job, StopReason reason);
  void finish_if_complete(Job& job);
  void fail(Job& job, std::string error, std::optional<UnitFailure> failure);
  void end(Job& job);  // takes back what is leased of a job that has ended

  // ---- farm_workers.cpp ----
  void on(const WorkerJoined& event);
  void on(const WorkerBarred& event);
  void on(const WorkerLost& event);
  void on(const WorkerDrains& event);
  void on(const LeaseProgress& event);
  void on(const ResultsWait& event);
  void on(const LeaseCameBack& event);
  void on(const Tick& event);
  void lose(Worker& worker, FreedCause why);
  void touch(Worker& worker);
  void grown(Worker& worker);  // it has finished something
  void expire_leases();
  void forgive_and_forget();
  void forget_names();  // of workers that are gone and have no part in any job

  // ---- farm_units.cpp ----
  void on(const UnitAccepted& event);
  void on(const UnitFolded& event);
  void on(const UnitFailed& event);
  void charge(Job& job, double cpu_seconds);  // to its owner's share
  void issue_folds(Job& job, TileIndex tile);
  void checkpoint(Job& job, RoundIndex round);

  // ---- farm_trust.cpp: audits, and workers that render wrong pixels ----
  void compare(Job& job, UnitCode code, const UnitAccepted& event);  // with the accepted result
  void restore_audits(Job& job, const JobRestored& event);
  void consider_audit(Job& job, UnitCode code, WorkerIndex first);
  // The audit that this worker may do.
  std::optional<UnitCode> audit_for(const Job& job, const Worker& worker) const;
  bool audit_from(Job& job, Worker& worker);
  bool was_asked(const Job& job, UnitCode code, WorkerIndex worker) const;  // its word on this unit counts
  void agreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked);
  void disagreed(Job& job, UnitCode code, const UnitAccepted& with, bool asked);
  void claimed(Job& job, UnitCode code, const UnitAccepted& by);
  void undecided(Job& job, UnitCode code);
  enum class Deciders { none, away, there };
  Deciders deciders(const Job& job, const Audit& audit) const;
  void settle_audits(Job& job);  // those that nobody can do
  void audit_failed(Job& job, UnitCode code, Worker& worker, LeaseRecord& lease);
  void close_audits(Job& job, const std::function<bool(UnitCode, const Audit&)>& which);
  void distrust(const UnitKey& unit, WorkerIndex liar, std::string evidence);
  void bar(const WorkerId& id, const std::string& why);  // of one that stands in `barred` already
  void void_results(Job& job, WorkerIndex liar);
  void void_tile(Job& job, TileIndex tile);
  static void steer_anew(Job& job);

  // ---- farm_stop.cpp ----
  // What the fold of this round tells the stop rule, and what comes of it.
  void steer(Job& job, TileIndex tile, RoundIndex round);
  void judge(Job& job);  // at the levels that all tiles have come to
  void mark_level(Job& job, bool last);
  void take_marks(Job& job);  // those that are folded
  void stop_at_level(Job& job);
  // Shortly before its time is up: the rounds that each tile ends with, from what units have cost so far.
  void plan_end(Job& job, TimePoint limit);
  void give_back_beyond(Job& job);  // units leased beyond the tiles' ends
  LeaseRecord* lease_of(const Job& job, UnitCode code, const Worker& worker);  // under which it holds it
  void count_failure(Job& job, UnitCode code, Worker& worker, const UnitFailure& failure);

  // ---- farm_leases.cpp ----
  void grant(Job& job, Worker& worker, std::vector<UnitCode> units, bool audit = false);
  void load(Job& job, const Worker& worker, std::uint32_t units);
  void unload(Job& job, std::uint32_t units);
  void leave_load(Job& job, const Worker& worker);  // one lease less
  // Units of the job that the limits still allow the worker. Audits pass them: they are the farm's doing, not
  // the user's, and one that had to wait for the user's other work would keep a finished image from being
  // said to be so.
  std::uint32_t room(const Job& job, const Worker& worker) const;
  bool limited(const Job& job) const;
  static bool has(const LeaseRecord& lease, UnitCode code);  // is the unit still out under it?
  // The unit leaves the lease; nothing is queued. True if no other lease holds it.
  bool detach(LeaseRecord& lease, UnitCode code);
  // All leases give the unit up because its result is there (from `by`).
  void settle_unit(Job& job, UnitCode code, const Worker* by);
  // Units of the lease (those for which `which` is true) wait again; an empty lease ends.
  template <class Which>
  void free_units(LeaseRecord& lease, FreedCause why, bool tell_worker, Which&& which);
  void free_lease(LeaseSeq seq, FreedCause why, bool tell_worker);
  void close(LeaseRecord& lease, bool tell_worker);
  std::vector<LeaseSeq> leases_of(const Job& job) const;
  void renew(LeaseRecord& lease);

  // ---- schedule.cpp ----
  void dispatch();
  void serve(const std::vector<Worker*>& candidates, bool only_uncovered, bool only_holders);
  bool assign(Worker& worker, bool only_held);
  Job* choose(const Worker& worker);  // whose turn it is at this worker
  enum class Takes { nothing, later, now };
  Takes takes(Job& job, const Worker& worker);
  bool may_pin(const Job& job, const Worker& worker) const;
  bool lease_from(Job& job, Worker& worker);
  std::optional<UnitCode> next_for(Job& job, const Worker& worker);
  // What is only probably wanted waits until the worker, with so many units besides those it holds, has next
  // to nothing.
  bool too_early(const Job& job, const Worker& worker, UnitCode code, std::size_t units, double cost) const;
  bool others_may_take(const Job& job, UnitCode code, const Worker& but) const;
  // At a job's tail: what lies untouched behind other work is better begun by a worker that has none. True if
  // units wait again because of it.
  bool take_back_for_idle();
  bool untouched(const LeaseRecord& lease) const;  // its worker is busy with earlier ones
  double waits_behind_others(const LeaseRecord& lease) const;
  LeaseRecord* longest_waiting_for(const Worker& idle);
  void copy_overdue(Worker& worker);  // speculation at the tail
};

template <class Which>
void Farm::State::free_units(LeaseRecord& lease, FreedCause why, bool tell_worker, Which&& which) {
  Job& job = *lease.job;
  UnitsFreed freed{job.plan.brief.job, leases.id_of(lease.seq), lease.worker->id, {}, why};
  for (const UnitCode code : lease.units) {
    if (!has(lease, code) || !which(code)) continue;
    if (!lease.audit) freed.units.push_back(job.key(code));
    if (!lease.audit) job.witnesses.note(code, lease.worker->index);
    work_appeared |= lease.audit;
    if (!detach(lease, code)) continue;
    job.queue.put_back(code);
    work_appeared = true;
  }
  if (!freed.units.empty()) effects.emplace_back(std::move(freed));
  if (lease.remaining == 0) close(lease, tell_worker);
  refresh(job);
}

}  // namespace ls::coordinator
