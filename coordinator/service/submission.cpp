#include "coordinator/service/submission.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "coordinator/admission/admission.h"
#include "coordinator/service/core.h"
#include "coordinator/service/state/prerequisites.h"
#include "core/base/clock.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

// Returns one admission for a job, or one per frame for a sequence.
tl::expected<std::vector<Admission>, Rejected> admit_all(const SubmitRequest& request, const BlobStore& blobs,
                                                         const SceneReader& read) {
  if (request.spec.frames) return admit_sequence(request, blobs, read);
  auto one = admit(request, blobs, read);
  if (!one) return tl::unexpected(std::move(one.error()));
  std::vector<Admission> all;
  all.push_back(std::move(*one));
  return all;
}

// Returns the header `traceparent` (W3C Trace Context) in its normal form; empty if it is malformed.
std::string clean_traceparent(const std::string& header) {
  const auto parent = trace::parse_traceparent(header);
  return parent ? to_traceparent(*parent) : "";
}

}  // namespace

tl::expected<JobId, Rejected> Submission::submit(const SubmitRequest& request) {
  const double at = system_unix_seconds();
  const TimePoint began = clock_.now();
  if (request.spec.denoise)
    if (const auto possible = denoising_.available(); !possible) return rejected(possible.error());
  const std::uint64_t memory = request.scene_text.size() * limits::kMemoryPerTextByte +
                               (request.spec.reference ? limits::kMemoryOfReference : 0);
  const Gate::Place turn(turns_, request.owner, memory);
  const auto in_use = blobs_.in_use();
  auto admitted = admit_all(request, blobs_, scenes_());
  if (!admitted) return tl::unexpected(std::move(admitted.error()));
  std::vector<StoredJob> jobs;
  const std::string traceparent = clean_traceparent(request.traceparent);
  for (Admission& admission : *admitted) {
    if (const auto put = blobs_.put(admission.job.scene, std::as_bytes(std::span(admission.scene_json)));
        !put)
      return rejected(put.error());
    admission.job.submitted_unix = at;
    admission.job.traceparent = traceparent;
    jobs.push_back(std::move(admission.job));
  }
  admitted->clear();
  const auto taken = take(std::move(jobs), request.spec.frames, began);
  return taken ? tl::expected<JobId, Rejected>(*taken) : rejected(taken.error());
}

Result<JobId> Submission::submit_again(const JobId& before, const JobSpec& changes, const std::string& owner,
                                       const std::string& traceparent) {
  const double at = system_unix_seconds();
  const TimePoint began = clock_.now();
  std::vector<StoredJob> jobs;  // first the earlier ones, then the new ones
  std::optional<FrameRange> range;
  {
    const auto core = core_.lock();
    const auto entries = core->jobs.job_or_frames(before);
    if (!entries) return tl::unexpected(entries.error());
    for (const EntryPtr& entry : *entries) {
      if (const auto usable = core->jobs.usable(entry->stored.id); !usable)
        return tl::unexpected(usable.error());
      jobs.push_back(entry->stored);
    }
    if (const Sequence* sequence = core->jobs.sequence(before)) range = sequence->range();
    if (range && range->count() != jobs.size())
      return fail(Errc::failed_precondition,
                  fmt::format("{} of its {} frames are missing: submit the scene again",
                              range->count() - jobs.size(), range->count()));
  }
  if (jobs.front().spec.denoise || changes.denoise)
    if (const auto possible = denoising_.available(); !possible) return tl::unexpected(possible.error());
  const auto in_use = blobs_.in_use();
  for (StoredJob& job : jobs) {
    const auto frame = range ? std::optional(frame_of(job.id)->frame) : std::nullopt;
    auto again = admit_again(job, changes, blobs_, frame);
    if (!again) return tl::unexpected(again.error());
    job = std::move(again->job);
    if (!again->scene_json.empty())
      if (const auto put = blobs_.put(job.scene, std::as_bytes(std::span(again->scene_json))); !put)
        return tl::unexpected(put.error());
    job.owner = owner;
    job.submitted_unix = at;
    job.traceparent = clean_traceparent(traceparent);
  }
  return take(std::move(jobs), range, began);
}

// Stores the jobs, either all or none, and adds them to the farm.
Result<JobId> Submission::take(std::vector<StoredJob> jobs, const std::optional<FrameRange>& range,
                               TimePoint began) {
  const auto core = core_.lock();
  if (const auto room = core->jobs.room_for(jobs.front().owner, jobs.size()); !room)
    return tl::unexpected(room.error());
  if (const auto room = core->jobs.film_room_for(jobs, film_bytes_); !room)
    return tl::unexpected(room.error());
  const JobId id = core->jobs.unused_id();
  const auto frames = range ? range->frames() : std::vector<std::uint32_t>();
  auto after = prerequisites_of(core->jobs, jobs.front().spec.after, frames);
  if (!after) return tl::unexpected(after.error());
  for (std::size_t i = 0; i < jobs.size(); ++i) jobs[i].spec.after = std::move((*after)[i]);
  std::vector<std::shared_ptr<PartialLog>> logs(jobs.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    jobs[i].id = range ? frame_job(id, frames[i]) : id;
    if (!files_.on_disk()) continue;
    auto log = PartialLog::open(files_.folder(jobs[i].id));
    if (!log) return tl::unexpected(log.error());
    logs[i] = std::move(*log);
  }
  const auto put = store_.put_jobs(jobs);
  core->records.note(put);
  if (!put) return tl::unexpected(put.error());
  std::vector<EntryPtr> entries;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    entries.push_back(std::make_shared<JobEntry>(std::move(jobs[i]), clock_.now()));
    entries.back()->log = std::move(logs[i]);
    entries.back()->begin_image();
    entries.back()->begin_comparison();
    entries.back()->trace = JobTrace::begin(core->tracing, entries.back()->stored);
    core->jobs.add(entries.back());
  }

  JobEntry& first = *entries.front();
  if (range) {
    log_info(fmt::format("job={} frames={}", id.value, to_string(*range)), "submitted");
    core->records.log(first.stored.id, fmt::format("submitted with {} frames", entries.size()));
  } else {
    log_info(fmt::format("job={} name={}", id.value, log_value(first.stored.name)), "submitted");
    core->records.log(id, "submitted");
    core->publisher.job(first);
  }
  for (const EntryPtr& entry : entries)
    if (const auto& names = entry->stored.spec.after; !names.empty())
      core->records.log(entry->stored.id, fmt::format("waits for {}", fmt::join(names, ", ")));
  for (const EntryPtr& entry : entries)
    if (entry->trace) entry->trace->step("admit scene", began, clock_.now());
  for (const EntryPtr& entry : entries) core->driver.run(JobSubmitted{plan_of(entry->stored)});
  core->publisher.sequence(id, true);
  return id;
}

}  // namespace ls::coordinator
