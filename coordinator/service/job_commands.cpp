// JobCommands: carries out users' commands on jobs and sequences (jobs with frames; each frame is a job too).
// To extend a job is to let it render more samples, which is possible even after its end; its image is then
// loaded from disk again.
#include "coordinator/service/job_commands.h"

#include <fmt/format.h>

#include <algorithm>

#include "coordinator/base/limits.h"
#include "coordinator/service/core.h"
#include "coordinator/service/state/prerequisites.h"
#include "coordinator/views/describe_change.h"
#include "core/base/log.h"
#include "core/base/safe_text.h"
#include "core/image/frame/frame.h"
#include "core/job/objects.h"

namespace ls::coordinator {
namespace {

// Checks the rules that hold for changes of jobs and of sequences alike.
Result<void> check(const JobChange& change) {
  if (auto ok = job::check_ranges(change, "change"); !ok) return ok;
  if (change.spp && change.target_error)
    return fail(Errc::invalid_argument,
                "samples (spp) and target_error cannot be changed at once: one decides "
                "how far the job goes; change one, then the other");
  if (change.name &&
      (plain_text(*change.name) != *change.name || change.name->find_first_not_of(' ') == std::string::npos))
    return fail(Errc::invalid_argument,
                "change: 'name' must have a character that is not blank, and no control characters");
  return {};
}

// Checks that the focus lies in the image of each of the jobs.
Result<void> check_focus(const JobChange& change, const std::vector<EntryPtr>& jobs) {
  if (!change.focus || !*change.focus) return {};
  for (const EntryPtr& job : jobs) {
    const FrameSize size = job->stored.settings.size;
    if (!lies_in(size, **change.focus))
      return fail(Errc::invalid_argument,
                  fmt::format("focus {} does not lie in the image of job {}, which has {} x {} pixels",
                              show(**change.focus), job->stored.id.value, size.width, size.height));
  }
  return {};
}

std::string_view done_to_become(JobState asked) {
  if (asked == JobState::paused) return "paused";
  return asked == JobState::running ? "resumed" : "cancelled";
}

Result<void> may_become(const JobEntry& entry, JobState asked, bool extended) {
  JobState state = entry.stored.state;
  const bool finishing = entry.finishing != 0 && !extended;
  if (extended && state == JobState::done) state = JobState::running;
  if (state == asked && !finishing) return {};
  const bool possible =
      asked == JobState::running ? !is_terminal(state) || finishing : !is_terminal(state) && !finishing;
  if (possible) return {};
  return fail(Errc::failed_precondition,
              fmt::format("job {} is {}: it cannot be {}", entry.stored.id.value,
                          to_string(finishing ? JobState::done : state), done_to_become(asked)));
}

Error in_frame(const JobId& job, Error error) {
  if (const auto id = frame_of(job)) error.message = fmt::format("frame {}: {}", id->frame, error.message);
  return error;
}

double pixels_of(const StoredJob& job) {
  return static_cast<double>(job.settings.size.width) * job.settings.size.height;
}

// Checks whether done frames with this many pixels in total may be loaded and resumed together.
Result<void> may_wake(double pixels) {
  if (pixels <= static_cast<double>(limits::kMaxWokenPixels)) return {};
  return fail(Errc::failed_precondition,
              fmt::format("the frames that are done have {:.0f} pixels; {} can be taken up again at once: "
                          "extend the frames one by one",
                          pixels, limits::kMaxWokenPixels));
}

// Returns the frames whose target error is to be changed: frames that have not ended, and frames that ended
// because they reached a target error larger than the new one.
Result<std::vector<EntryPtr>> may_retarget(const Farm& farm, const JobId& id,
                                           const std::vector<EntryPtr>& sound, double target_error) {
  std::vector<EntryPtr> chosen;
  Error last{
      Errc::failed_precondition,
      fmt::format("all frames of job {} have ended: its target error can no longer be changed", id.value)};
  double woken = 0;
  for (const EntryPtr& frame : sound) {
    if (frame->unloaded) {
      const StoredJob& job = frame->stored;
      if (job.state != JobState::done || job.stopped != StopReason::error ||
          !(target_error < job.spec.target_error.value_or(0)))
        continue;
      woken += pixels_of(job);
      chosen.push_back(frame);
    } else if (auto ok = farm.retargeted(frame->stored.id, target_error); !ok)
      last = in_frame(frame->stored.id, ok.error());
    else
      chosen.push_back(frame);
  }
  if (chosen.empty()) return tl::unexpected(last);
  if (auto few = may_wake(woken); !few) return tl::unexpected(few.error());
  return chosen;
}

// Returns the frames that are to be extended to `spp` samples per pixel. Frames that were set to `spp`
// already are left out: an earlier change of the sequence may have been interrupted after some frames.
Result<std::vector<EntryPtr>> may_extend(const Farm& farm, const Sequence& sequence, std::uint64_t spp,
                                         TimePoint now) {
  std::vector<EntryPtr> chosen;
  double woken = 0;
  for (const EntryPtr& frame : sequence.frames) {
    const JobId& id = frame->stored.id;
    const JobState state = frame->stored.state;
    if (!frame->broken.empty() || is_closed(state))
      return tl::unexpected(
          in_frame(id, {Errc::failed_precondition,
                        fmt::format("it is {}: extend the other frames one by one", to_string(state))}));
    if (frame->stored.spp == even_spp(spp)) continue;
    if (frame->unloaded || frame->finishing)
      woken += frame->unloaded ? pixels_of(frame->stored) : 0;
    else if (auto ok = farm.extended(id, spp, now); !ok)
      return tl::unexpected(in_frame(id, ok.error()));
    chosen.push_back(frame);
  }
  if (chosen.empty())
    return fail(Errc::failed_precondition, fmt::format("all frames have {} samples per pixel", spp));
  if (auto few = may_wake(woken); !few) return tl::unexpected(few.error());
  return chosen;
}

// True if a unit of the job is leased or done.
bool has_begun(const JobEntry& entry) {
  return entry.stored.state == JobState::running || entry.clock.started() || !entry.leased.empty() ||
         entry.stored.totals.began_unix > 0;
}

// Returns for each of the jobs those that it is to wait for, or an error if it cannot wait. `id`: the job, or
// the sequence of which `jobs` are the frames. Frames that have ended are left out; frames that have begun
// are left out unless `after` is empty.
Result<std::vector<JobWait>> may_wait(const JobTable& table, const JobId& id,
                                      const std::vector<EntryPtr>& jobs,
                                      const std::vector<std::string>& after) {
  const auto ended = [](const EntryPtr& job) { return is_terminal(job->stored.state) || job->finishing; };
  const auto left_out = [&](const EntryPtr& job) {
    return after.empty() ? is_terminal(job->stored.state) : ended(job) || has_begun(*job);
  };
  if (std::ranges::all_of(jobs, left_out))
    return fail(Errc::failed_precondition,
                std::ranges::all_of(jobs, ended)
                    ? fmt::format("job {} has ended: it can no longer wait for others", id.value)
                    : fmt::format("job {} has begun: it can no longer wait for others; pause it instead, and "
                                  "resume it when they are done",
                                  id.value));
  if (auto ok = check_no_cycle(table, id, after); !ok) return tl::unexpected(ok.error());
  std::vector<std::uint32_t> frames;
  if (table.sequence(id))
    for (const EntryPtr& job : jobs) frames.push_back(frame_of(job->stored.id)->frame);
  auto lists = prerequisites_of(table, after, frames);
  if (!lists) return tl::unexpected(lists.error());
  std::vector<JobWait> waits;
  for (std::size_t i = 0; i < jobs.size(); ++i)
    if (!left_out(jobs[i])) waits.push_back({jobs[i], std::move((*lists)[i])});
  return waits;
}

}  // namespace

// Carries out a command on a job or on the frames of a sequence, and waits until coordinators that may take
// these jobs over know of it. The wait is not under the lock.
template <class Command>
Result<void> JobCommands::carry_out(const JobId& id, Command command) const {
  if (auto can = store_.can_share(); !can) return can;
  std::vector<JobId> jobs;
  {
    const auto core = core_.lock();
    if (const Sequence* sequence = core->jobs.sequence(id))
      for (const EntryPtr& frame : sequence->frames) jobs.push_back(frame->stored.id);
    else
      jobs.push_back(id);
    if (auto done = command(*core); !done) return done;
  }
  auto shared = store_.share(jobs);
  if (shared) return {};
  return fail(Errc::unavailable,
              fmt::format("the change is made here, but would be lost if another coordinator took the job "
                          "over: {}. Look at the job, and try again",
                          shared.error().message));
}

Result<void> JobCommands::change(const JobId& id, const JobChange& change) const {
  return carry_out(id, [&](Core& core) -> Result<void> {
    if (const Sequence* sequence = core.jobs.sequence(id))
      return change_sequence(core, id, *sequence, change);
    const auto entry = core.jobs.usable(id);
    return entry ? change_job(core, *entry, change) : tl::unexpected(entry.error());
  });
}

Result<void> JobCommands::remove(const JobId& id) const {
  return carry_out(id, [&](Core& core) {
    const Sequence* sequence = core.jobs.sequence(id);
    return sequence ? remove_sequence(core, id, *sequence) : remove_job(core, id);
  });
}

Result<void> JobCommands::remove_job(Core& core, const JobId& id) const {
  const auto found = core.jobs.job(id);
  if (!found) return tl::unexpected(found.error());
  const EntryPtr entry = *found;
  if (const auto frame = frame_of(id))
    return fail(Errc::failed_precondition,
                fmt::format("{} is a frame of job {}: it can be cancelled, and is removed with all frames",
                            id.value, frame->sequence.value));
  if (!is_terminal(entry->stored.state) && entry->finishing == 0)
    return become(core, {entry}, JobState::cancelled);
  if (auto removed = store_.remove_job(id); !removed) return removed;
  drop(core, entry);
  core.publisher.job_removed(id, entry->stored.owner);
  core.driver.notify_jobs_after(id);
  return {};
}

// One job

Result<void> JobCommands::change_job(Core& core, const EntryPtr& entry, const JobChange& change) const {
  if (auto ok = check(change); !ok) return ok;
  if (change.name && frame_of(entry->stored.id))
    return fail(Errc::invalid_argument, "a frame has the name of its sequence: rename the sequence");
  if (change.state)
    if (auto ok = may_become(*entry, *change.state, change.spp || change.target_error); !ok) return ok;
  if (auto ok = check_focus(change, {entry}); !ok) return ok;
  std::vector<JobWait> waits;
  if (change.after) {
    auto possible = may_wait(core.jobs, entry->stored.id, {entry}, *change.after);
    if (!possible) return tl::unexpected(possible.error());
    waits = std::move(*possible);
  }
  // The checks come first, so that a failed check leaves the job unchanged.
  if (change.spp)
    if (auto done = extend(core, *entry, *change.spp); !done) return done;
  if (change.target_error)
    if (auto done = set_target(core, *entry, *change.target_error); !done) return done;
  if (change.name)
    if (auto done = rename(core, {entry}, *change.name); !done) return done;
  if (change.priority)
    if (auto done = set_priority(core, {entry}, *change.priority); !done) return done;
  if (change.name || change.priority) core.publisher.job(*entry);
  if (change.focus)
    if (auto done = set_focus(core, {entry}, *change.focus); !done) return done;
  if (change.after)
    if (auto done = set_after(core, waits); !done) return done;
  return change.state ? become(core, {entry}, *change.state) : Result<void>{};
}

Result<void> JobCommands::become(Core& core, const Entries& jobs, JobState asked) const {
  Result<void> done;
  Entries changed;
  for (const EntryPtr& job : jobs) {
    const JobState state = job->stored.state;
    if (job->finishing) {  // its final image is being written, or could not be written
      if (asked == JobState::running && !job->trouble.empty()) {
        job->trouble.clear();
        images_.finish_again(core, job);
      }
      continue;
    }
    if (asked == JobState::running) {
      if (state != JobState::paused) continue;
      auto saved = core.records.put_pin(job);
      if (saved) saved = core.records.put_quarantined();
      if (!saved && done) done = tl::unexpected(in_frame(job->stored.id, saved.error()));
      if (!saved) continue;
    }
    if (asked != JobState::cancelled || state != asked) changed.push_back(job);
  }
  // The records are stored before the farm acts on them: what a user was told has happened survives a crash,
  // and what could not be stored has not happened.
  const auto edit = [&](StoredJob& job) {
    const bool begins = asked == JobState::running && !job.numeric_class;
    job.state = begins ? JobState::queued : asked;
    job.missing_blobs.clear();  // a pause by the user does not end when the job's files are there
  };
  if (auto put = edit_all(core, changed, edit); !put) return put;
  core.records.put_together([&] {
    for (const EntryPtr& job : changed) {
      const JobId& id = job->stored.id;
      if (asked == JobState::cancelled) {
        core.driver.run(JobCancelled{id});
      } else if (asked == JobState::paused) {
        core.driver.run(JobPaused{id});
      } else {
        job->trouble.clear();
        ++job->resumes;
        core.driver.run(JobResumed{id});
      }
    }
  });
  return done;
}

// Applies edit() to the records of all these jobs, and stores them in one transaction. If that fails, no
// record is changed, neither in the store nor in memory.
template <class Edit>
Result<void> JobCommands::edit_all(Core& core, const Entries& jobs, Edit edit) const {
  std::vector<StoredJob> edited;
  for (const EntryPtr& job : jobs) edit(edited.emplace_back(job->stored));
  const auto put = store_.put_jobs(edited);
  core.records.note(put);
  if (!put) return put;
  for (const EntryPtr& job : jobs) {
    edit(job->stored);
    core.jobs.count_state(*job);
  }
  return {};
}

Result<void> JobCommands::rename(Core& core, const Entries& jobs, const std::string& name) const {
  return edit_all(core, jobs, [&](StoredJob& job) {
    if (job.scene_name.empty()) job.scene_name = job.name;
    job.name = name;
  });
}

Result<void> JobCommands::set_priority(Core& core, const Entries& jobs, int priority) const {
  if (auto put = edit_all(core, jobs, [&](StoredJob& job) { job.spec.priority = priority; }); !put)
    return put;
  for (const EntryPtr& job : jobs)
    if (!job->unloaded) core.driver.run(JobPriority{job->stored.id, priority});
  return {};
}

Result<void> JobCommands::set_after(Core& core, const std::vector<JobWait>& waits) const {
  // Stored before the farm acts on it, as in become(): what could not be stored has not happened
  std::vector<StoredJob> edited;
  for (const JobWait& one : waits) edited.emplace_back(one.job->stored).spec.after = one.after;
  const auto put = store_.put_jobs(edited);
  core.records.note(put);
  if (!put) return put;
  core.records.put_together([&] {
    for (const JobWait& one : waits) core.driver.set_after(one.job, one.after);
  });
  return {};
}

Result<void> JobCommands::set_focus(Core& core, const Entries& jobs,
                                    const std::optional<PixelRect>& focus) const {
  if (auto put = edit_all(core, jobs, [&](StoredJob& job) { job.focus = focus; }); !put) return put;
  for (const EntryPtr& job : jobs) {
    if (!job->unloaded) core.driver.run(JobFocused{job->stored.id, focus});
    core.publisher.job(*job);
  }
  return {};
}

Result<void> JobCommands::extend(Core& core, JobEntry& entry, std::uint64_t spp) const {
  if (spp == 0 || spp > limits::kMaxSpp)
    return fail(Errc::invalid_argument,
                fmt::format("{} samples per pixel: it must be 1 to {}", spp, limits::kMaxSpp));
  const JobId id = entry.stored.id;
  const JobState state = entry.stored.state;
  if (is_closed(state))
    return fail(Errc::failed_precondition,
                fmt::format("job {} is {}: it cannot be extended", id.value, to_string(state)));
  if (auto woken = restore_.wake(core, entry); !woken) return woken;
  return go_on(core, entry, core.driver.farm().extended(id, spp, clock_.now()), JobExtended{id, spp},
               fmt::format("extended to {} samples per pixel", spp));
}

Result<void> JobCommands::set_target(Core& core, JobEntry& entry, double target_error) const {
  const JobId id = entry.stored.id;
  const JobState state = entry.stored.state;
  if (is_closed(state))
    return fail(Errc::failed_precondition,
                fmt::format("job {} is {}: its target error can no longer be changed; submit it again",
                            id.value, to_string(state)));
  if (auto woken = restore_.wake(core, entry); !woken) return woken;
  return go_on(core, entry, core.driver.farm().retargeted(id, target_error), JobRetargeted{id, target_error},
               fmt::format("target error {} from now on", target_error));
}

// Extends a job (more samples or a smaller target error), first in its stored record, then in the farm.
// `plan`: the job's plan after the extension, or why the farm refuses it; after an error a done job is
// unloaded again.
Result<void> JobCommands::go_on(Core& core, JobEntry& entry, const Result<JobPlan>& plan, const Event& change,
                                std::string log_line) const {
  const JobState state = entry.stored.state;
  const auto refuse = [&](const Error& why) -> Result<void> {
    if (state == JobState::done && !entry.finishing) core.driver.unload(entry);
    return tl::unexpected(why);
  };
  if (!plan) return refuse(plan.error());
  StoredJob next = entry.stored;
  next.spec.target_error = plan->target_error;
  if (!plan->target_error) next.spec.target_layer = TargetLayer::raw;
  next.spec.time = plan->time;
  if (plan->spp != next.spp) next.spp = next.spec.spp = plan->spp;
  if (state == JobState::done) {
    next.state = JobState::running;
    next.stopped.reset();
  }
  const auto put = store_.put_job(next);
  core.records.note(put);
  if (!put) return refuse(put.error());
  entry.stored = std::move(next);
  core.jobs.count_state(entry);
  if (entry.finishing != 0 || state == JobState::done)
    entry.clock.start(clock_.now() - from_seconds(entry.stored.totals.render_seconds));
  entry.finishing = 0;
  core.driver.run(change);
  core.records.log(entry.stored.id, std::move(log_line));
  core.publisher.job(entry);
  return {};
}

// Drops the job from memory, after its record in the store was removed.
void JobCommands::drop(Core& core, const EntryPtr& entry) const {
  const JobId id = entry->stored.id;
  entry->removed = true;
  entry->finishing = 0;
  if (entry->trace) {
    if (!is_terminal(entry->stored.state)) entry->trace->event("removed", clock_.now());
    entry->trace->end(entry->stored, clock_.now());
    entry->trace.reset();
  }
  if (!entry->unloaded) core.driver.run(JobForgotten{id});
  core.jobs.remove(entry);
  log_info(fmt::format("job={}", id.value), "removed");
  // Background writes of the job may still be queued. They would create files in the job's folder again, so
  // the removal of the folder is queued behind them.
  writes_.push([this, id] {
    (void)store_.remove_job(id);
    files_.discard_folder(id);
  });
}

// Sequences

Result<void> JobCommands::change_sequence(Core& core, const JobId& id, const Sequence& sequence,
                                          const JobChange& change) const {
  const Farm& farm = core.driver.farm();
  // `sound`: frames that could be restored at the start; `open`: those of them that have not ended;
  // `retargeted` and `extended`: frames that get the new target error, or more samples
  Entries sound, open, retargeted, extended;
  for (const EntryPtr& frame : sequence.frames) {
    if (!frame->broken.empty()) continue;
    sound.push_back(frame);
    if (!is_terminal(frame->stored.state)) open.push_back(frame);
  }
  if (auto ok = check(change); !ok) return ok;
  if (change.target_error) {
    auto chosen = may_retarget(farm, id, sound, *change.target_error);
    if (!chosen) return tl::unexpected(chosen.error());
    retargeted = std::move(*chosen);
  }
  if (change.spp) {
    auto chosen = may_extend(farm, sequence, *change.spp, clock_.now());
    if (!chosen) return tl::unexpected(chosen.error());
    extended = std::move(*chosen);
  }
  if (auto ok = check_focus(change, sound); !ok) return ok;
  std::vector<JobWait> waits;
  if (change.after) {
    auto possible = may_wait(core.jobs, id, sequence.frames, *change.after);
    if (!possible) return tl::unexpected(possible.error());
    waits = std::move(*possible);
  }
  if (change.state && open.empty() && !change.spp) {
    const JobState state = core.views.sequence(id, sequence, false).state;
    if (state != *change.state)
      return fail(Errc::failed_precondition,
                  fmt::format("all frames of job {} have ended: it is {}", id.value, to_string(state)));
  }
  // The farm can check only frames that are loaded. So all frames to be extended are loaded, and all are
  // checked before the first one is extended.
  for (const EntryPtr& frame : extended) {
    auto possible = restore_.wake(core, *frame);
    if (possible)
      if (auto plan = farm.extended(frame->stored.id, *change.spp, clock_.now()); !plan)
        possible = tl::unexpected(plan.error());
    if (possible) continue;
    for (const EntryPtr& loaded : extended)
      if (!loaded->finishing) core.driver.unload(*loaded);
    return tl::unexpected(in_frame(frame->stored.id, possible.error()));
  }
  for (const EntryPtr& frame : extended)
    if (auto done = extend(core, *frame, *change.spp); !done)
      return tl::unexpected(in_frame(frame->stored.id, done.error()));
  for (const EntryPtr& frame : retargeted)
    if (auto done = set_target(core, *frame, *change.target_error); !done)
      return tl::unexpected(in_frame(frame->stored.id, done.error()));
  if (change.name)
    if (auto done = rename(core, sound, *change.name); !done) return done;
  if (change.priority)
    if (auto done = set_priority(core, sound, *change.priority); !done) return done;
  if (change.focus)
    if (auto done = set_focus(core, sound, *change.focus); !done) return done;
  if (change.after)
    if (auto done = set_after(core, waits); !done) return done;
  if (change.state) {
    open.insert(open.end(), extended.begin(), extended.end());
    if (auto done = become(core, open, *change.state); !done) return done;
  }
  core.publisher.sequence(id, true);
  return {};
}

// If some frames have not ended, cancels these frames and removes nothing, as with a single job. Otherwise
// removes all frames.
Result<void> JobCommands::remove_sequence(Core& core, const JobId& id, const Sequence& sequence) const {
  Entries open;
  std::vector<JobId> ids;
  for (const EntryPtr& frame : sequence.frames) {
    ids.push_back(frame->stored.id);
    if (!is_terminal(frame->stored.state) && !frame->finishing) open.push_back(frame);
  }
  if (!open.empty()) {
    auto done = become(core, open, JobState::cancelled);
    core.publisher.sequence(id, true);
    return done;
  }
  if (auto removed = store_.remove_jobs(ids); !removed) return removed;
  const Entries frames = sequence.frames;
  core.jobs.unlist(id);
  for (const EntryPtr& frame : frames) drop(core, frame);
  core.publisher.job_removed(id, frames.front()->stored.owner);
  for (const EntryPtr& frame : frames) core.driver.notify_jobs_after(frame->stored.id);
  core.driver.notify_jobs_after(id);
  return {};
}

}  // namespace ls::coordinator
