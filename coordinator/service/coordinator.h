// The coordinator without its network interfaces: one thread-safe object that contains the farm, the job
// store and the assembler of images. rpc/ and http/ serve it over the network; `lightshaft render` calls it
// in its own process. Terms: docs/reference/glossary.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/domain/farm_figures.h"
#include "coordinator/store/blobs/blob_store.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/views/views.h"
#include "coordinator/views/worker_session.h"
#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/light/light_mix.h"
#include "util/display/display_views.h"
#include "util/reading/scene_process.h"
#include "util/trace/tracer.h"

namespace ls::coordinator {

class Coordinator {
 public:
  struct Options {
    // The data folder. Empty: everything is in memory and is lost at the end (`lightshaft render`).
    std::filesystem::path data;
    // Where jobs are stored: sqlite, or a redis:// address (store/redis/redis_link.h)
    std::string store = "sqlite";
    std::shared_ptr<JobStore> jobs;    // the job store, set by tests; null: opened as `store` says
    std::shared_ptr<BlobStore> blobs;  // the blob store, set if it is in memory; null: opened at `blobs_at`
    // Where blobs are stored: a folder or an s3:// address; empty: a folder under `data`
    std::string blobs_at;
    // How long to keep a blob (file of a scene) that no job needs and nobody requests, and an interrupted
    // upload that is not continued. nullopt: blobs are kept forever, interrupted uploads for a day.
    std::optional<Duration> keep_unused = std::chrono::hours(24);
    bool shared = false;     // true: other coordinators use the same job store and blob store
    std::string join_token;  // the token that a worker needs to join; empty: any worker may join
    JoinCheck may_join;      // if set, it decides which workers may join, and join_token is not used
    // With this secret, which no worker knows, workers prove after a restart, or at another coordinator that
    // has it too, that an id is theirs. Empty: a random one, so that all workers get new ids
    std::string worker_key;
    bool allow_fake = false;  // true: fake workers, which invent their pixels, may join (for tests)
    // Version of this program. Workers of another version finish the jobs of their numeric class but begin
    // none, so that jobs submitted during an upgrade do not depend on workers that will stop soon. Empty: any
    // worker begins jobs.
    std::string version;
    ShareLimits limits;
    double audit_rate = 0.01;  // fraction of the results that are audited: another worker renders them again
    std::shared_ptr<const Clock> clock;
    OpenReader scenes = scenes_by_processes();  // what reads the scenes of submissions
    int denoise_threads = 0;                    // 0: one per core that this process may use
    std::string denoiser;  // file of the library Open Image Denoise; empty: it is searched for
    // Memory for the images of all jobs that are not done, in bytes. Jobs beyond it are refused.
    std::uint64_t film_bytes = std::numeric_limits<std::uint64_t>::max();
    // Time between two Tick events, which a thread of the coordinator raises. nullopt: no such thread; the
    // caller calls tick()
    std::optional<Duration> tick;
    std::shared_ptr<const DisplayViews> views;  // how colours may be shown; null: as sRGB
    std::shared_ptr<trace::Tracer> tracer;      // records the spans of jobs; null: nothing is traced
  };
  static Result<std::unique_ptr<Coordinator>> open(Options options);
  ~Coordinator();

  // Jobs

  // If spec.frames is set, the job is a sequence (a job with frames), and the returned id is the sequence's.
  // Functions that change or show a job also accept a sequence's id; functions on a single image need the id
  // of a frame, which frame_job() gives.
  tl::expected<JobId, Rejected> submit(SubmitRequest request);
  // Submits the scene of job `before` once more, with changed settings (admission/admission.h: admit_again).
  // `traceparent`: as in SubmitRequest.
  Result<JobId> submit_again(const JobId& before, const JobSpec& changes, const std::string& owner,
                             const std::string& traceparent = {});
  JobsPage list(const JobsAsked& asked) const;  // returns one page of the jobs, filtered and ordered as asked
  std::vector<JobView> jobs() const;  // returns all jobs; a sequence is listed as one job, without its frames
  Result<JobView> job(const JobId& id) const;
  Result<std::string> owner(const JobId& id) const;  // returns JobView::owner; faster than job()
  // Returns the memory that an answer about the job's image takes while it is made, at most: its film, and
  // `more_per_pixel` bytes for each pixel. Of a sequence, that of the largest frame; 0 if there is no such
  // job.
  std::uint64_t picture_bytes(const JobId& id, std::uint64_t more_per_pixel) const;
  Result<void> change(const JobId& id, const JobChange& change);
  Result<void> cancel(const JobId& id);
  // Removes an ended job with all its results; a job that has not ended is cancelled and kept. Frames are
  // removed only together, with their sequence.
  Result<void> remove(const JobId& id);
  // Returns when the job is done, failed or cancelled, or is paused because something went wrong
  // (JobView::error).
  Result<void> wait(const JobId& id) const;

