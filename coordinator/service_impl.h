// The service's inside. One mutex around the farm and all that belongs to it; slow work has its own threads:
//
//   receive() -> [verify threads: decode, digest] -> [commit thread: append, one fdatasync for all] -> farm
//   -> acknowledge [keeper thread: convergence points, logs, snapshots, final images; strictly in order]
//
// A public method takes the lock; what ends in _locked expects it. Effects are carried out under the lock, in
// order.
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
#include <string>
#include <thread>
#include <vector>

#include "common/image/final_image.h"
#include "coordinator/assemble/assembly.h"
#include "coordinator/assemble/report.h"
#include "coordinator/assemble/truth_book.h"
#include "coordinator/assemble/verify.h"
#include "coordinator/domain/farm.h"
#include "coordinator/domain/limits.h"
#include "coordinator/event_hub.h"
#include "coordinator/limits.h"
#include "coordinator/outlook.h"
#include "coordinator/service.h"
#include "coordinator/store/collected_blobs.h"
#include "coordinator/store/job_store.h"
#include "coordinator/store/partial_log.h"
#include "coordinator/work_queue.h"

namespace ls::coordinator {

class SnapshotFile;

inline constexpr const char* kRemovedExtension = ".removed";  // of the folder of a job that goes
inline constexpr std::size_t kMaxChores = 4096;     // that wait for the disk; then results wait, too
inline constexpr std::size_t kMaxLogChores = 1024;  // then log lines are left out

struct JobEntry {
  StoredJob stored;
  Digest settings_digest;
  TileGrid grid;
  std::shared_ptr<PartialLog> log;                // none in memory
  std::optional<Assembly> assembly;               // none once an ended job is on disk
  std::optional<TruthBook> truths;                // with a reference only, while there is an assembly
  std::optional<ReferenceNoise> reference_noise;  // as of the last comparison; nothing: not known
  std::vector<ConvergencePoint> points;
  std::uint64_t curve = 0;   // number of the curve of these points: those of wrong or lost pixels are dropped
  bool dormant = false;      // has ended and is on the disk: the farm does not know it
  bool removed = false;      // by its user; nothing of it is stored any more
  bool pin_unsaved = false;  // its numeric class is not stored yet: no result of it may be
  std::string audits;        // under way, as last told to the disk (store/audit_file.h)
  std::string broken;        // why it could not be taken up at the start
  std::uint64_t finishing = 0;  // number of the final image being made; 0: none
  bool snapshot_running = false;
  std::uint64_t snapshots = 0;  // that were put at their place; the keeper's alone
  TimePoint last_snapshot{}, last_progress{};
  bool progress_due = false;
  JobState last_state = JobState::queued;  // as published
  std::optional<TimePoint> clock_zero;     // of the job's seconds, while it runs
  std::optional<TimePoint> still_since;    // paused: its clock stands
  double fold_seconds = 0;                 // job seconds at the last fold
  std::string trouble;                     // why it waits
  std::map<std::pair<TileIndex, RoundIndex>, std::vector<WorkerId>> leased;  // for people
  // While a restart folds again: job seconds of each durable result.
  std::map<std::pair<TileIndex, RoundIndex>, double> replay_at;
};

struct Sequence {
  std::vector<std::shared_ptr<JobEntry>> frames;  // ascending, never empty
  std::vector<std::string> warnings;              // of all frames, each once
  TimePoint last_progress{};
  bool progress_due = false;
};

struct Connection {
  WorkerId worker;
  std::uint64_t epoch = 0;
  Digest numeric_class;
  bool fake = false;
  std::shared_ptr<WorkerSink> sink;
  bool open = true;                    // under the service's lock
  std::atomic<bool> held_back{false};  // a result of its waits for room; its stream is not read
  std::shared_ptr<const std::atomic<bool>> service_lives;  // a session may outlive the service
  std::optional<std::uint64_t> first_lease;                // number of the first one assigned over it
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
  Result<std::vector<std::byte>> image_png(const JobId& id, double exposure) const override;
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
  Result<std::optional<Elsewhere>> elsewhere(const JobId& id) override;
  AuditFigures audits() const override;
  FarmFigures figures() const override;
  void blob_lacking(const Digest& digest, const Error& why) override;
  void blob_sent(std::uint64_t bytes) override { blob_bytes_ += bytes; }
  void tick() override;
  void collect() override;

  // ---- from sessions (service_workers.cpp) ----
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
    bool barred = false;    // its worker has turned out to render wrong pixels
    std::size_t bytes = 0;  // of the budget
    TimePoint at{};         // when it came
  };
  struct Checked {
    Arrived arrived;
    Verified verified;
    double seconds = 0;  // that it took
  };

  Service(Options options, std::shared_ptr<CollectedBlobs> blobs, std::shared_ptr<JobStore> store, File lock,
          std::uint64_t start);
  void start_threads();
  Result<void> restore();

