// The agent's state and its threads (see agent.h). agent.cpp contains the control thread, agent_loader.cpp
// the loader thread, agent_render.cpp the render threads. A world is a scene that is ready to render. To
// drain means to finish the running units, deliver all results and end. With a tracer (AgentOptions), the
// agent records trace spans: named time intervals, each with a parent span.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "worker/agent/agent.h"
#include "worker/agent/gap_meter.h"
#include "worker/agent/held_work.h"

namespace ls::worker {

// Exponential back-off with jitter: the n-th wait, from n = 0, is between 50 % and 100 % of min(first * 2^n,
// `most`). The jitter keeps a thousand workers from reconnecting at the same instant; it is seeded, so that
// tests can predict it.
class Backoff {
 public:
  Backoff(Duration first, Duration most, std::uint64_t seed) : first_(first), most_(most), random_(seed) {}

  Duration next() {
    const Duration whole = std::min(first_ * (std::int64_t{1} << std::min(attempts_, 20)), most_);
    ++attempts_;
    const double part = 0.5 + 0.5 * static_cast<double>(random_() >> 11) * 0x1p-53;
    return std::chrono::duration_cast<Duration>(whole * part);
  }
  void reset() { attempts_ = 0; }

 private:
  Duration first_, most_;
  int attempts_ = 0;
  std::mt19937_64 random_;
};

struct ConnectionLost {
  Error why;
};
struct Arrival {
  // Number of the connection, given by the agent; events of older connections are ignored
  std::uint64_t connection = 0;
  std::variant<ToWorker, ConnectionLost> what;
};

// The queue of events for the agent's control thread: messages from the coordinator and the loss of the
// connection. Another thread can also wake the control thread without an event (nudge). The link's observer
// shares ownership of the queue, so that a late callback cannot reach a destroyed agent.
class Inbox {
 public:
  void push(Arrival arrival) {
    const std::lock_guard lock(mutex_);
    arrivals_.push_back(std::move(arrival));
    changed_.notify_one();
  }
  void nudge() {
    const std::lock_guard lock(mutex_);
    nudged_ = true;
    changed_.notify_one();
  }
  // Waits for an event or a nudge, but no longer than `at_most`. Removes all events from the queue and
  // returns them, oldest first.
  std::deque<Arrival> wait(Duration at_most) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, at_most, [this] { return nudged_ || !arrivals_.empty(); });
    nudged_ = false;
    return std::exchange(arrivals_, {});
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Arrival> arrivals_;
  bool nudged_ = false;
};

class InboxObserver final : public LinkObserver {
 public:
  InboxObserver(std::shared_ptr<Inbox> inbox, std::uint64_t connection)
      : inbox_(std::move(inbox)), connection_(connection) {}
  void received(ToWorker message) override { inbox_->push({connection_, std::move(message)}); }
  void lost(Error why) override { inbox_->push({connection_, ConnectionLost{std::move(why)}}); }

 private:
  std::shared_ptr<Inbox> inbox_;
  const std::uint64_t connection_;
};

// Returns which file of the job is gone: somebody has cleaned up the cache. Empty: all files are there.
std::string lost_file(const LocalJob& job);

struct Agent::Impl {
  Impl(AgentOptions o, CoordinatorLink& l, RenderBackend& b, BlobFiles& f, const Clock& c);

  // A job known to this worker. `local` and `files` are set once its blobs are on this machine.
  struct Job {
    JobBrief brief;
    enum class State { idle, loading, ready } state = State::idle;
    std::shared_ptr<const LocalJob> local;
    std::vector<std::shared_ptr<const BlobFile>> files;  // each keeps one file of the job in the cache
    // Value of the counter `uses` when the job was used last. The world of the least recently used job is
    // freed first.
    std::uint64_t last_use = 0;
    // Earliest time of the next attempt to load, after an interrupted transfer or a fault of this machine
    TimePoint retry_at{};
    // The fault of this machine that made the last attempt to load fail; empty: there was none
    std::string trouble;
    // Which file of the world in memory is gone; empty: none. The job is idle then. The world is freed when
    // the last of its units that are being rendered ends, and is not loaded again before: a unit that began
    // with it might find it gone.
    std::string lost;
    int transfers_cut = 0;  // transfers of its files that were cut since it was last loaded or given back
    UnitTimes unreported;   // time spent on loading the job, not yet reported to the coordinator
  };
  // The state of one render thread.
  struct RenderSlot {
    std::atomic<bool> stop{false};  // tells the backend to abandon the current unit
    std::optional<UnitKey> unit;    // the unit being rendered; nullopt: none; guarded by mutex
    // The members below are used only by this thread. They give the job of its previous unit, and when that
    // unit ended.
    JobId last_job;
    TimePoint last_end{};
    double last_transfer = 0;  // seconds spent packing the previous unit's result
    TimePoint began{};         // when the current unit began; set only if there is a tracer
  };
  enum class Connection { down, opening, up };

