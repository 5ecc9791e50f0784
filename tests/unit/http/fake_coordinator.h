// A coordinator in memory: jobs with states, blobs, events. Enough to see what the HTTP door asks of it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/service/coordinator.h"

namespace ls::http::testing {

using namespace ls::coordinator;

class FakeBlobs final : public BlobStore {
 public:
  std::function<void()> before_look;  // at a blob
  bool has(const Digest& digest) const override {
    if (before_look) before_look();
    const std::lock_guard lock(mutex_);
    return blobs_.count(digest) > 0;
  }
  Result<std::uint64_t> size(const Digest& digest) const override {
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

  Digest add(std::string_view text) {
    const Digest digest = sha256(text);
    EXPECT_TRUE(put(digest, std::as_bytes(std::span(text))));
    return digest;
  }
  std::atomic<int> open_uploads{0};

 private:
  struct FakePart final : Upload {
    FakePart(FakeBlobs& o, const Digest& d) : owner(o), digest(d) {}
    Result<void> append(std::span<const std::byte> more) override {
      const std::lock_guard lock(owner.mutex_);
      auto& part = owner.parts_[digest];
      part.insert(part.end(), more.begin(), more.end());
      return {};
    }
    Result<void> finish() override { return owner.put(digest, std::exchange(owner.parts_[digest], {})); }
    FakeBlobs& owner;
    Digest digest;
  };
  struct FakeUpload final : Upload {
    FakeUpload(FakeBlobs& o, const Digest& d) : owner(o), digest(d) { ++owner.open_uploads; }
    ~FakeUpload() override { --owner.open_uploads; }
    Result<void> append(std::span<const std::byte> more) override {
      bytes.insert(bytes.end(), more.begin(), more.end());
      return {};
    }
    Result<void> finish() override { return owner.put(digest, bytes); }
    FakeBlobs& owner;
    Digest digest;
    std::vector<std::byte> bytes;
  };

  mutable std::mutex mutex_;
  std::map<Digest, std::vector<std::byte>> blobs_, parts_;
};

class FakeCoordinator final : public Coordinator {
 public:
  tl::expected<JobId, Rejected> submit(SubmitRequest request) override {
    if (request.scene_text.find("misspelt") != std::string::npos) {
      Diagnostic d;
      d.place = {request.scene_name, 14, 16};
      d.text = "medium has no parameter 'sigmat'; did you mean 'sigma_t'?";
      d.source_line = "misspelt \xff";  // not UTF-8
      return tl::unexpected(Rejected{{Errc::invalid_argument, "the scene has 1 error"}, {d}});
    }
    const std::lock_guard lock(mutex_);
    JobView job;
    job.id = JobId{"j-" + std::to_string(jobs_.size() + 1)};
    job.name = request.scene_name;
    job.owner = request.owner;
    job.spp = request.spec.spp.value_or(16);
    job.priority = request.spec.priority;
    job.warnings = {"'strict_normals' means nothing here"};
    jobs_[job.id] = job;
    last_request = std::move(request);
    return job.id;
  }
  std::vector<JobView> jobs() const override {
    const std::lock_guard lock(mutex_);
    std::vector<JobView> all;
    for (const auto& [id, job] : jobs_) all.push_back(job);
    return all;
  }
  Result<JobView> job(const JobId& id) const override {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return fail(Errc::not_found, "there is no job '" + id.value + "'");
    return found->second;
  }
  Result<void> change(const JobId& id, const JobChange& wanted) override {
    return change(id, [&](JobView& job) {
      if (wanted.state) job.state = *wanted.state;
      if (wanted.priority) job.priority = *wanted.priority;
      if (wanted.spp) job.spp = *wanted.spp;
      if (wanted.target_error) job.target_error = *wanted.target_error;
    });
  }
  Result<void> remove(const JobId& id) override {
    {
      const std::lock_guard lock(mutex_);
      const auto found = jobs_.find(id);
      if (found != jobs_.end() && found->second.state == JobState::cancelled)
        return jobs_.erase(id), Result<void>{};
    }
    return set_state(id, JobState::cancelled);
  }
  Result<void> cancel(const JobId& id) override { return set_state(id, JobState::cancelled); }
  Result<std::vector<std::byte>> image_exr(const JobId& id) const override {
    if (auto found = job(id); !found) return tl::unexpected(found.error());
    return std::vector<std::byte>(exr_bytes, std::byte{7});
  }
  Result<std::vector<std::byte>> image_png(const JobId& id, double exposure, bool denoised) const override {
    if (auto found = job(id); !found) return tl::unexpected(found.error());
    if (slow_image != nullptr) slow_image(exposure);
    return std::vector<std::byte>(static_cast<std::size_t>(10 + exposure), std::byte{1});
  }
  Result<std::vector<std::byte>> error_png(const JobId& id) const override { return image_png(id, 1, false); }
  Result<std::vector<std::byte>> samples_png(const JobId& id) const override {
    return image_png(id, 2, false);
  }
  Result<std::string> report_json(const JobId& id) const override { return text_of(id, "{\"spp\":16}"); }
  Result<std::vector<ConvergencePoint>> convergence(const JobId& id) const override {
    if (auto found = job(id); !found) return tl::unexpected(found.error());
    return std::vector<ConvergencePoint>(2);
  }
  Result<std::vector<TileView>> tiles(const JobId& id) const override {
    if (auto found = job(id); !found) return tl::unexpected(found.error());
    return std::vector<TileView>(3);
  }
  Result<std::string> job_log(const JobId& id) const override { return text_of(id, "submitted\n"); }
  Result<std::string> owner(const JobId& id) const override {
    const auto found = job(id);
    if (!found) return tl::unexpected(found.error());
    return found->owner;
  }
  Result<void> wait(const JobId&) const override { return {}; }

