// The implementation of the service. One mutex guards the farm and all that belongs to it; slow work has its
// own threads:
//
//   receive() -> [verify threads: decode, digest] -> [commit thread: append, one fdatasync for all]
//     -> farm -> acknowledge
//   [writer thread: convergence points, logs, snapshots, final images; strictly in order]
//
// Public methods take the lock; methods ending in _locked expect it to be held. Effects are carried out under
// the lock, in order.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/image/exr/final_image.h"
#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/job_report.h"
#include "coordinator/assemble/reference_tiles.h"
#include "coordinator/assemble/verify.h"
#include "coordinator/base/limits.h"
#include "coordinator/base/work_queue.h"
#include "coordinator/domain/farm/farm.h"
#include "coordinator/domain/limits.h"
#include "coordinator/service/coordinator.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/eta.h"
#include "coordinator/service/event_hub.h"
#include "coordinator/store/blobs/collected_blobs.h"
#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/log/partial_log.h"

namespace ls::coordinator {

class SnapshotFile;

inline constexpr const char* kRemovedExtension = ".removed";  // suffix of a removed job's folder
// Writes that wait for the disk; above this number, results wait, too
inline constexpr std::size_t kMaxBackgroundWrites = 4096;
// Writes that wait for the disk; above this number, log lines are dropped
inline constexpr std::size_t kMaxLogWrites = 1024;

struct JobEntry {
  StoredJob stored;
  Digest settings_digest;
  TileGrid grid;
  std::shared_ptr<PartialLog> log;   // file of accepted results; null if the job is only in memory
  std::optional<Assembly> assembly;  // the image; nullopt once an ended job is on disk
  // Pictures to compare with the reference, if it has one, while there is an assembly
  std::optional<ReferenceTiles> reference_tiles;
  // Noise of the reference, from the last comparison; nullopt: unknown
  std::optional<ReferenceNoise> reference_noise;
  // The denoised final image, until it is written; null: none is asked for, or it is not made yet
  std::shared_ptr<const Denoising::Denoised> denoised;
  std::vector<ConvergencePoint> points;
  // Number of the current convergence curve. Points of an older curve, which had wrong or lost pixels, are
  // dropped
  std::uint64_t curve = 0;
  bool unloaded = false;  // true if it has ended and is on disk only: the farm has forgotten it
  // True if its user removed it, or another coordinator has it: nothing more of it is stored
  bool removed = false;
  bool pin_unsaved = false;     // its numeric class is not stored yet, so its results cannot be stored either
  std::string audits;           // its open audits, as they were last written to disk (store/log/audit_file.h)
  std::string broken;           // why it could not be restored at the start
  std::uint64_t finishing = 0;  // number of the final image that is being made; 0: none is
  bool snapshot_running = false;
  std::uint64_t snapshots = 0;  // number of snapshots committed; used by the writer thread only
  TimePoint last_snapshot{}, last_progress{};
  bool progress_due = false;
  JobState last_state = JobState::queued;  // its state when it was last published
  std::optional<TimePoint> clock_zero;     // zero of the job's clock, while it runs
  std::optional<TimePoint> still_since;    // since when its clock stands still, because the job is paused
  double fold_seconds = 0;                 // seconds on the job's clock at the last fold
  std::string trouble;                     // why the job waits
  std::uint64_t resumes = 0;               // how often it was resumed
  // The workers that each leased unit (tile and round) is leased to, for display
  std::map<std::pair<TileIndex, RoundIndex>, std::vector<WorkerId>> leased;
  // Seconds on the job's clock of each durable result, while a restart replays the results
  std::map<std::pair<TileIndex, RoundIndex>, double> replay_at;
};

struct Sequence {
  std::vector<std::shared_ptr<JobEntry>> frames;  // ascending, never empty
  std::vector<std::string> warnings;              // of all frames, without duplicates
  TimePoint last_progress{};
  bool progress_due = false;
};

struct Connection {
  WorkerId worker;
  std::uint64_t epoch = 0;
  Digest numeric_class;
  bool fake = false;
  std::shared_ptr<WorkerSink> sink;
  bool open = true;  // guarded by the service's lock
  // true: a result of this worker waits for room, and its stream is not read meanwhile
  std::atomic<bool> held_back{false};
  // False once the service is gone: a session may outlive the service
  std::shared_ptr<const std::atomic<bool>> service_lives;
  std::optional<std::uint64_t> first_lease;  // number of the first lease assigned over this stream
};

struct WorkerEntry {
  WorkerHello hello;
  std::shared_ptr<Connection> connection;
  TimePoint last_seen{}, last_event{};
  std::string activity, trouble;
  double cpu_seconds = 0;
  std::uint64_t rss_bytes = 0;
  JobId last_job;
};

class Service final : public Coordinator {
 public:
  static Result<std::unique_ptr<Coordinator>> open(Options options);
  ~Service() override;

