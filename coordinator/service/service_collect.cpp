// Finds out which blobs (files of scenes) jobs need, and decides when the others are removed
// (store/blobs/collected_blobs.h).
#include <fmt/format.h>

#include <algorithm>

#include "common/base/log.h"
#include "coordinator/base/periodic.h"
#include "coordinator/service/service_impl.h"

namespace ls::coordinator {
namespace {
constexpr Duration kLongestPause = std::chrono::hours(1);
constexpr int kSweepsPerTime = 4;  // sweeps per keep_unused: so no blob stays longer than 1.25 times that
constexpr std::size_t kJobsAtOnce = 256;  // jobs whose blobs are collected under one lock
}  // namespace

// Returns the digests of all blobs that jobs need. nullopt: the files of some job are unknown, because its
// record is damaged.
std::optional<std::set<Digest>> Service::needed_blobs() const {
  std::vector<EntryPtr> entries;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, entry] : entries_) entries.push_back(entry);
  }
  std::set<Digest> needed;
  for (std::size_t i = 0; i < entries.size(); i += kJobsAtOnce) {
    const std::lock_guard lock(mutex_);
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

void Service::collect() {
  const auto needed = options_.keep_unused ? needed_blobs() : std::nullopt;
  const auto swept = needed ? blobs_->sweep(*needed) : blobs_->sweep_unfinished();
  if (!swept) return log_warn("", "files that no job needs cannot be removed: " + swept.error().message);
  if (swept->blobs + swept->unfinished > 0)
    log_info("", fmt::format("{} files that no job needed and {} unfinished uploads are removed",
                             swept->blobs, swept->unfinished));
}

void Service::collect_loop(const std::stop_token& token) {
  const Duration pause =
      std::min(options_.keep_unused.value_or(kLongestPause) / kSweepsPerTime, kLongestPause);
  every(pause, token, [this] { collect(); });
}

}  // namespace ls::coordinator
