// Sequences (jobs with frames): each frame is a job of its own, named by frame_job() and otherwise like any
// other job. This file creates, changes and removes the jobs of a sequence together. Only their ids make them
// a sequence: nothing else is stored that could be lost.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/base/log.h"
#include "coordinator/admission/admission.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {
namespace {

Error in_frame(const JobId& job, Error error) {
  if (const auto id = frame_of(job)) error.message = fmt::format("frame {}: {}", id->frame, error.message);
  return error;
}

double pixels_of(const StoredJob& job) {
  return static_cast<double>(job.settings.size.width) * job.settings.size.height;
}

// Checks that done frames with this many pixels in total may be resumed together.
Result<void> may_wake(double pixels) {
  if (pixels <= static_cast<double>(limits::kMaxWokenPixels)) return {};
  return fail(Errc::failed_precondition,
              fmt::format("the frames that are done have {:.0f} pixels; {} can be taken up again at once: "
                          "extend the frames one by one",
                          pixels, limits::kMaxWokenPixels));
}

}  // namespace

tl::expected<JobId, Rejected> Service::submit_sequence(const SubmitRequest& request) {
  const auto refuse = [](Error error) { return tl::unexpected(Rejected{std::move(error), {}}); };
  const auto in_use = blobs_->in_use();
  auto taken = admit_sequence(request, *blobs_);
  if (!taken) return tl::unexpected(std::move(taken.error()));
  for (const Admission& admission : *taken)
    if (const auto put = blobs_->put(admission.job.scene, std::as_bytes(std::span(admission.scene_json)));
        !put)
      return refuse(put.error());
  std::vector<StoredJob> jobs;
  const auto numbers = request.spec.frames->frames();
  const double at = unix_now();
  for (Admission& admission : *taken) {
    admission.job.submitted_unix = at;
    jobs.push_back(std::move(admission.job));
  }
  taken->clear();

  const std::lock_guard lock(mutex_);
  if (const auto room = room_for_locked(request.owner, jobs.size()); !room) return refuse(room.error());
  const JobId id = unused_id_locked();
  for (std::size_t i = 0; i < jobs.size(); ++i) jobs[i].id = frame_job(id, numbers[i]);
  std::vector<std::shared_ptr<PartialLog>> logs(jobs.size());
  for (std::size_t i = 0; on_disk() && i < jobs.size(); ++i) {
    auto log = PartialLog::open(folder(jobs[i].id));
    if (!log) return refuse(log.error());
    logs[i] = std::move(*log);
  }
  if (const auto put = store_->put_jobs(jobs); !put) return refuse(put.error());
  std::vector<EntryPtr> entries;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    entries.push_back(make_entry(std::move(jobs[i])));
    JobEntry& entry = *entries.back();
    entry.log = std::move(logs[i]);
    entry.assembly.emplace(entry.grid, entry.stored.spec.target_error.has_value(),
                           aovs_of(entry.stored.settings));
    if (entry.stored.spec.reference) entry.reference_tiles.emplace(entry.assembly->film());
    register_locked(entries.back());
  }
  log_info(fmt::format("job={} frames={}", id.value, to_string(*request.spec.frames)), "submitted");
  log_job(entries.front()->stored.id, fmt::format("submitted with {} frames", entries.size()));
  for (const EntryPtr& entry : entries) run_locked(JobSubmitted{plan_of(entry->stored)});
  publish_sequence_locked(id, true);
  return id;
}

// Registers a job. If it is a frame, it joins its sequence, which is listed at the place of its first frame.
void Service::register_locked(const EntryPtr& entry) {
  const JobId& id = entry->stored.id;
  entries_.emplace(id, entry);
  const auto frame = frame_of(id);
  if (!frame) return order_.push_back(id);
  auto [found, fresh] = sequences_.try_emplace(frame->sequence);
  if (fresh) order_.push_back(frame->sequence);
  auto& frames = found->second.frames;
  const auto place = std::upper_bound(
      frames.begin(), frames.end(), frame->frame,
      [](std::uint32_t number, const EntryPtr& e) { return number < frame_of(e->stored.id)->frame; });
  frames.insert(place, entry);
  auto& warnings = found->second.warnings;
  for (const std::string& warning : entry->stored.warnings)
    if (warnings.size() < limits::kMaxWarnings &&
        std::find(warnings.begin(), warnings.end(), warning) == warnings.end())
      warnings.push_back(warning);
}