  tl::expected<JobId, Rejected> submit(SubmitRequest request) override;
  std::vector<JobView> jobs() const override;
  Result<JobView> job(const JobId& id) const override;
  Result<std::string> owner(const JobId& id) const override;
  Result<void> change(const JobId& id, const JobChange& change) override;
  Result<void> remove(const JobId& id) override;
  Result<void> cancel(const JobId& id) override;
  Result<void> pause(const JobId& id) override;
  Result<void> resume(const JobId& id) override;
  Result<void> set_priority(const JobId& id, int priority) override;
  Result<void> extend(const JobId& id, std::uint64_t spp) override;
  Result<std::vector<std::byte>> image_exr(const JobId& id) const override;
  Result<std::vector<std::byte>> image_png(const JobId& id, double exposure, bool denoised) const override;
  Result<std::vector<std::byte>> error_png(const JobId& id) const override;
  Result<std::vector<std::byte>> samples_png(const JobId& id) const override;
  Result<std::string> report_json(const JobId& id) const override;
  Result<std::vector<ConvergencePoint>> convergence(const JobId& id) const override;
  Result<std::vector<TileView>> tiles(const JobId& id) const override;
  Result<std::string> job_log(const JobId& id) const override;
  Result<void> wait(const JobId& id) const override;
  std::vector<WorkerView> workers() const override;
  Result<std::unique_ptr<WorkerSession>> connect(const WorkerHello& hello,
                                                 std::shared_ptr<WorkerSink> sink) override;
  std::shared_ptr<void> subscribe(std::uint64_t after_id,
                                  std::function<void(const StreamEvent&)> on_event) override;
  std::uint64_t last_event_id() const override;
  std::filesystem::path final_file(const JobId& id, const std::string& name) const override;
  BlobStore& blobs() override { return *blobs_; }
  bool ready(std::string* why_not) const override;
  StoreStatus store_status() const override { return store_->status(); }
  void announce(const std::string& http, const std::string& grpc) override;
  Result<std::optional<JobLocation>> locate_job(const JobId& id) override;
  AuditFigures audits() const override;
  FarmFigures figures() const override;
  void blob_missing(const Digest& digest, const Error& why) override;
  void blob_sent(std::uint64_t bytes) override { blob_bytes_ += bytes; }
  void tick() override;
  void collect() override;

  // From sessions (service_workers.cpp)
  void receive(const std::shared_ptr<Connection>& from, FromWorker message, std::function<void()> next);
  void disconnected(const std::shared_ptr<Connection>& connection);

 private:
  using Todo = std::deque<Event>;
  using EntryPtr = std::shared_ptr<JobEntry>;
  struct Arrived {
    std::shared_ptr<Connection> from;
    UnitResult result;
    EntryPtr job;
    UnitHeader expected;
    bool duplicate = false;
    bool quarantined = false;  // true if its worker was found faulty meanwhile
    std::size_t bytes = 0;     // bytes requested from budget_
    TimePoint at{};            // time of arrival
  };
  struct Checked {
    Arrived arrived;
    Verified verified;
    double seconds = 0;  // time spent on verification
  };

  Service(Options options, std::shared_ptr<CollectedBlobs> blobs, std::shared_ptr<JobStore> store, File lock,
          std::uint64_t start);
  void start_threads();
  Result<void> restore();

