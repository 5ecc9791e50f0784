// The agent's state and its three kinds of threads. Control: agent.cpp; loader: agent_loader.cpp; rendering:
// agent_render.cpp.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "worker/agent/agent.h"
#include "worker/agent/backoff.h"
#include "worker/agent/gap_meter.h"
#include "worker/agent/inbox.h"
#include "worker/agent/lease_book.h"
#include "worker/agent/outbox.h"

namespace ls::worker {

struct Agent::Impl {
  Impl(AgentOptions o, CoordinatorLink& l, RenderBackend& b, BlobFiles& f, const Clock& c);

  // A job that this worker has heard of. `local` and `files` are set once its blobs are here.
  struct Job {
    JobBrief brief;
    enum class State { idle, loading, ready } state = State::idle;
    std::shared_ptr<const LocalJob> local;
    std::vector<std::shared_ptr<const BlobFile>> files;  // pins
    std::uint64_t last_use = 0;
    bool cancelled = false;
    TimePoint retry_at{};  // after a transfer that was cut, or trouble
    std::string trouble;   // of this machine; why the last attempt to load it was given up
    UnitTimes untold;      // what loading it took, until a result tells it
  };
  struct RenderSlot {
    std::atomic<bool> stop{false};
    std::optional<UnitKey> unit;  // being rendered; guarded by mutex
    // Of its own thread: when its last unit was rendered, and of which job.
    JobId last_job;
    TimePoint last_end{};
    double last_transfer = 0;  // seconds to pack its result
  };
  enum class Connection { down, opening, up };

  // ---- control thread ----
  Result<void> run();
  void handle(Arrival& arrival);
  void handle_message(ToWorker& message);
  void connection_ended(const Error& why);
  void open_connection();
  void accept_lease(AssignLease& assign);
  void cancel(const JobId& job);
  void stop_dropped_units();  // raises the stop flag of each running unit that is no longer in the book
  void begin_drain();
  void look_at_backend();  // drains if it is broken, to end with its error
  std::vector<FromWorker> due_messages();
  std::optional<Result<void>> verdict();  // whether run() is over
  Duration until_next_timer() const;
  WorkerProgress progress() const;
  void end_threads();

  // ---- loader thread ----
  void load_loop(std::stop_token token);
  std::optional<JobId> next_to_load();
  bool make_room();  // forgets a world that nobody needs if too many are kept
  void load(const JobBrief& brief);
  void try_to_load(const JobBrief& brief);
  void loading_failed(const JobId& id, UnitFailure failure);
  void postpone(const JobId& id, const Error& why);
  void hold_off(const JobId& id, const std::string& trouble);
  std::string trouble() const;  // of the jobs that this machine could not load lately; with mutex held

  // ---- render threads ----
  void render_loop(RenderSlot& slot, std::stop_token token);
  std::optional<LeaseBook::Held> next_unit(RenderSlot& slot, std::stop_token token,
                                           std::shared_ptr<const LocalJob>& job);
  // Seconds between the slot's last unit of this job and the first sample of this one; 0 if it is the first.
  double note_gap(RenderSlot& slot, const JobId& job, double wall_seconds);
  tl::expected<UnitResult, UnitFailure> rendered_unit(RenderSlot& slot, const LocalJob& job,
                                                      const LeaseBook::Held& held);
  tl::expected<UnitResult, UnitFailure> render(RenderSlot& slot, const LocalJob& job,
                                               const LeaseBook::Held& held);
  void finished(RenderSlot& slot, const UnitKey& key, tl::expected<UnitResult, UnitFailure> outcome);

  const AgentOptions options;
  CoordinatorLink& link;
  RenderBackend& backend;
  BlobFiles& files;
  const Clock& clock;
  const std::shared_ptr<Inbox> inbox = std::make_shared<Inbox>();

  // Owned by the control thread alone.
  std::uint64_t connection_count = 0;
  Backoff backoff;
  TimePoint connection_timer{};  // down: when to try again; opening: when to give up
  TimePoint up_since{};
  TimePoint next_progress{};
  TimePoint drain_deadline{};
  std::optional<Result<void>> ended;
  WorkerId id;

  std::atomic<bool> drain_requested{false}, stop_requested{false};

  mutable std::mutex mutex;
  std::condition_variable_any work;  // for loader and render threads: leases, worlds, room in the outbox
  // ---- guarded by mutex ----
  LeaseBook book;
  Outbox outbox;
  std::map<JobId, Job> jobs;
  std::deque<FromWorker> outgoing;  // returned leases: sent when the stream is up
  std::vector<std::unique_ptr<RenderSlot>> slots;
  Connection connection = Connection::down;
  bool draining = false;
  std::optional<Error> broken;  // the backend; what run() ends with
  std::uint64_t uses = 0;
  double cpu_seconds = 0;
  double load_seconds = 0;
  GapMeter gaps;
  Backoff trouble_backoff;
  std::string loading;  // name of what is being fetched or built; empty: nothing

  std::vector<std::jthread> threads;
};

}  // namespace ls::worker
