// The coordinator without sockets: domain (the farm, which decides what is rendered where), store and
// assembler behind one thread-safe object. rpc/ and http/ put it on the network; `lightshaft render` uses it
// in process.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "coordinator/domain/farm_figures.h"
#include "coordinator/domain/figures.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/views/job_view.h"
#include "coordinator/views/submit_request.h"
#include "coordinator/views/worker_session.h"

namespace ls::coordinator {

class Coordinator {
 public:
  struct Options {
    std::filesystem::path data;  // empty: everything is in memory and nothing survives (`lightshaft render`)
    // Where jobs are stored: sqlite, or a redis:// address (store/redis/redis_link.h)
    std::string store = "sqlite";
    std::shared_ptr<JobStore> jobs;    // set by tests; null: opened as `store` says
    std::shared_ptr<BlobStore> blobs;  // set for in-memory use; null: opened as `blobs_at` says
    // Where blobs are: empty for a folder under `data`; else a folder, or an s3:// address
    std::string blobs_at;
    // How long a blob (file of a scene) is kept that no job needs and nobody requests, and an interrupted
    // upload that does not grow. nullopt: blobs are kept for good, interrupted uploads for a day.
    std::optional<Duration> keep_unused = std::chrono::hours(24);
    bool shared = false;      // other coordinators use the same store and blobs
    std::string join_token;   // empty: any worker may join
    JoinCheck may_join;       // if set, decides which workers may join, instead of join_token
    bool allow_fake = false;  // true: workers that make up their pixels may join (for tests)
    ShareLimits limits;
    double audit_rate = 0.01;  // fraction of the results that another worker renders again
    std::shared_ptr<const Clock> clock;
    int denoise_threads = 0;  // 0: one per core that this process may use
    std::string denoiser;     // library of Open Image Denoise; empty: it is looked for
    // Time between two Tick events, which a thread of the coordinator raises. nullopt: there is no such
    // thread, and the caller calls tick()
    std::optional<Duration> tick;
  };
  static Result<std::unique_ptr<Coordinator>> open(Options options);
  ~Coordinator();

  // Jobs

  // If spec.frames is set, the job is a sequence (a job with frames), and the returned id is the sequence's.
  // Functions that change or show a job also accept a sequence's id; functions on a single image need the id
  // of a frame, which frame_job() gives.
  tl::expected<JobId, Rejected> submit(SubmitRequest request);
  std::vector<JobView> jobs() const;  // a sequence counts as one job; its frames are not listed
  Result<JobView> job(const JobId& id) const;
  Result<std::string> owner(const JobId& id) const;  // JobView::owner, at less cost than job()
  Result<void> change(const JobId& id, const JobChange& change);
  Result<void> cancel(const JobId& id);
  // Removes an ended job with all its results; a job that has not ended is cancelled and kept.
  Result<void> remove(const JobId& id);
  Result<void> wait(const JobId& id) const;  // returns when the job is done, failed or cancelled

  // Images and reports

  // The current image, or the final one
  Result<std::vector<std::byte>> image_exr(const JobId& id) const;
  // As an 8-bit picture; with `denoised`, of a job with JobSpec::denoise, the denoised image, also of a job
  // that still renders. One image is denoised at a time, which takes seconds.
  Result<std::vector<std::byte>> image_png(const JobId& id, double exposure, bool denoised = false) const;
  // False-colour maps of the error and of the samples (common/image/exr/maps.h).
  Result<std::vector<std::byte>> error_png(const JobId& id) const;
  Result<std::vector<std::byte>> samples_png(const JobId& id) const;
  Result<std::string> report_json(const JobId& id) const;
  Result<std::vector<ConvergencePoint>> convergence(const JobId& id) const;
  // Returns the path of the file `name` (image.exr or report.json) of a done job. Empty if there is no such
  // file: then use the functions above.
  std::filesystem::path final_file(const JobId& id, const std::string& name) const;
  Result<std::vector<TileView>> tiles(const JobId& id) const;
  Result<std::string> job_log(const JobId& id) const;

  // Workers

  std::vector<WorkerView> workers() const;
  Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello& hello, std::shared_ptr<WorkerSink> sink);

  // Events

  // Calls `on_event` (on any thread, in order) for every event after `after_id` that is still kept, then for
  // new ones. The subscription ends when the returned handle is destroyed. A reader that cannot keep up must
  // itself drop events.
  std::shared_ptr<void> subscribe(std::uint64_t after_id, std::function<void(const StreamEvent&)> on_event);
  std::uint64_t last_event_id() const;

  // Blobs

  BlobStore& blobs();
  // Says that a worker requested a blob that is missing or damaged here. The jobs that need it are paused
  // until it is available again.
  void blob_missing(const Digest& digest, const Error& why);
  void blob_sent(std::uint64_t bytes);  // counts bytes sent to a worker
  // Removes blobs that no job needs, and interrupted uploads, after Options::keep_unused. With Options::tick
  // the coordinator calls this itself.
  void collect();

  // Other coordinators (Options::shared)

  // Tells the other coordinators, workers and clients where they reach this one: http://HOST:PORT and
  // HOST:PORT (gRPC).
  void announce(const std::string& http, const std::string& grpc);
  // Finds the coordinator of a job that this one does not have; may block for a second. nullopt: none has it.
  Result<std::optional<JobLocation>> locate_job(const JobId& id);

  bool ready(std::string* why_not) const;
  StoreStatus store_status() const;
  AuditFigures audits() const;
  FarmFigures figures() const;
  void tick();

 private:
  struct Parts;
  explicit Coordinator(std::unique_ptr<Parts> parts);
  const std::unique_ptr<Parts> parts_;
};

}  // namespace ls::coordinator
