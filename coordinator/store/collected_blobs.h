// A blob store that forgets what no job needs: files of bundles that were refused, of jobs that were removed,
// of uploads that nobody went on with. A blob goes when it was needed by no job, and nobody asked for it, for
// `keep`; an unfinished upload, when it did not grow for so long. Both are counted while the coordinator
// runs: a restart begins again. Thread-safe.
//
// Why a submission never loses its files: whoever asks whether a blob is there starts its time anew, in the
// same step as a removal would be; and while in_use() is held nothing is removed.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <shared_mutex>

#include "common/base/clock.h"
#include "coordinator/service.h"

namespace ls::coordinator {

class CollectedBlobs final : public BlobStore {
 public:
  // keep: nothing: blobs stay for good, and unfinished uploads, which are this coordinator's alone, for a
  // day.
  CollectedBlobs(std::shared_ptr<BlobStore> inner, std::shared_ptr<const Clock> clock,
                 std::optional<Duration> keep)
      : inner_(std::move(inner)), clock_(std::move(clock)), keep_(keep) {}

  struct Swept {
    std::uint64_t blobs = 0, unfinished = 0;  // removed
  };
  // `needed`: every blob that a job names. An error: the store could not be listed, or something not be
  // removed.
  Result<Swept> sweep(const std::set<Digest>& needed);
  Result<Swept> sweep_unfinished();
  // Held from a submission's first look at a blob until its job counts as one that needs it.
  std::shared_lock<std::shared_mutex> in_use() const { return std::shared_lock(using_); }

  bool has(const Digest& digest) const override;
  Result<bool> find(const Digest& digest) const override;
  Result<void> answers() const override { return inner_->answers(); }
  Result<void> prove(const Digest& digest, bool again = false) const override;
  Result<std::uint64_t> size(const Digest& digest) const override;
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override;
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override;
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override;
  std::uint64_t received(const Digest& digest) const override { return inner_->received(digest); }
  Result<std::unique_ptr<Upload>> resume_upload(const Digest& digest, std::uint64_t offset) override;
  Result<std::vector<Digest>> list(bool unfinished) const override { return inner_->list(unfinished); }
  Result<void> remove(const Digest& digest) override { return inner_->remove(digest); }
  void remove_unfinished(const Digest& digest) override { inner_->remove_unfinished(digest); }

 private:
  struct Unfinished {
    std::uint64_t bytes = 0;
    TimePoint since{};
  };
  void asked_for(const Digest& digest) const;
  std::vector<Digest> idle_for_long(const std::vector<Digest>& there, const std::set<Digest>& needed);
  std::uint64_t sweep_unfinished(const std::vector<Digest>& there);

  std::shared_ptr<BlobStore> inner_;
  std::shared_ptr<const Clock> clock_;
  std::optional<Duration> keep_;
  mutable std::shared_mutex using_;
  mutable std::mutex mutex_;
  mutable std::condition_variable gone_;
  std::set<Digest> going_;  // being removed, which may take a while: who asks for one of them waits
  mutable std::map<Digest, TimePoint> idle_;  // blobs that no job needs, since when as far as we know
  std::map<Digest, Unfinished> unfinished_;   // the sweeper's alone
};

}  // namespace ls::coordinator