  // Restart (service_restore.cpp)
  EntryPtr make_entry(StoredJob stored) const;
  // Gives a stored job to the farm again. `missing` lists the blobs that the job needs and the store lacks:
  // the job waits for them.
  Result<void> take_up_locked(JobEntry& entry, JobState state, const Result<std::vector<BlobRef>>& missing);
  void set_aside_locked(JobEntry& entry, const Error& why);
  bool image_is_lost(const StoredJob& job) const;
  static void begin_again(StoredJob& job);
  bool has_quarantined_locked(const JobEntry& entry) const;
  // Opens the job's log and loads its folded image, without the results of quarantined workers.
  Result<void> load_locked(JobEntry& entry);
  void remove_unknown_folders(const std::vector<StoredJob>& jobs) const;
  void remove_leftovers() const;

  // Missing blobs (service_blobs.cpp)
  Result<std::vector<BlobRef>> missing_blobs_of(const StoredJob& job) const;
  void await_locked(JobEntry& entry, const BlobRef& file, bool damaged);
  void look_for_missing_locked();
  void look_for(const std::set<Digest>& missing_blobs);

  // Collection of unused blobs (service_collect.cpp)
  std::optional<std::set<Digest>> needed_blobs() const;
  void collect_loop(const std::stop_token& token);
  void look_at_blobs();

  // Several coordinators (service_shared.cpp)
  void look_for_moved_jobs();
  void let_go(const JobId& id);
  void leave_sequence_locked(const EntryPtr& entry);
  struct Inheritance {
    JobStore::Inherited job;
    TimePoint again{};  // the job is not tried again before this time
  };
  void take_over(Inheritance inheritance);
  void apply_quarantine_locked(const std::vector<QuarantinedWorker>& workers);

  // Sequences (service_sequence.cpp, service_sequence_views.cpp)
  tl::expected<JobId, Rejected> submit_sequence(const SubmitRequest& request);
  void register_locked(const EntryPtr& entry);
  void publish_sequence_locked(const JobId& id, bool at_once);
  Result<void> edit_locked(const std::vector<EntryPtr>& frames, const std::function<void(StoredJob&)>& edit);
  Result<void> change_sequence_locked(const JobId& id, const Sequence& sequence, const JobChange& change);
  Result<std::vector<EntryPtr>> may_retarget_locked(const JobId& id, const std::vector<EntryPtr>& sound,
                                                    double target_error) const;
  Result<std::vector<EntryPtr>> may_extend_locked(const Sequence& sequence, std::uint64_t spp) const;
  Result<void> save_all_locked(const std::function<void()>& changes);
  Result<void> become_all_locked(const std::vector<EntryPtr>& frames, JobState asked);
  Result<void> remove_sequence_locked(const JobId& id, const Sequence& sequence);
  JobView sequence_view_locked(const JobId& id, const Sequence& sequence, bool with_frames) const;
  Result<std::string> sequence_report(const JobId& id) const;
  Result<std::string> sequence_log(const JobId& id) const;
  bool is_sequence(const JobId& id) const;

  // Changes (service_jobs.cpp, service_changes.cpp)
  JobId unused_id_locked() const;
  Result<void> room_for_locked(const std::string& owner, std::size_t jobs) const;
  void drop_locked(const EntryPtr& entry);
  Result<EntryPtr> usable_locked(const JobId& id) const;
  Result<void> may_become_locked(const JobEntry& entry, JobState asked, bool extended) const;
  Result<void> become_locked(const EntryPtr& entry, JobState asked);
  Result<void> set_priority_locked(JobEntry& entry, int priority);
  Result<void> extend_locked(JobEntry& entry, std::uint64_t spp);
  Result<void> go_on_locked(JobEntry& entry, const Result<void>& possible, const Event& change,
                            std::string log_line);
  Result<void> set_target_locked(JobEntry& entry, double target_error);
  Result<void> wake_locked(JobEntry& entry);  // gives an unloaded job back to the farm
  void forget_locked(JobEntry& entry);        // unloads an ended job
  Result<JobRestored> restored_locked(JobEntry& entry, JobState state);
  void load_folded(JobEntry& entry) const;
  void take_up_records(JobEntry& entry, JobRestored& event);
  std::filesystem::path folder(const JobId& id) const { return options_.data / "jobs" / id.value; }
  bool on_disk() const { return !options_.data.empty(); }