  // ---- restart (service_restore.cpp) ----
  EntryPtr make_entry(StoredJob stored) const;
  // `missing`: what the job needs and is not among the blobs. It waits for that.
  Result<void> take_up_locked(JobEntry& entry, JobState state, const Result<std::vector<BlobRef>>& missing);
  void set_aside_locked(JobEntry& entry, const Error& why);
  bool image_is_lost(const StoredJob& job) const;
  static void begin_again(StoredJob& job);
  bool has_barred_locked(const JobEntry& entry) const;
  // Opens the log and loads what is folded, without what barred workers have rendered.
  Result<void> load_locked(JobEntry& entry);
  void remove_strangers(const std::vector<StoredJob>& jobs) const;
  void remove_leftovers() const;

  // ---- files that jobs wait for (service_blobs.cpp) ----
  Result<std::vector<BlobRef>> lacking(const StoredJob& job) const;
  void await_locked(JobEntry& entry, const BlobRef& file, bool damaged);
  void look_for_awaited_locked();
  void look_for(const std::set<Digest>& awaited);

  // ---- collection (service_collect.cpp) ----
  std::optional<std::set<Digest>> needed_blobs() const;
  void collect_loop(const std::stop_token& token);
  void look_at_blobs();

  // ---- several coordinators (service_shared.cpp) ----
  void look_for_moved_jobs();
  void let_go(const JobId& id);
  void leave_sequence_locked(const EntryPtr& entry);
  struct Inheritance {
    JobStore::Inherited job;
    TimePoint again{};  // not before
  };
  void take_over(Inheritance inheritance);
  void heed_barred_locked(const std::vector<BarredWorker>& workers);

  // ---- sequences (service_sequence.cpp, service_sequence_views.cpp) ----
  tl::expected<JobId, Rejected> submit_sequence(const SubmitRequest& request);
  void register_locked(const EntryPtr& entry);
  void publish_sequence_locked(const JobId& id, bool at_once);
  Result<void> edit_locked(const std::vector<EntryPtr>& frames, const std::function<void(StoredJob&)>& edit);
  Result<void> change_sequence_locked(const JobId& id, const Sequence& sequence, const JobChange& change);
  Result<std::vector<EntryPtr>> may_retarget_locked(const JobId& id, const std::vector<EntryPtr>& sound,
                                                    double target_error) const;
  Result<std::vector<EntryPtr>> may_extend_locked(const Sequence& sequence, std::uint64_t spp) const;
  Result<void> save_together_locked(const std::function<void()>& changes);
  Result<void> become_together_locked(const std::vector<EntryPtr>& frames, JobState asked);
  Result<void> remove_sequence_locked(const JobId& id, const Sequence& sequence);
  JobView sequence_view_locked(const JobId& id, const Sequence& sequence, bool with_frames) const;
  Result<std::string> sequence_report(const JobId& id) const;
  Result<std::string> sequence_log(const JobId& id) const;
  bool is_sequence(const JobId& id) const;

  // ---- changes (service_jobs.cpp, service_changes.cpp) ----
  JobId unused_id_locked() const;
  Result<void> room_for_locked(const std::string& owner, std::size_t jobs) const;
  void drop_locked(const EntryPtr& entry);
  Result<EntryPtr> usable_locked(const JobId& id) const;
  Result<void> may_become_locked(const JobEntry& entry, JobState asked, bool extended) const;
  Result<void> become_locked(const EntryPtr& entry, JobState asked);
  Result<void> set_priority_locked(JobEntry& entry, int priority);
  Result<void> extend_locked(JobEntry& entry, std::uint64_t spp);
  Result<void> go_on_locked(JobEntry& entry, const Result<void>& possible, const Event& change,
                            std::string told);
  Result<void> set_target_locked(JobEntry& entry, double target_error);
  Result<void> wake_locked(JobEntry& entry);  // tells the farm of a dormant job again
  void forget_locked(JobEntry& entry);        // makes an ended job dormant
  Result<JobRestored> restored_locked(JobEntry& entry, JobState state);
  void load_folded(JobEntry& entry) const;
  void take_up_records(JobEntry& entry, JobRestored& event);
  std::filesystem::path folder(const JobId& id) const { return options_.data / "jobs" / id.value; }
  bool on_disk() const { return !options_.data.empty(); }

  // ---- effects (service_effects.cpp) ----
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
  void on(const WorkerDistrusted& e, Todo& todo);
  void on(const TileDiscarded& e, Todo& todo);
  void on(const WorkerForgotten& e, Todo& todo);
  void keep_audits_locked(const JobId& id);
  Result<WaitingPartial> partial_for_locked(JobEntry& entry, const Fold& e);
  void snapshot_if_due_locked(const EntryPtr& entry);
  bool persist_locked(JobEntry& entry);
  Result<void> save_barred_locked();
  Result<void> save_pin_locked(JobEntry& entry);
  void log_job(const JobId& id, std::string text);
  double elapsed_locked(const JobEntry& entry) const;
  void note_leased_locked(JobEntry& entry, const Lease& lease, const WorkerId& worker);
  void publish_job_locked(JobEntry& entry);
  void publish_progress_locked(JobEntry& entry);
  void publish_worker_locked(const WorkerId& id, bool at_once);

