// BlobWatch: pauses jobs whose blobs (files of scenes) are missing, resumes them when the blobs are there
// again, and removes blobs that no job needs.
#include "coordinator/service/blob_watch.h"

#include <fmt/format.h>

#include <algorithm>

#include "coordinator/base/limits.h"
#include "coordinator/base/work_queue.h"
#include "coordinator/service/core.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

constexpr Duration kLongestPause = std::chrono::hours(1);
// The coordinator searches for unused blobs this many times within the time keep_unused. So an unused blob is
// removed at the latest 1.25 * keep_unused after its last use.
constexpr int kSweepsPerTime = 4;
// The blobs that jobs need are listed for this many jobs at a time; between two such groups the lock is
// released, so that other threads can take it.
constexpr std::size_t kJobsAtOnce = 256;

std::optional<BlobRef> file_of(const StoredJob& job, const Digest& digest) {
  if (job.scene == digest) return BlobRef{digest, 0, scene_file_of(job)};
  const auto asset = std::find_if(job.assets.begin(), job.assets.end(),
                                  [&](const BlobRef& a) { return a.digest == digest; });
  return asset == job.assets.end() ? std::nullopt : std::optional(*asset);
}

// Returns a text that tells the user how to provide the missing file or scene. A file can be uploaded; a
// scene must be submitted again, since only a submission converts it to the format in which it is stored.
std::string what_to_do(const StoredJob& job, const BlobRef& file, bool damaged) {
  const bool scene = file.digest == job.scene;
  return fmt::format(
      "it waits for its {} '{}', whose blob {} {}: {}submit the same scene again with `lightshaft submit`, "
      "and this job continues automatically",
      scene ? "scene" : "file", file.name, file.digest.hex(), damaged ? "was damaged here" : "is not here",
      scene ? "" : fmt::format("upload the file again (PUT /api/v1/blobs/{}), or ", file.digest.hex()));
}

bool is_open(JobState state) { return state == JobState::queued || state == JobState::running; }

}  // namespace

Result<std::vector<BlobRef>> missing_blobs_of(const StoredJob& job, const BlobStore& blobs) {
  std::vector<BlobRef> files = job.assets;
  files.push_back({job.scene, 0, scene_file_of(job)});
  std::vector<Digest> digests;
  for (const BlobRef& file : files) digests.push_back(file.digest);
  const auto lacking = blobs.missing(digests);
  if (!lacking) return tl::unexpected(lacking.error());
  const std::set<Digest> missing(lacking->begin(), lacking->end());
  std::erase_if(files, [&](const BlobRef& file) { return !missing.contains(file.digest); });
  return files;
}

void await_blob(Core& core, JobEntry& entry, const BlobRef& file, bool damaged) {
  entry.stored.missing_blobs.insert(file.digest);
  entry.trouble = what_to_do(entry.stored, file, damaged);
  log_error(fmt::format("job={}", entry.stored.id.value), entry.trouble);
  core.records.log(entry.stored.id, entry.trouble);
}

void BlobWatch::missing(const Digest& digest, const Error& why) {
  const auto core = core_.lock();
  std::vector<EntryPtr> waiting;
  for (const auto& [id, entry] : core->jobs.all()) {
    const StoredJob& job = entry->stored;
    const bool waits = !job.missing_blobs.empty() && !job.missing_blobs.contains(digest);
    if (!entry->unloaded && !entry->finishing && (waits || is_open(job.state)) && file_of(job, digest))
      waiting.push_back(entry);
  }
  if (waiting.empty()) return;
  log_error("blob=" + digest.hex(), why.message);
  core->records.put_together([&] {
    for (const EntryPtr& entry : waiting) {
      core->records.log(entry->stored.id, why.message);
      await_blob(*core, *entry, *file_of(entry->stored, digest), why.code == Errc::failed_precondition);
      if (is_open(entry->stored.state)) core->driver.run(JobPaused{entry->stored.id});
      core->records.put(entry);
      core->publisher.job(*entry);
    }
  });
}