  // Effects (service_effects.cpp)
  void run_locked(Event first);
  void carry_out(const Effect& effect, Todo& todo);
  void on(const Send& e, Todo& todo);
  void on(const UnitsFreed& e, Todo& todo);
  void on(const RecordUnit& e, Todo& todo);
  void on(const Fold& e, Todo& todo);
  void on(const DropDuplicate&, Todo&) { ++figures_.equal; }
  void on(const DropUnwanted& e, Todo& todo);
  void on(const DigestMismatch& e, Todo& todo);
  void on(const JobPinned& e, Todo& todo);
  void on(const JobStateChanged& e, Todo& todo);
  void on(const Checkpoint& e, Todo& todo);
  void on(const ReopenRound& e, Todo& todo);
  void on(const JobFinished& e, Todo& todo);
  void on(const JobFailed& e, Todo& todo);
  void on(const WorkerStateChanged& e, Todo& todo);
  void on(const WorkerBlocked& e, Todo& todo);
  void on(const WorkerFoundFaulty& e, Todo& todo);
  void on(const TileDiscarded& e, Todo& todo);
  void on(const WorkerForgotten& e, Todo& todo);
  void keep_audits_locked(const JobId& id);
  Result<WaitingPartial> partial_for_locked(JobEntry& entry, const Fold& e);
  void snapshot_if_due_locked(const EntryPtr& entry);
  bool persist_locked(JobEntry& entry);
  Result<void> save_quarantined_locked();
  Result<void> save_pin_locked(JobEntry& entry);
  void log_job(const JobId& id, std::string text);
  double elapsed_locked(const JobEntry& entry) const;
  void note_leased_locked(JobEntry& entry, const Lease& lease, const WorkerId& worker);
  void publish_job_locked(JobEntry& entry);
  void publish_progress_locked(JobEntry& entry);
  void publish_worker_locked(const WorkerId& id, bool at_once);

  // Final images and snapshots (service_finish.cpp), on the writer thread
  void finish(const EntryPtr& entry, std::uint64_t number);
  void retire(const EntryPtr& entry);
  struct Folded {  // a copy of the folded image, cheap to make, to use outside the lock
    Film film;
    RoundErrors errors;
    HealthTable health;
  };
  static Folded folded_of(const JobEntry& entry);
  Result<void> write_snapshot(const EntryPtr& entry, const Folded& folded);
  Result<void> write_snapshot_now(const EntryPtr& entry);
  void take_snapshot(const EntryPtr& entry);
  Result<SnapshotFile> copy_folded(const EntryPtr& entry);
  Result<std::uint64_t> write_image(const Film& film, const ReportFacts& facts,
                                    std::span<const float> denoised);
  ReportFacts facts_locked(const JobEntry& entry) const;
  void add_point_locked(const EntryPtr& entry, const ConvergencePoint& point);
  void end_curve_locked(const EntryPtr& entry);
  void forget_curve_locked(JobEntry& entry);
  Provenance provenance_of(const ReportFacts& facts) const;
  CryptomatteManifests cryptomatte_manifests_of(const StoredJob& job) const;

  // References (service_reference.cpp); compare() and reference_of() run on the comparing thread
  void compare_locked(const EntryPtr& entry, std::span<const RoundIndex> rounds, double spp);
  void compare_last_locked(const EntryPtr& entry);
  void compare(const EntryPtr& entry, std::uint64_t curve, double spp, const std::vector<TilePicture>& tiles,
               bool last);
  std::shared_ptr<const Reference> reference_of(const StoredJob& job);
  void after_comparisons(const EntryPtr& entry, std::function<void()> write);
  std::shared_ptr<const Denoising::Denoised> denoised(
      const Film& film, ReportFacts& facts, std::shared_ptr<const Denoising::Denoised> made = nullptr) const;
  void denoise_final(const EntryPtr& entry, std::uint64_t number);