void Service::publish_sequence_locked(const JobId& id, bool at_once) {
  const auto found = sequences_.find(id);
  if (found == sequences_.end() || restoring_) return;
  Sequence& sequence = found->second;
  // A longer sequence is published with the next tick instead
  at_once &= sequence.frames.size() <= limits::kFramesPerEvent;
  const double period = limits::kProgressSeconds * (1 + static_cast<double>(sequence.frames.size()) /
                                                            static_cast<double>(limits::kFramesPerEvent));
  sequence.progress_due = !at_once && seconds(now() - sequence.last_progress) < period;
  if (sequence.progress_due) return;
  sequence.last_progress = now();
  hub_->publish("job", job_json(sequence_view_locked(id, sequence, false)), id.value,
                sequence.frames.front()->stored.owner);
}

// Changes

// Applies `edit` to the stored jobs of all frames in one transaction: either all are stored or nothing is
// changed.
Result<void> Service::edit_locked(const std::vector<EntryPtr>& frames,
                                  const std::function<void(StoredJob&)>& edit) {
  std::vector<StoredJob> edited;
  for (const EntryPtr& frame : frames) {
    edited.push_back(frame->stored);
    edit(edited.back());
  }
  if (auto put = store_->put_jobs(edited); !put) return put;
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i]->stored = std::move(edited[i]);
  return {};
}

// Changes a sequence. As for a single job, everything is checked before anything is applied. Frames that have
// ended change only if they are to get more samples.
Result<void> Service::change_sequence_locked(const JobId& id, const Sequence& sequence,
                                             const JobChange& change) {
  std::vector<EntryPtr> sound, open, retargeted, extended;  // `sound`: frames whose record can be read
  for (const EntryPtr& frame : sequence.frames) {
    if (!frame->broken.empty()) continue;
    sound.push_back(frame);
    if (!is_terminal(shown_state(*frame))) open.push_back(frame);
  }
  if (change.priority)
    if (auto ok = check_priority(*change.priority); !ok) return ok;
  if (change.spp && change.target_error)
    return fail(Errc::invalid_argument,
                "samples (spp) and target_error cannot be changed at once: one decides "
                "how far the job goes; change one, then the other");
  if (change.target_error) {
    auto chosen = may_retarget_locked(id, sound, *change.target_error);
    if (!chosen) return tl::unexpected(chosen.error());
    retargeted = std::move(*chosen);
  }
  if (change.spp) {
    auto chosen = may_extend_locked(sequence, *change.spp);
    if (!chosen) return tl::unexpected(chosen.error());
    extended = std::move(*chosen);
  }
  if (change.state && open.empty() && !change.spp) {
    const JobState state = sequence_view_locked(id, sequence, false).state;
    if (state != *change.state)
      return fail(Errc::failed_precondition,
                  fmt::format("all frames of job {} have ended: it is {}", id.value, to_string(state)));
  }
  for (const EntryPtr& frame : extended)
    if (auto done = extend_locked(*frame, *change.spp); !done)
      return tl::unexpected(in_frame(frame->stored.id, done.error()));
  for (const EntryPtr& frame : retargeted)
    if (auto done = set_target_locked(*frame, *change.target_error); !done)
      return tl::unexpected(in_frame(frame->stored.id, done.error()));
  if (change.priority) {
    if (auto done = edit_locked(sound, [&](StoredJob& j) { j.spec.priority = *change.priority; }); !done)
      return done;
    for (const EntryPtr& frame : sound)
      if (!frame->unloaded) run_locked(JobPriority{frame->stored.id, *change.priority});
  }
  if (change.state) {
    open.insert(open.end(), extended.begin(), extended.end());
    if (auto done = become_all_locked(open, *change.state); !done) return done;
  }
  publish_sequence_locked(id, true);
  return {};
}