void BlobWatch::look_if_due(Core& core) {
  if (clock_.now() - last_look_ < limits::kMissingBlobLook || looks_.size() > 0) return;
  std::set<Digest> digests;
  for (const auto& [id, entry] : core.jobs.all())
    digests.insert(entry->stored.missing_blobs.begin(), entry->stored.missing_blobs.end());
  if (digests.empty()) return;
  last_look_ = clock_.now();
  looks_.push(std::move(digests));
}

void BlobWatch::look_loop(const std::stop_token& token) {
  while (!token.stop_requested())
    for (const auto& digests : looks_.pop(1, token)) look_for(digests);
}

void BlobWatch::look_for(const std::set<Digest>& digests) {
  const auto lacking = blobs_.missing(std::vector(digests.begin(), digests.end()));
  if (!lacking) return;  // the store is unavailable: the lookup is repeated when it is due again
  std::set<Digest> here = digests;
  for (const Digest& digest : *lacking) here.erase(digest);
  if (here.empty()) return;
  const auto core = core_.lock();
  std::vector<EntryPtr> complete;
  for (const auto& [id, entry] : core->jobs.all()) {
    auto& missing = entry->stored.missing_blobs;
    const auto is_here = [&](const Digest& digest) { return here.contains(digest); };
    if (missing.empty()) continue;
    if (std::all_of(missing.begin(), missing.end(), is_here))
      complete.push_back(entry);
    else
      std::erase_if(missing, is_here);
  }
  if (complete.empty()) return;
  // Jobs that cannot be resumed keep their missing blobs, and are tried again at the next look.
  if (auto resumed = commands_.become(*core, complete, JobState::running); !resumed)
    log_error("", "jobs whose files are here again cannot be resumed: " + resumed.error().message);
  for (const EntryPtr& entry : complete) {
    if (!entry->stored.missing_blobs.empty()) continue;
    log_info(fmt::format("job={}", entry->stored.id.value), "its files are here again");
    core->records.log(entry->stored.id, "its files are here again");
  }
}

void BlobWatch::check_store() {
  const auto answer = blobs_.answers();
  const std::string trouble = answer ? "" : "the store of blobs does not answer: " + answer.error().message;
  const auto core = core_.lock();
  if (trouble.empty() != trouble_.empty())
    trouble.empty() ? log_info("", "the store of blobs answers again") : log_warn("", trouble);
  trouble_ = trouble;
}

// Returns the digests of all blobs that jobs need; nullopt: the record of some job is damaged, so it is
// unknown which blobs that job needs.
std::optional<std::set<Digest>> BlobWatch::needed_blobs() {
  std::vector<EntryPtr> entries;
  {
    const auto core = core_.lock();
    for (const auto& [id, entry] : core->jobs.all()) entries.push_back(entry);
  }
  std::set<Digest> needed;
  for (std::size_t i = 0; i < entries.size(); i += kJobsAtOnce) {
    const auto core = core_.lock();
    for (std::size_t k = i; k < std::min(entries.size(), i + kJobsAtOnce); ++k) {
      const StoredJob& job = entries[k]->stored;
      if (job.damaged) return std::nullopt;
      needed.insert(job.scene);
      for (const BlobRef& asset : job.assets) needed.insert(asset.digest);
      if (job.spec.reference) needed.insert(*job.spec.reference);
    }
  }
  return needed;
}

void BlobWatch::collect() {
  const auto needed = keep_unused_ ? needed_blobs() : std::nullopt;
  const auto swept = needed ? blobs_.sweep(*needed) : blobs_.sweep_unfinished();
  if (!swept) return log_warn("", "files that no job needs cannot be removed: " + swept.error().message);
  if (swept->blobs + swept->unfinished > 0)
    log_info("", fmt::format("{} files that no job needed and {} unfinished uploads are removed",
                             swept->blobs, swept->unfinished));
}

void BlobWatch::collect_loop(const std::stop_token& token) {
  const Duration pause = std::min(keep_unused_.value_or(kLongestPause) / kSweepsPerTime, kLongestPause);
  every(pause, token, [this] { collect(); });
}

}  // namespace ls::coordinator
