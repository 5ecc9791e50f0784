// Stores in memory for a coordinator under test. A test can observe their calls and delay them.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/store/blobs/blob_store.h"
#include "tests/unit/service/moving_store.h"

namespace ls::http::testing {

using namespace ls::coordinator;

class WatchedBlobs final : public BlobStore {
 public:
  std::function<void()> before_look;  // called before a blob is looked up
  bool has(const Digest& digest) const override {
    if (before_look) before_look();
    const std::lock_guard lock(mutex_);
    return blobs_.count(digest) > 0;
  }
  Result<std::uint64_t> size(const Digest& digest) const override {
    if (before_look) before_look();
    const std::lock_guard lock(mutex_);
    const auto found = blobs_.find(digest);
    if (found == blobs_.end()) return fail(Errc::not_found, "no such blob");
    return found->second.size();
  }
  Result<std::vector<std::byte>> read(const Digest& digest, std::uint64_t offset,
                                      std::uint64_t length) const override {
    const std::lock_guard lock(mutex_);
    const auto found = blobs_.find(digest);
    if (found == blobs_.end()) return fail(Errc::not_found, "no such blob");
    const auto begin = found->second.begin() + static_cast<std::ptrdiff_t>(offset);
    return std::vector<std::byte>(begin, begin + static_cast<std::ptrdiff_t>(length));
  }
  Result<void> put(const Digest& digest, std::span<const std::byte> bytes) override {
    if (sha256(bytes) != digest) return fail(Errc::invalid_argument, "the digest of the bytes is another");
    const std::lock_guard lock(mutex_);
    blobs_[digest].assign(bytes.begin(), bytes.end());
    return {};
  }
  Result<std::unique_ptr<Upload>> begin_upload(const Digest& digest) override {
    return std::make_unique<FakeUpload>(*this, digest);
  }

  std::uint64_t received(const Digest& digest) const override {
    const std::lock_guard lock(mutex_);
    const auto found = parts_.find(digest);
    return found == parts_.end() ? 0 : found->second.size();
  }
  Result<std::unique_ptr<Upload>> resume_upload(const Digest& digest, std::uint64_t offset) override {
    if (offset != received(digest)) return fail(Errc::failed_precondition, "go on where the bytes end");
    return std::make_unique<FakePart>(*this, digest);
  }

  void remove_unfinished(const Digest& digest) override {
    const std::lock_guard lock(mutex_);
    parts_.erase(digest);
  }

  Digest add(std::string_view text) {
    const Digest digest = sha256(text);
    EXPECT_TRUE(put(digest, std::as_bytes(std::span(text))));
    return digest;
  }
  std::atomic<int> open_uploads{0};

 private:
  struct FakePart final : Upload {
    FakePart(WatchedBlobs& o, const Digest& d) : owner(o), digest(d) {}
    Result<void> append(std::span<const std::byte> more) override {
      const std::lock_guard lock(owner.mutex_);
      auto& part = owner.parts_[digest];
      part.insert(part.end(), more.begin(), more.end());
      return {};
    }
    Result<void> finish() override { return owner.put(digest, std::exchange(owner.parts_[digest], {})); }
    WatchedBlobs& owner;
    Digest digest;
  };
  struct FakeUpload final : Upload {
    FakeUpload(WatchedBlobs& o, const Digest& d) : owner(o), digest(d) { ++owner.open_uploads; }
    ~FakeUpload() override { --owner.open_uploads; }
    Result<void> append(std::span<const std::byte> more) override {
      bytes.insert(bytes.end(), more.begin(), more.end());
      return {};
    }
    Result<void> finish() override { return owner.put(digest, bytes); }
    WatchedBlobs& owner;
    Digest digest;
    std::vector<std::byte> bytes;
  };

  mutable std::mutex mutex_;
  std::map<Digest, std::vector<std::byte>> blobs_, parts_;
};

// Stores records in memory and remembers the last job that was put. A test can delay its calls or make them
// fail.
class WatchedRecords final : public MovingStore {
 public:
  std::map<std::string, JobLocation> others;  // owners of jobs that other coordinators have
  std::function<void()> before_asking_others;
  std::atomic<bool> refuses{false};  // true: storing a job fails
  std::size_t log_bytes = 0;         // if not 0, the log of each job is a line of that many bytes

  StoredJob last_job() const {
    const std::lock_guard lock(last_mutex_);
    return last_job_;
  }
  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    if (refuses) return fail(Errc::resource_exhausted, "the disk is full");
    const std::lock_guard lock(last_mutex_);
    if (!jobs.empty()) last_job_ = jobs.back();
    return MovingStore::put_jobs(jobs);
  }
  Result<std::vector<LogLine>> log(const JobId& job) const override {
    if (log_bytes == 0) return MovingStore::log(job);
    return std::vector<LogLine>{{0, std::string(log_bytes, 'x')}};
  }
  Result<std::optional<JobLocation>> locate_job(const JobId& id) override {
    if (before_asking_others) before_asking_others();
    const auto found = others.find(id.value);
    return found == others.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  mutable std::mutex last_mutex_;
  StoredJob last_job_;
};

}  // namespace ls::http::testing
