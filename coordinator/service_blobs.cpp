// Jobs that wait for a file: its blob is missing or damaged here. They are paused, which costs no unit and no
// worker anything, and go on by themselves when the blob is here again, however it came.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/log.h"
#include "coordinator/service_impl.h"

namespace ls::coordinator {
namespace {

std::optional<BlobRef> file_of(const StoredJob& job, const Digest& digest) {
  if (job.scene == digest) return BlobRef{digest, 0, job.name};
  const auto asset = std::find_if(job.assets.begin(), job.assets.end(),
                                  [&](const BlobRef& a) { return a.digest == digest; });
  return asset == job.assets.end() ? std::nullopt : std::optional(*asset);
}

// What a user can send again: the scene is kept in a form of our own, which only a submission makes.
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

Result<std::vector<BlobRef>> Service::lacking(const StoredJob& job) const {
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
  entry.stored.awaited.insert(file.digest);
  entry.trouble = what_to_do(entry.stored, file, damaged);
  log_error(fmt::format("job={}", entry.stored.id.value), entry.trouble);
  log_job(entry.stored.id, entry.trouble);
}

void Service::blob_lacking(const Digest& digest, const Error& why) {
  const std::lock_guard lock(mutex_);
  std::vector<EntryPtr> waiting;
  for (const auto& [id, entry] : entries_) {
    const bool waits = !entry->stored.awaited.empty() && !entry->stored.awaited.contains(digest);
    if (!entry->dormant && !entry->finishing && (waits || is_open(shown_state(*entry))) &&
        file_of(entry->stored, digest))
      waiting.push_back(entry);
  }
  if (waiting.empty()) return;
  (void)save_together_locked([&] {  // what cannot be stored is known again at the next start
    for (const EntryPtr& entry : waiting) {
      log_job(entry->stored.id, why.message);
      await_locked(*entry, *file_of(entry->stored, digest), why.code == Errc::failed_precondition);
      if (is_open(shown_state(*entry))) run_locked(JobPaused{entry->stored.id});
      persist_locked(*entry);
      publish_job_locked(*entry);
    }
  });
}

// Under the lock only their names are collected: whether they are here may take a network to tell.
void Service::look_for_awaited_locked() {
  if (now() - last_look_ < limits::kAwaitedLook || looks_.size() > 0) return;
  std::set<Digest> awaited;
  for (const auto& [id, entry] : entries_)
    awaited.insert(entry->stored.awaited.begin(), entry->stored.awaited.end());
  if (awaited.empty()) return;
  last_look_ = now();
  looks_.push(std::move(awaited));
}

void Service::look_for(const std::set<Digest>& awaited) {
  std::set<Digest> here;
  for (const Digest& digest : awaited) {
    const auto found = blobs_->find(digest);
    if (!found) break;  // the store is away: the next look
    if (*found) here.insert(digest);
  }
  if (here.empty()) return;
  const std::lock_guard lock(mutex_);
  std::vector<EntryPtr> complete;
  for (const auto& [id, entry] : entries_) {
    auto& left = entry->stored.awaited;
    if (std::erase_if(left, [&](const Digest& digest) { return here.contains(digest); }) > 0 && left.empty())
      complete.push_back(entry);
  }
  if (complete.empty()) return;
  (void)save_together_locked([&] {
    for (const EntryPtr& entry : complete) {
      log_info(fmt::format("job={}", entry->stored.id.value), "its files are here again");
      log_job(entry->stored.id, "its files are here again");
      if (auto resumed = become_locked(entry, JobState::running); !resumed)
        log_error(fmt::format("job={}", entry->stored.id.value), resumed.error().message);
    }
  });
}

}  // namespace ls::coordinator