  // ---- final images and snapshots (service_finish.cpp), on the keeper thread ----
  void finish(const EntryPtr& entry, std::uint64_t number);
  void retire(const EntryPtr& entry);
  struct Folded {  // a cheap copy to work on outside of the lock
    Film film;
    RoundErrors errors;
    HealthBook health;
  };
  static Folded folded_of(const JobEntry& entry);
  Result<void> write_snapshot(const EntryPtr& entry, const Folded& folded);
  Result<void> write_snapshot_now(const EntryPtr& entry);
  void take_snapshot(const EntryPtr& entry);
  Result<SnapshotFile> copy_folded(const EntryPtr& entry);
  Result<std::uint64_t> write_image(const Film& film, const ReportFacts& facts);
  ReportFacts facts_locked(const JobEntry& entry) const;
  void add_point_locked(const EntryPtr& entry, const ConvergencePoint& point);
  void end_curve_locked(const EntryPtr& entry);
  void forget_curve_locked(JobEntry& entry);
  Provenance provenance_of(const ReportFacts& facts) const;
  MatteManifests mattes_of(const StoredJob& job) const;

  // ---- references (service_truth.cpp); compare() and reference_of() on the comparing thread ----
  void compare_locked(const EntryPtr& entry, std::span<const RoundIndex> rounds, double spp);
  void compare_last_locked(const EntryPtr& entry);
  void compare(const EntryPtr& entry, std::uint64_t curve, double spp, const std::vector<TilePicture>& tiles,
               bool last);
  std::shared_ptr<const Reference> reference_of(const StoredJob& job);
  void after_comparisons(const EntryPtr& entry, std::function<void()> chore);

  // ---- results (service_results.cpp) ----
  void receive_result(const std::shared_ptr<Connection>& from, UnitResult result, std::function<void()> next);
  void verify_loop(const std::stop_token& token);
  void commit_loop(const std::stop_token& token);
  void commit(std::vector<Checked> batch);
  void accept_locked(Checked& item, std::optional<PartialLog::Place> place);
  void refuse_locked(const Arrived& arrived, const Error& error);
  void cannot_store_locked(const Arrived& arrived, const Error& error);
  void acknowledge_locked(const Arrived& arrived, std::optional<Error> refused);

  // ---- workers ----
  void receive_locked(const std::shared_ptr<Connection>& from, FromWorker message);
  std::string lease_prefix() const { return "l" + std::to_string(start_); }
  void on_message_locked(const std::shared_ptr<Connection>& from, const WorkerProgress& m);

  // ---- views (service_views.cpp) ----
  EntryPtr find_locked(const JobId& id) const;
  Result<EntryPtr> entry_locked(const JobId& id) const;
  JobView view_locked(const JobEntry& entry) const;
  Outlook outlook_locked(const JobEntry& entry, const JobFigures& figures, const JobView& v) const;
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
  std::map<JobId, Sequence> sequences_;    // by their own id; their frames are in entries_
  std::vector<JobId> order_;               // of submission; a sequence stands for its frames
  std::set<EntryPtr>* unsaved_ = nullptr;  // while jobs change together: those to be stored after it
  std::map<WorkerId, WorkerEntry> workers_;
  std::uint64_t last_epoch_ = 0, last_final_ = 0, submissions_ = 0;
  std::vector<BarredWorker> barred_unsaved_;  // found, and not stored yet: no result may be
  std::vector<Inheritance> inherited_;        // to be taken over again later; under mutex_
  std::string store_trouble_;                 // the last result that could not be stored
  std::string blobs_trouble_;                 // why blobs cannot be asked for; empty: they can
  std::vector<EntryPtr> folded_;              // jobs that the events being handled have folded something of
  bool restoring_ = false;
  FarmFigures figures_;  // what is as it is now is filled in by figures()
  std::atomic<std::uint64_t> blob_bytes_{0};
  std::uint64_t log_lines_left_out_ = 0;
  std::shared_ptr<std::atomic<bool>> alive_ = std::make_shared<std::atomic<bool>>(true);

  ByteBudget budget_{limits::kMaxResultsWaiting};
  WorkQueue<Arrived> arrived_;
  WorkQueue<Checked> checked_;
  WorkQueue<std::function<void()>> chores_, comparisons_;
  WorkQueue<std::set<Digest>>
      looks_;  // for blobs that jobs wait for: the store may be away, and then only this waits
  TimePoint last_look_{};
  std::shared_ptr<const Reference> reference_;  // the last one compared with
  Digest reference_digest_;
  std::unique_ptr<EventHub> hub_;
  std::vector<std::jthread> threads_;  // last: joined before all that they use goes
};

double unix_now();
Result<void> check_priority(int priority);
std::string log_text(const std::vector<LogLine>& lines);

}  // namespace ls::coordinator
