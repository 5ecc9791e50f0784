// A blob store that removes unused blobs: files of rejected bundles, of removed jobs, of interrupted uploads.
// A blob is removed when no job has needed it and no request has named it for the duration `keep`; an
// interrupted upload is removed when it has not grown for that long. Both durations start again when the
// coordinator is restarted. Thread-safe.
//
// A submission never loses its files: a request for a blob restarts the blob's duration, and waits if the
// blob is being removed. While in_use() is held nothing is removed.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>

#include "coordinator/store/blobs/blob_store.h"
#include "core/base/clock.h"

namespace ls::coordinator {

class CollectedBlobs final : public BlobStore {
 public:
  // Blobs that no job needs, and interrupted uploads, are removed after the duration `keep`. `keep` must be
  // nullopt if other coordinators use these blobs, too. Then no blob is ever removed, and interrupted uploads
  // are removed after a day.
  CollectedBlobs(std::shared_ptr<BlobStore> inner, std::shared_ptr<const Clock> clock,
                 std::optional<Duration> keep)
      : inner_(std::move(inner)), clock_(std::move(clock)), keep_(keep) {}

  struct Swept {
    std::uint64_t blobs = 0, unfinished = 0;  // number of removed blobs and of removed uploads
  };
  // Removes blobs and uploads that are unused for long enough and returns their numbers. `needed` must
  // contain every blob that a job names. Error: the store could not be listed, or something could not be
  // removed.
  Result<Swept> sweep(const std::set<Digest>& needed);
  Result<Swept> sweep_unfinished();
  // Hold this lock from a submission's first check for a blob until the new job counts as needing the blob.
  std::shared_lock<std::shared_mutex> in_use() const { return std::shared_lock(using_); }

  bool has(const Digest& digest) const override { return asked_for(digest).has(digest); }
  Result<bool> find(const Digest& digest) const override { return asked_for(digest).find(digest); }
  Result<std::vector<Digest>> missing(std::span<const Digest> digests) const override {
    for (const Digest& digest : digests) asked_for(digest);
    return inner_->missing(digests);
  }
  Result<void> answers() const override { return inner_->answers(); }
  Result<void> prove(const Digest& digest, bool again = false) const override {
    return asked_for(digest).prove(digest, again);
  }
  Result<std::uint64_t> size(const Digest& digest) const override { return asked_for(digest).size(digest); }
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override {
    return asked_for(digest).read(digest, offset, length);
  }
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override {
    return asked_for(digest).put(digest, bytes);
  }
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override {
    return asked_for(digest).begin_upload(digest);
  }
  std::uint64_t received(const Digest& digest) const override { return inner_->received(digest); }
  Result<std::unique_ptr<Upload>> resume_upload(const Digest& digest, std::uint64_t offset) override {
    return asked_for(digest).resume_upload(digest, offset);
  }
  Result<std::vector<Digest>> list(bool unfinished) const override { return inner_->list(unfinished); }
  Result<void> remove(const Digest& digest) override { return inner_->remove(digest); }
  void remove_unfinished(const Digest& digest) override { inner_->remove_unfinished(digest); }

 private:
  struct Unfinished {
    std::uint64_t bytes = 0;
    TimePoint since{};
  };
  // Restarts the blob's duration, since the blob is requested. If the blob is being removed, waits until it
  // is removed. Returns the inner store.
  BlobStore& asked_for(const Digest& digest) const;
  std::vector<Digest> idle_for_long(const std::vector<Digest>& there, const std::set<Digest>& needed);
  std::uint64_t sweep_unfinished(const std::vector<Digest>& there);

  std::shared_ptr<BlobStore> inner_;
  std::shared_ptr<const Clock> clock_;
  std::optional<Duration> keep_;
  mutable std::shared_mutex using_;
  mutable std::mutex mutex_;
  mutable std::condition_variable gone_;
  // Blobs that are being removed, which may take a while. A request for such a blob waits until the blob is
  // removed.
  std::set<Digest> going_;
  mutable std::map<Digest, TimePoint> idle_;  // blobs that no job needs, and when each became unused
  std::map<Digest, Unfinished> unfinished_;   // interrupted uploads; used only by sweep_unfinished()
};

}  // namespace ls::coordinator