  // Results (service_results.cpp)
  void receive_result(const std::shared_ptr<Connection>& from, UnitResult result, std::function<void()> next);
  void verify_loop(const std::stop_token& token);
  void commit_loop(const std::stop_token& token);
  void commit(std::vector<Checked> batch);
  void accept_locked(Checked& item, std::optional<PartialLog::Place> place);
  void refuse_locked(const Arrived& arrived, const Error& error);
  void cannot_store_locked(const Arrived& arrived, const Error& error, std::uint64_t resumes);
  void acknowledge_locked(const Arrived& arrived, std::optional<Error> refused);

  // Workers (service_workers.cpp)
  void receive_locked(const std::shared_ptr<Connection>& from, FromWorker message);
  std::string lease_prefix() const { return "l" + std::to_string(start_); }
  void on_message_locked(const std::shared_ptr<Connection>& from, const WorkerProgress& m);

  // Views (service_views.cpp)
  EntryPtr find_locked(const JobId& id) const;
  Result<EntryPtr> entry_locked(const JobId& id) const;
  JobView view_locked(const JobEntry& entry) const;
  Eta eta_locked(const JobEntry& entry, const JobFigures& figures, const JobView& v) const;
  WorkerView view_locked(const WorkerId& id, const WorkerEntry& entry) const;
  struct Picture {
    Film film;
    ReportFacts facts;
    bool final_on_disk = false;
  };
  Result<Picture> picture(const JobId& id) const;
  JobState shown_state(const JobEntry& entry) const;

  TimePoint now() const { return options_.clock->now(); }

  Options options_;
  std::shared_ptr<CollectedBlobs> blobs_;
  std::shared_ptr<JobStore> store_;
  File lock_;
  std::uint64_t start_;  // number of this start of the coordinator

  mutable std::mutex mutex_;
  mutable std::condition_variable ended_;
  Farm farm_;
  std::map<JobId, EntryPtr> entries_;
  std::map<JobId, Sequence> sequences_;  // by sequence id; their frames are in entries_
  std::vector<JobId> order_;             // in order of submission; a sequence stands for its frames
  // While several jobs change together: collects the jobs to store afterwards
  std::set<EntryPtr>* unsaved_ = nullptr;
  std::map<WorkerId, WorkerEntry> workers_;
  std::uint64_t last_epoch_ = 0, last_final_ = 0, submissions_ = 0;
  // Faulty workers that are found but not stored yet; until they are, no result may be stored
  std::vector<QuarantinedWorker> quarantined_unsaved_;
  // Jobs of other coordinators to be taken over later; guarded by mutex_
  std::vector<Inheritance> inherited_;
  std::string store_trouble_;     // why the last result could not be stored; empty if it was
  std::string blobs_trouble_;     // why the blob store is unavailable; empty if it is available
  std::vector<EntryPtr> folded_;  // jobs of which units were folded by the events that are being handled
  bool restoring_ = false;
  FarmFigures figures_;  // figures() fills in the current values (..._now)
  std::atomic<std::uint64_t> blob_bytes_{0};
  std::uint64_t log_lines_left_out_ = 0;
  std::shared_ptr<std::atomic<bool>> alive_ = std::make_shared<std::atomic<bool>>(true);

  ByteBudget budget_{limits::kMaxResultsWaiting};
  WorkQueue<Arrived> arrived_;
  WorkQueue<Checked> checked_;
  WorkQueue<std::function<void()>> background_writes_, comparisons_;
  // Lookups of missing blobs. They have a thread of their own since the blob store may be unavailable
  WorkQueue<std::set<Digest>> looks_;
  TimePoint last_look_{};
  std::shared_ptr<const Reference> reference_;  // the reference image that the last comparison used
  Digest reference_digest_;
  mutable Denoising denoising_;
  std::unique_ptr<EventHub> hub_;
  // This is the last member, so the threads are joined before anything that they use is destroyed
  std::vector<std::jthread> threads_;
};

double unix_now();
Result<void> check_priority(int priority);
std::string log_text(const std::vector<LogLine>& lines);

}  // namespace ls::coordinator
