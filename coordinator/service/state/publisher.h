// Publishes changes of jobs and workers as events (Publisher) to listeners (EventHub).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "coordinator/service/state/job_views.h"
#include "coordinator/service/state/records.h"

namespace ls::coordinator {

// Events are numbered, and the latest ones are kept for readers that reconnect. Listeners are called in order
// on a separate thread, so no listener runs under a lock of the service.
class EventHub {
 public:
  // Durably reserves the next `count` ids, so that no id is ever used twice. Returns the number before the
  // first of them.
  using Reserve = std::function<Result<std::uint64_t>(std::uint64_t count)>;
  explicit EventHub(Reserve reserve);
  ~EventHub() { close(); }
  void close();  // waits until no listener is being called; afterwards no listener is called any more

  void publish(std::string type, std::string data, std::string job, std::string owner = {});
  // Calls `on_event` for every kept event with an id above `after_id`, then for new ones. The calls come from
  // the hub's thread, after publish() returns. The subscription ends when the returned handle is destroyed.
  // After that no call is in progress (unless the callback itself destroyed the handle). The handle may
  // outlive the hub.
  std::shared_ptr<void> subscribe(std::uint64_t after_id, std::function<void(const StreamEvent&)> on_event);
  std::uint64_t last_id() const;

 private:
  struct State;
  static void deliver(State& state, const std::stop_token& token);
  std::shared_ptr<State> state_;
  std::jthread thread_;
};

// Turns changes into events. Events about a job's progress are sent at a minimum interval; publish_due()
// sends those that were delayed.
class Publisher {
 public:
  Publisher(EventHub& hub, const JobViews& views, JobTable& jobs, WorkerTable& workers,
            const Records& records, const Clock& clock)
      : hub_(hub), views_(views), jobs_(jobs), workers_(workers), records_(records), clock_(clock) {}

  // If `quiet`, changes of jobs and sequences are not published.
  void set_quiet(bool quiet) { quiet_ = quiet; }
  bool quiet() const { return quiet_; }

  void job(JobEntry& entry);
  void progress(JobEntry& entry);
  void sequence(const JobId& id, bool at_once);
  void publish_due();
  void job_removed(const JobId& id, const std::string& owner);
  void job_moved(const JobId& id, const std::string& owner);  // the job is now at another coordinator
  void tile(const JobEntry& entry, TileIndex tile, const PixelRect& rect, std::string_view state,
            std::uint64_t spp, const WorkerId& worker = {});
  void worker(const WorkerId& id, bool at_once);
  void worker_gone(const WorkerId& id);

 private:
  EventHub& hub_;
  const JobViews& views_;
  JobTable& jobs_;
  WorkerTable& workers_;
  const Records& records_;
  const Clock& clock_;
  bool quiet_ = false;
};

}  // namespace ls::coordinator