  // Returns the job's trace span, which other code uses as the parent of the spans that it records. nullopt:
  // the job is not traced or does not exist.
  std::optional<trace::SpanContext> trace_of(const JobId& id) const;

  // Images and reports

  // The final image if there is one, else the current image. With `mix`, that image with other factors of its
  // light groups.
  Result<std::vector<std::byte>> image_exr(const JobId& id, const std::optional<LightMix>& mix = {}) const;
  // The deep image of a job with JobSpec::deep that has ended; with `while_rendering` also of one that
  // renders.
  Result<std::vector<std::byte>> deep_exr(const JobId& id, bool while_rendering = false) const;
  // Returns the error of a mix of light groups as JSON.
  Result<std::string> mix_json(const JobId& id, const LightMix& mix) const;
  // The image as an 8-bit PNG, also while the job renders. One image is denoised at a time, which takes
  // seconds.
  Result<std::vector<std::byte>> image_png(const JobId& id, const Look& look = {},
                                           const std::optional<LightMix>& mix = {}) const;
  // The views that a Look may name; null: only sRGB.
  const DisplayViews* display_views() const;
  // Returns the table of a view (DisplayView::cube()).
  Result<std::vector<std::uint16_t>> view_cube(const std::string& view) const;
  // A small picture of the final or the current image, for lists
  Result<std::vector<std::byte>> thumbnail_png(const JobId& id) const;
  // Videos of sequences (service/videos.h)
  Result<VideoView> make_video(const JobId& id, const VideoAsked& asked);
  Result<VideoView> video(const JobId& id) const;
  Result<std::filesystem::path> video_file(const JobId& id) const;
  // False-colour maps of the error and of the samples (core/image/exr/maps.h).
  Result<std::vector<std::byte>> error_png(const JobId& id) const;
  Result<std::vector<std::byte>> samples_png(const JobId& id) const;
  // layers_json() lists the layers of the image (final or current). pixels() returns a rectangle of one layer
  // at one mip level as numbers (core/image/exr/pixel_layers.h).
  Result<std::string> layers_json(const JobId& id) const;
  Result<std::vector<std::byte>> pixels(const JobId& id, const PixelsAsked& asked) const;
  Result<std::string> report_json(const JobId& id) const;
  Result<std::string> meters_json(const JobId& id) const;  // what a job without an image measures
  Result<std::vector<ConvergencePoint>> convergence(const JobId& id) const;
  // Returns the path of the file `name` (image.exr, deep.exr or report.json) of a done job. Empty if the job
  // is not done, or if everything is in memory: then image_exr() and report_json() give the contents.
  std::filesystem::path final_file(const JobId& id, const std::string& name) const;
  Result<std::vector<TileView>> tiles(const JobId& id) const;
  Result<std::string> job_log(const JobId& id) const;

  // Workers

  std::vector<WorkerView> workers() const;
  // The latest events of a worker since this coordinator knows it, a line each: states, failures, refusals
  Result<std::string> worker_log(const WorkerId& id) const;
  Result<void> drain_worker(const WorkerId& id, DrainNow how = {});  // WorkerSessions::drain
  // `principal`: who answers for the worker (WorkerJoined::principal)
  Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello& hello, std::shared_ptr<WorkerSink> sink,
                                                 const std::string& principal = {});

  // Events

  // Calls `on_event` for every event with an id above `after_id` that is still kept, then for new events, in
  // the order of their ids, on a thread of the coordinator. The subscription ends when the returned handle is
  // destroyed. The callback must not block: if it passes events to a slow reader, it must drop some.
  std::shared_ptr<void> subscribe(std::uint64_t after_id, std::function<void(const StreamEvent&)> on_event);
  std::uint64_t last_event_id() const;

  // Blobs

  BlobStore& blobs();
  // Notes that a worker requested a blob that is missing or damaged in the blob store. The jobs that need the
  // blob are paused until it is available again.
  void blob_missing(const Digest& digest, const Error& why);
  void blob_sent(std::uint64_t bytes);  // counts bytes sent to a worker
  // Removes blobs that no job needs, and interrupted uploads, after Options::keep_unused. With Options::tick
  // the coordinator calls this itself.
  void collect();

  // Other coordinators (Options::shared)

  // Publishes the addresses of this coordinator for other coordinators, workers and clients: http://HOST:PORT
  // and HOST:PORT (gRPC).
  void announce(const std::string& http, const std::string& grpc);
  // Finds the coordinator that owns a job unknown to this one; may block for a second. nullopt: no
  // coordinator has it.
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