  // Functions that the control thread calls.
  Result<void> run();
  void handle(Arrival& arrival);
  void handle_message(ToWorker& message);
  void connection_ended(const Error& why);
  void open_connection();
  void accept_lease(AssignLease& assign);
  void drop_work(const JobId& job);  // drops the job's units and results; call with the mutex held
  // Sets the stop flag of each running unit that is no longer in `table`, and that of the loader if it loads
  // a job of which `table` has no unit.
  void stop_dropped_work();
  void apply_drain(const DrainNow& asked);
  void look_at_drain();    // begins a drain, or ends one that the coordinator has withdrawn
  void look_at_backend();  // drains if the backend is broken, so that run() ends with the backend's error
  // If the worker was without work for options.idle_limit: drains, or ends run() if it has never joined.
  void look_at_idleness();
  std::vector<FromWorker> due_messages();
  std::optional<Result<void>> verdict();  // the result of run() if it should end now; nullopt: it continues
  Duration until_next_timer() const;
  WorkerProgress progress() const;
  void end_threads();

  // Functions that the loader thread calls, except trouble(), which the control thread calls.
  void load_loop(std::stop_token token);
  std::optional<JobId> next_to_load();
  // Frees a world that is not needed, if too many are kept, so that this job can be loaded; false: all are
  // needed. A job that has waited for room longer than kRoomWait goes before units that came after its
  // own: a world is not needed for these.
  bool make_room(const JobId& job);
  bool can_load();            // next_to_load() has a job, and there is room for it
  bool room_overdue() const;  // true if a job has waited for room longer than kRoomWait
  void load(const JobBrief& brief);
  void try_to_load(const JobBrief& brief);
  // Each of these ends an attempt to load the job that has failed. If the loader was told to stop, or the job
  // was replaced by another one with its id, they do nothing besides.
  void loading_failed(const JobBrief& brief, UnitFailure failure);
  void hold_off(const JobBrief& brief, std::string trouble, bool transfer_cut = false);
  // Ends an attempt to load the job, and returns the job, which is idle then; null: it was replaced. Call
  // with the mutex held.
  Job* end_loading(const JobBrief& brief);
  // Returns a recent fault of this machine that prevented loading a job; empty: there is none. Call with the
  // mutex held.
  std::string trouble() const;