// Returns the frames that a new target error concerns: those whose end is not decided yet, and those that
// ended because they reached a larger target.
Result<std::vector<Service::EntryPtr>> Service::may_retarget_locked(const JobId& id,
                                                                    const std::vector<EntryPtr>& sound,
                                                                    double target_error) const {
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
    } else if (auto ok = farm_.may_retarget(frame->stored.id, target_error); !ok)
      last = in_frame(frame->stored.id, ok.error());
    else
      chosen.push_back(frame);
  }
  if (chosen.empty()) return tl::unexpected(last);
  if (auto few = may_wake(woken); !few) return tl::unexpected(few.error());
  return chosen;
}

// Returns all frames except those that have `spp` samples already, as after a change that was interrupted.
Result<std::vector<Service::EntryPtr>> Service::may_extend_locked(const Sequence& sequence,
                                                                  std::uint64_t spp) const {
  std::vector<EntryPtr> chosen;
  double woken = 0;
  for (const EntryPtr& frame : sequence.frames) {
    const JobId& id = frame->stored.id;
    const JobState state = shown_state(*frame);
    if (!frame->broken.empty() || state == JobState::failed || state == JobState::cancelled)
      return tl::unexpected(
          in_frame(id, {Errc::failed_precondition,
                        fmt::format("it is {}: extend the other frames one by one", to_string(state))}));
    if (frame->stored.spp == even_spp(spp)) continue;
    if (frame->unloaded || frame->finishing)
      woken += frame->unloaded ? pixels_of(frame->stored) : 0;
    else if (auto ok = farm_.may_extend(id, spp); !ok)
      return tl::unexpected(in_frame(id, ok.error()));
    chosen.push_back(frame);
  }
  if (chosen.empty())
    return fail(Errc::failed_precondition, fmt::format("all frames have {} samples per pixel", spp));
  if (auto few = may_wake(woken); !few) return tl::unexpected(few.error());
  return chosen;
}

// Calls `changes` and then stores all jobs that it has modified, in one transaction: a sequence may have
// thousands of frames.
Result<void> Service::save_all_locked(const std::function<void()>& changes) {
  std::set<EntryPtr> unsaved;
  unsaved_ = &unsaved;
  changes();
  unsaved_ = nullptr;
  std::vector<StoredJob> records;
  for (const EntryPtr& entry : unsaved) records.push_back(entry->stored);
  auto put = store_->put_jobs(records);
  if (put) return put;
  store_trouble_ = put.error().message;
  log_error("", put.error().message);
  return put;
}

// Changes the state of the frames and stores them together. A frame whose image is being written is left to
// end, unless the writing has failed and is to be repeated.
Result<void> Service::become_all_locked(const std::vector<EntryPtr>& frames, JobState asked) {
  Result<void> done;
  const auto saved = save_all_locked([&] {
    for (const EntryPtr& frame : frames) {
      if (frame->finishing && (asked != JobState::running || frame->trouble.empty())) continue;
      if (auto became = become_locked(frame, asked); !became && done)
        done = tl::unexpected(in_frame(frame->stored.id, became.error()));
    }
  });
  return done ? saved : done;
}

// Removes a sequence. As for a single job, open frames are cancelled and kept; a sequence that has ended is
// removed with all its frames.
Result<void> Service::remove_sequence_locked(const JobId& id, const Sequence& sequence) {
  std::vector<EntryPtr> open;
  std::vector<JobId> ids;
  for (const EntryPtr& frame : sequence.frames) {
    ids.push_back(frame->stored.id);
    if (!is_terminal(shown_state(*frame)) && !frame->finishing) open.push_back(frame);
  }
  if (!open.empty()) {
    auto done = become_all_locked(open, JobState::cancelled);
    publish_sequence_locked(id, true);
    return done;
  }
  if (auto removed = store_->remove_jobs(ids); !removed) return removed;
  const std::vector<EntryPtr> frames = sequence.frames;
  sequences_.erase(id);
  std::erase(order_, id);
  for (const EntryPtr& frame : frames) drop_locked(frame);
  hub_->publish("job", job_removed_json(id), id.value, frames.front()->stored.owner);
  return {};
}

}  // namespace ls::coordinator
