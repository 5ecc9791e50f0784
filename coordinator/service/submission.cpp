#include "coordinator/service/submission.h"

#include <fmt/format.h>

#include "common/base/log.h"
#include "coordinator/admission/admission.h"
#include "coordinator/service/core.h"

namespace ls::coordinator {
namespace {

// Returns one admission, or for a sequence one for each frame.
tl::expected<std::vector<Admission>, Rejected> admit_all(const SubmitRequest& request,
                                                         const BlobStore& blobs) {
  if (request.spec.frames) return admit_sequence(request, blobs);
  auto one = admit(request, blobs);
  if (!one) return tl::unexpected(std::move(one.error()));
  std::vector<Admission> all;
  all.push_back(std::move(*one));
  return all;
}

}  // namespace

tl::expected<JobId, Rejected> Submission::submit(const SubmitRequest& request) {
  const auto refuse = [](const Error& error) { return tl::unexpected(Rejected{error, {}}); };
  if (request.spec.denoise)
    if (const auto possible = denoising_.available(); !possible) return refuse(possible.error());
  const auto in_use = blobs_.in_use();
  auto admitted = admit_all(request, blobs_);
  if (!admitted) return tl::unexpected(std::move(admitted.error()));
  std::vector<StoredJob> jobs;
  const double at = unix_now();
  for (Admission& admission : *admitted) {
    if (const auto put = blobs_.put(admission.job.scene, std::as_bytes(std::span(admission.scene_json)));
        !put)
      return refuse(put.error());
    admission.job.submitted_unix = at;
    jobs.push_back(std::move(admission.job));
  }
  admitted->clear();

  const auto core = core_.lock();
  if (const auto room = core->jobs.room_for(request.owner, jobs.size()); !room) return refuse(room.error());
  const JobId id = core->jobs.unused_id();
  const auto frames = request.spec.frames ? request.spec.frames->frames() : std::vector<std::uint32_t>();
  std::vector<std::shared_ptr<PartialLog>> logs(jobs.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    jobs[i].id = request.spec.frames ? frame_job(id, frames[i]) : id;
    if (!files_.on_disk()) continue;
    auto log = PartialLog::open(files_.folder(jobs[i].id));
    if (!log) return refuse(log.error());
    logs[i] = std::move(*log);
  }
  if (const auto put = store_.put_jobs(jobs); !put) return refuse(put.error());
  std::vector<EntryPtr> entries;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    entries.push_back(std::make_shared<JobEntry>(std::move(jobs[i]), clock_.now()));
    entries.back()->log = std::move(logs[i]);
    entries.back()->begin_image();
    entries.back()->begin_comparison();
    core->jobs.add(entries.back());
  }

  JobEntry& first = *entries.front();
  if (request.spec.frames) {
    log_info(fmt::format("job={} frames={}", id.value, to_string(*request.spec.frames)), "submitted");
    core->records.log(first.stored.id, fmt::format("submitted with {} frames", entries.size()));
  } else {
    log_info(fmt::format("job={} name={}", id.value, log_value(first.stored.name)), "submitted");
    core->records.log(id, "submitted");
    core->publisher.job(first);
  }
  for (const EntryPtr& entry : entries) core->driver.run(JobSubmitted{plan_of(entry->stored)});
  core->publisher.sequence(id, true);
  return id;
}

}  // namespace ls::coordinator