  // Functions that the render threads call, except those of tracing, which all threads call.
  void render_loop(RenderSlot& slot, std::stop_token token);
  std::optional<HeldLeases::Held> next_unit(RenderSlot& slot, std::stop_token token,
                                            std::shared_ptr<const LocalJob>& job);
  // Call right after the slot has rendered a unit of `job`, which took `wall_seconds` from its first to its
  // last sample. Returns the seconds that the slot idled between its previous unit and this one, and records
  // them in `gaps`. If the previous unit was of another job, returns 0 and records nothing.
  double note_gap(RenderSlot& slot, const JobId& job, double wall_seconds);
  tl::expected<UnitResult, UnitFailure> rendered_unit(RenderSlot& slot, const LocalJob& job,
                                                      const HeldLeases::Held& held);
  tl::expected<UnitResult, UnitFailure> render(RenderSlot& slot, const LocalJob& job,
                                               const HeldLeases::Held& held);
  // The next three functions record trace spans; call them only if there is a tracer. record() makes the span
  // a child of `parent`, the other two make it a child of the span of the unit's lease.
  void record(const char* name, const trace::SpanContext& parent, TimePoint begin, TimePoint end,
              trace::Attributes attributes, bool failed = false) const;
  void trace_unit(const RenderSlot& slot, const HeldLeases::Held& held,
                  tl::expected<UnitResult, UnitFailure>& outcome);
  void trace_sent(const UnitKey& unit);
  // Returns the span of the lease that has the job's first waiting unit; nullopt: that lease is not traced,
  // or no unit waits.
  std::optional<trace::SpanContext> trace_of(const JobId& job) const;
  // A guard: its destructor records the trace span of loading a scene. The parent of that span is the span of
  // the lease that needs the scene (trace_of()). If that lease is not traced, nothing is recorded.
  struct LoadSpan {
    LoadSpan(const Impl& agent, const JobId& job, TimePoint begin);
    ~LoadSpan();
    const Impl& agent;
    const JobId job;
    const TimePoint begin;
    const std::optional<trace::SpanContext> parent;
    const trace::SpanContext own;
    std::optional<TimePoint> loaded_at;  // when the world was built; nullopt: the scene could not be loaded
  };
  // `missing`: the lost_file() of `from`, the job as the unit was rendered with it; empty if it was rendered
  void finished(RenderSlot& slot, const UnitKey& key, tl::expected<UnitResult, UnitFailure> outcome,
                const LocalJob& from, std::string missing);
  // Frees the world of the job if one of its files was lost and no unit of it is being rendered. Call with
  // the mutex held.
  void free_lost_world(const JobId& id);

  const AgentOptions options;
  CoordinatorLink& link;
  RenderBackend& backend;
  BlobFiles& files;
  const Clock& clock;
  const std::shared_ptr<Inbox> inbox = std::make_shared<Inbox>();

  // The members from here to `id` are used only by the control thread.
  std::uint64_t connection_count = 0;
  Backoff backoff;
  // While the connection is down: the time of the next attempt to connect. While it is being opened: the time
  // to give up.
  TimePoint connection_timer{};
  TimePoint up_since{};
  TimePoint next_progress{};
  TimePoint drain_deadline{};
  TimePoint last_busy{};  // when this worker was last found to hold units or results
  std::optional<Result<void>> ended;
  WorkerId id;
  std::string secret;                   // proves to the coordinator that this worker has the id
  std::optional<DrainNow> drain_asked;  // the latest DrainNow, unless it was withdrawn or refused

  std::atomic<bool> drain_requested{false}, stop_requested{false};
  std::atomic<bool> stop_loading{false};  // tells the backend to abandon the world that it builds

  mutable std::mutex mutex;
  // Wakes the loader and render threads when the leases, the worlds or the free space of the outbox change
  std::condition_variable_any work;
  // All members from here to `loading` are guarded by `mutex`.
  HeldLeases table;
  Outbox outbox;
  BriefMemory<JobId> briefs;  // the jobs that the coordinator takes to be known here
  // The jobs of `briefs`, and all jobs of which the worker holds units or a world
  std::map<JobId, Job> jobs;
  // A result of a traced lease that is not sent yet: the span of the lease, and when the result was packed.
  struct Unsent {
    trace::SpanContext lease;
    TimePoint since{};
  };
  std::map<UnitKey, Unsent> unsent;
  std::deque<FromWorker> outgoing;  // returned units and Draining messages, sent when the connection is up
  std::vector<std::unique_ptr<RenderSlot>> slots;
  Connection connection = Connection::down;
  bool draining = false, restarting = false;  // restarting: draining, to restart the program
  std::string restart_refused;                // why the latest restart was refused, and until when to say so
  TimePoint restart_refused_until{};
  std::optional<Error> broken;  // the backend's error, which run() will return
  std::uint64_t uses = 0;
  double cpu_seconds = 0;
  double load_seconds = 0;
  GapMeter gaps;
  Backoff trouble_backoff;
  std::optional<JobId> loaded_job;  // the job that the loader loads
  // The job that the loader would load if there were room, and since when it has waited for that
  struct RoomWanted {
    JobId job;
    TimePoint since{};
  };
  std::optional<RoomWanted> room_wanted;
  // While the loader loads a job: the name of the file that it fetched last or is fetching; otherwise empty
  std::string loading;

  std::vector<std::jthread> threads;
};

}  // namespace ls::worker
