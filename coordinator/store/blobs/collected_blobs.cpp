#include "coordinator/store/blobs/collected_blobs.h"

#include <utility>

namespace ls::coordinator {
namespace {
constexpr Duration kKeepUnfinished = std::chrono::hours(24);
}

BlobStore& CollectedBlobs::asked_for(const Digest& digest) const {
  std::unique_lock lock(mutex_);
  gone_.wait(lock, [&] { return !going_.contains(digest); });
  idle_.erase(digest);
  return *inner_;
}

Result<CollectedBlobs::Swept> CollectedBlobs::sweep_unfinished() {
  const auto unfinished = inner_->list(true);
  if (!unfinished) return tl::unexpected(unfinished.error());
  return Swept{0, sweep_unfinished(*unfinished)};
}

Result<CollectedBlobs::Swept> CollectedBlobs::sweep(const std::set<Digest>& needed) {
  auto swept = sweep_unfinished();
  if (!swept || !keep_) return swept;
  const auto blobs = inner_->list(false);
  if (!blobs) return tl::unexpected(blobs.error());
  for (const Digest& digest : idle_for_long(*blobs, needed)) {
    {
      const std::unique_lock nobody(using_, std::try_to_lock);
      if (!nobody) break;  // a submission is in progress; the remaining blobs wait for the next sweep
      const std::lock_guard lock(mutex_);
      if (idle_.erase(digest) == 0) continue;  // the blob was requested just now, so it stays
      going_.insert(digest);
    }
    const auto removed = inner_->remove(digest);
    {
      const std::lock_guard lock(mutex_);
      going_.erase(digest);
    }
    gone_.notify_all();
    if (!removed) return tl::unexpected(removed.error());
    ++swept->blobs;
  }
  return swept;
}

std::vector<Digest> CollectedBlobs::idle_for_long(const std::vector<Digest>& there,
                                                  const std::set<Digest>& needed) {
  const TimePoint now = clock_->now();
  const std::lock_guard lock(mutex_);
  std::map<Digest, TimePoint> before = std::exchange(idle_, {});
  std::vector<Digest> old;
  for (const Digest& digest : there) {
    if (needed.contains(digest)) continue;
    const auto known = before.find(digest);
    const TimePoint since = known == before.end() ? now : known->second;
    idle_.emplace(digest, since);
    if (now - since >= *keep_) old.push_back(digest);
  }
  return old;
}

std::uint64_t CollectedBlobs::sweep_unfinished(const std::vector<Digest>& there) {
  const TimePoint now = clock_->now();
  std::map<Digest, Unfinished> before = std::exchange(unfinished_, {});
  std::uint64_t removed = 0;
  for (const Digest& digest : there) {
    Unfinished one{inner_->received(digest), now};
    if (const auto known = before.find(digest); known != before.end() && known->second.bytes == one.bytes)
      one.since = known->second.since;
    if (now - one.since >= keep_.value_or(kKeepUnfinished)) {
      inner_->remove_unfinished(digest);
      ++removed;
    } else {
      unfinished_.emplace(digest, one);
    }
  }
  return removed;
}

}  // namespace ls::coordinator
