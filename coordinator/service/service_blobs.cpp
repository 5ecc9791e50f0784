// Jobs that wait for a blob (a file of their scene) that is missing or damaged. They are paused; this does
// not count against units or workers. They resume automatically when the blob is available again, whichever
// way it arrived.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/log.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {
namespace {

std::optional<BlobRef> file_of(const StoredJob& job, const Digest& digest) {
  if (job.scene == digest) return BlobRef{digest, 0, job.name};
  const auto asset = std::find_if(job.assets.begin(), job.assets.end(),
                                  [&](const BlobRef& a) { return a.digest == digest; });
  return asset == job.assets.end() ? std::nullopt : std::optional(*asset);
}

// Returns a text that tells the user what to send again. A file can be uploaded, but the scene is stored in
// our own format, which only a submission makes.
std::string what_to_do(const StoredJob& job, const BlobRef& file, bool damaged) {
  const bool scene = file.digest == job.scene;
  return fmt::format(
      "it waits for its {} '{}', whose blob {} {}: {}hand in the same scene again with `lightshaft submit`, "
      "and this job goes on by itself",
      scene ? "scene" : "file", file.name, file.digest.hex(), damaged ? "was damaged here" : "is not here",
      scene ? "" : fmt::format("upload the file again (PUT /api/v1/blobs/{}), or ", file.digest.hex()));
}

bool is_open(JobState state) { return state == JobState::queued || state == JobState::running; }

}  // namespace

Result<std::vector<BlobRef>> Service::missing_blobs_of(const StoredJob& job) const {
  std::vector<BlobRef> files = job.assets, missing;
  files.push_back({job.scene, 0, job.name});
  for (const BlobRef& file : files) {
    const auto there = blobs_->find(file.digest);
    if (!there) return tl::unexpected(there.error());
    if (!*there) missing.push_back(file);
  }
  return missing;
}

void Service::await_locked(JobEntry& entry, const BlobRef& file, bool damaged) {
  entry.stored.missing_blobs.insert(file.digest);
  entry.trouble = what_to_do(entry.stored, file, damaged);
  log_error(fmt::format("job={}", entry.stored.id.value), entry.trouble);
  log_job(entry.stored.id, entry.trouble);
}

void Service::blob_missing(const Digest& digest, const Error& why) {
  const std::lock_guard lock(mutex_);
  std::vector<EntryPtr> waiting;
  for (const auto& [id, entry] : entries_) {
    const bool waits = !entry->stored.missing_blobs.empty() && !entry->stored.missing_blobs.contains(digest);
    if (!entry->unloaded && !entry->finishing && (waits || is_open(shown_state(*entry))) &&
        file_of(entry->stored, digest))
      waiting.push_back(entry);
  }
  if (waiting.empty()) return;
  (void)save_all_locked([&] {  // what cannot be stored is found again at the next start
    for (const EntryPtr& entry : waiting) {
      log_job(entry->stored.id, why.message);
      await_locked(*entry, *file_of(entry->stored, digest), why.code == Errc::failed_precondition);
      if (is_open(shown_state(*entry))) run_locked(JobPaused{entry->stored.id});
      persist_locked(*entry);
      publish_job_locked(*entry);
    }
  });
}

// Under the lock this only collects the digests of missing blobs. Another thread looks them up, since this
// may need the network.
void Service::look_for_missing_locked() {
  if (now() - last_look_ < limits::kMissingBlobLook || looks_.size() > 0) return;
  std::set<Digest> missing_blobs;
  for (const auto& [id, entry] : entries_)
    missing_blobs.insert(entry->stored.missing_blobs.begin(), entry->stored.missing_blobs.end());
  if (missing_blobs.empty()) return;
  last_look_ = now();
  looks_.push(std::move(missing_blobs));
}

void Service::look_for(const std::set<Digest>& missing_blobs) {
  std::set<Digest> here;
  for (const Digest& digest : missing_blobs) {
    const auto found = blobs_->find(digest);
    if (!found) break;  // the store is unavailable: this is tried again at the next lookup
    if (*found) here.insert(digest);
  }
  if (here.empty()) return;
  const std::lock_guard lock(mutex_);
  std::vector<EntryPtr> complete;
  for (const auto& [id, entry] : entries_) {
    auto& left = entry->stored.missing_blobs;
    if (std::erase_if(left, [&](const Digest& digest) { return here.contains(digest); }) > 0 && left.empty())
      complete.push_back(entry);
  }
  if (complete.empty()) return;
  (void)save_all_locked([&] {
    for (const EntryPtr& entry : complete) {
      log_info(fmt::format("job={}", entry->stored.id.value), "its files are here again");
      log_job(entry->stored.id, "its files are here again");
      if (auto resumed = become_locked(entry, JobState::running); !resumed)
        log_error(fmt::format("job={}", entry->stored.id.value), resumed.error().message);
    }
  });
}

}  // namespace ls::coordinator