  std::vector<WorkerView> workers() const override { return std::vector<WorkerView>(2); }
  Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello&, std::shared_ptr<WorkerSink>) override {
    return fail(Errc::unavailable, "no workers here");
  }

  std::shared_ptr<void> subscribe(std::uint64_t after_id,
                                  std::function<void(const StreamEvent&)> on_event) override {
    const std::lock_guard lock(mutex_);
    for (const auto& event : kept_)
      if (event.id > after_id) on_event(event);
    const int key = next_reader_++;
    readers_[key] = std::move(on_event);
    return std::shared_ptr<void>(nullptr, [this, key](void*) {
      const std::lock_guard guard(mutex_);
      readers_.erase(key);
    });
  }
  std::uint64_t last_event_id() const override {
    const std::lock_guard lock(mutex_);
    return last_event_;
  }
  void tell(std::string type, std::string data, std::string job = {}) {
    const std::lock_guard lock(mutex_);
    StreamEvent event{++last_event_, std::move(type), std::move(data), std::move(job)};
    for (auto& [key, reader] : readers_) reader(event);
    kept_.push_back(std::move(event));
    if (kept_.size() > 100) kept_.erase(kept_.begin());
  }
  // As if that many events had gone by unseen.
  void miss_events(std::uint64_t count) {
    const std::lock_guard lock(mutex_);
    last_event_ += count;
  }
  std::size_t readers() const {
    const std::lock_guard lock(mutex_);
    return readers_.size();
  }

  BlobStore& blobs() override { return store; }
  Result<std::optional<JobLocation>> locate_job(const JobId& id) override {
    if (before_asking_others) before_asking_others();
    const auto found = others.find(id.value);
    return found == others.end() ? std::nullopt : std::optional(found->second);
  }
  std::map<std::string, JobLocation> others;  // jobs that other coordinators have
  std::function<void()> before_asking_others;
  std::filesystem::path final_file(const JobId&, const std::string& name) const override {
    return files.empty() ? files : files / name;
  }
  std::filesystem::path files;  // of jobs that are done
  bool ready(std::string* why_not) const override {
    if (!is_ready) *why_not = "the store is being read";
    return is_ready;
  }
  void tick() override {}
  void collect() override {}
  void blob_missing(const Digest&, const Error&) override {}
  void blob_sent(std::uint64_t) override {}
  void announce(const std::string&, const std::string&) override {}
  StoreStatus store_status() const override { return {}; }
  AuditFigures audits() const override { return {}; }
  FarmFigures figures() const override { return {}; }

  FakeBlobs store;
  SubmitRequest last_request;
  std::size_t exr_bytes = 100;
  std::atomic<bool> is_ready{true};
  std::function<void(double)> slow_image;

 private:
  template <class Change>
  Result<void> change(const JobId& id, Change apply) {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found == jobs_.end()) return fail(Errc::not_found, "there is no job '" + id.value + "'");
    if (found->second.state == JobState::cancelled)
      return fail(Errc::failed_precondition, "the job is cancelled");
    apply(found->second);
    return {};
  }
  Result<void> set_state(const JobId& id, JobState state) {
    return change(id, [=](JobView& job) { job.state = state; });
  }
  Result<std::string> text_of(const JobId& id, std::string text) const {
    if (auto found = job(id); !found) return tl::unexpected(found.error());
    return text;
  }

  mutable std::recursive_mutex mutex_;  // who is told of an event may ask what there is
  std::map<JobId, JobView> jobs_;
  std::vector<StreamEvent> kept_;
  std::map<int, std::function<void(const StreamEvent&)>> readers_;
  int next_reader_ = 0;
  std::uint64_t last_event_ = 0;
};

}  // namespace ls::http::testing
