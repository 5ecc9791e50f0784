#include "coordinator/webhooks/webhooks.h"

#include <fmt/format.h>

#include <condition_variable>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "common/base/log.h"
#include "common/base/secret.h"
#include "coordinator/views/views.h"
#include "coordinator/webhooks/line.h"
#include "coordinator/webhooks/webhook_outbox.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;
using webhooks::Delivery;
using webhooks::Line;

bool ended(const std::string& state) {
  return state == "done" || state == "failed" || state == "cancelled" || state == "removed" ||
         state == "moved";
}

class Teller final : public Webhooks {
 public:
  Teller(Options options, webhooks::Outbox outbox)
      : options_(std::move(options)), outbox_(std::move(outbox)) {
    if (!options_.send) options_.send = &webhooks::send;
    open_ = outbox_.open_jobs();
    for (std::size_t i = 0; i < options_.urls.size(); ++i) {
      lines_.emplace_back();
      for (auto& delivery : outbox_.waiting(i)) {
        last_number_ = std::max(last_number_, delivery.number);
        kept_.insert(delivery.id.substr(0, delivery.id.rfind('/')));
        lines_.back().add(std::move(delivery));
      }
    }
  }

  ~Teller() override {
    subscription_.reset();  // no callback is in progress after this
    for (auto& thread : threads_) thread.request_stop();
  }

  void start(Coordinator& coordinator) {
    // Subscribe to the events before the jobs' states are read, so that no change is missed.
    std::uint64_t last = coordinator.last_event_id();
    subscription_ = coordinator.subscribe(last, [this, &coordinator, last](const StreamEvent& event) mutable {
      // The coordinator keeps a limited number of events. If ids are missing here, events were dropped while
      // this callback waited for the disk; then the jobs' states are read instead.
      if (event.id != last + 1) look_again(coordinator, event.id);
      last = event.id;
      if (event.type == "job") changed(event.job, event.data, event.id);
    });
    catch_up(coordinator);
    for (std::size_t i = 0; i < options_.urls.size(); ++i)
      threads_.emplace_back([this, i](const std::stop_token& token) { deliver(i, token); });
  }

  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    Figures f = figures_;
    for (const Line& line : lines_) f.waiting += line.waiting();
    return f;
  }

 private:
  // Reports changes of jobs that happened before this start, and that a crash kept from being reported.
  void catch_up(Coordinator& coordinator) {
    for (const JobId& job : outbox_.open_jobs()) {
      const auto view = coordinator.job(job);
      const std::string state(view ? to_string(view->state) : "");
      // Its end may already be among the pending deliveries, if the crash came between the two writes.
      if (!view || kept_.contains(job.value + "/" + state)) {
        const std::lock_guard lock(mutex_);
        mark_ended_locked(job);
        if (view) states_.emplace(job.value, state);
      } else if (ended(state)) {
        changed(job.value, job_json(*view), 0);
      }
    }
    for (const JobView& view : coordinator.jobs()) {
      const std::lock_guard lock(mutex_);
      const std::string state(to_string(view.state));
      if (states_.emplace(view.id.value, state).second && !ended(state)) mark_open_locked(view.id);
    }
  }

  void look_again(Coordinator& coordinator, std::uint64_t event) {
    std::set<std::string> gone;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [job, state] : states_)
        if (!ended(state)) gone.insert(job);
    }
    for (const JobView& view : coordinator.jobs()) {
      gone.erase(view.id.value);
      changed(view.id.value, job_json(view), event);
    }
    for (const std::string& job : gone) changed(job, job_removed_json(JobId{job}), event);
  }

  void changed(const std::string& job, const std::string& data, std::uint64_t event) {
    if (frame_of(JobId{job})) return;  // a frame of a sequence: only the sequence as a whole is reported
    json view = json::parse(data, nullptr, false);
    if (!view.is_object() || !view.contains("state") || !view["state"].is_string()) return;
    const std::string state = view["state"].get<std::string>();
    const std::lock_guard lock(mutex_);
    auto& known = states_[job];
    if (known == state) return;
    const bool reopened = known.empty() || ended(known);
    known = state;
    if (state == "removed" || state == "moved") states_.erase(job);
    if (reopened && !ended(state)) mark_open_locked(JobId{job});
    send_locked(job, state, event, std::move(view));
    if (ended(state)) mark_ended_locked(JobId{job});
    woken_.notify_all();
  }

  void mark_open_locked(const JobId& job) {
    if (!open_.insert(job).second) return;
    if (const auto kept = outbox_.job_is_open(job); !kept) {
      open_.erase(job);
      log_error(fmt::format("job={}", job.value), "webhooks: " + kept.error().message);
    }
  }
  void mark_ended_locked(const JobId& job) {
    open_.erase(job);
    outbox_.job_has_ended(job);
  }

  void send_locked(const std::string& job, const std::string& state, std::uint64_t event, json view) {
    Delivery delivery;
    delivery.number = ++last_number_;
    delivery.id = fmt::format("{}/{}/{}", job, state, event);
    delivery.event = "job." + state;
    delivery.body = json{{"event", delivery.event}, {"id", delivery.id}, {"job", std::move(view)}}.dump(
        -1, ' ', false, json::error_handler_t::replace);
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      if (const auto kept = outbox_.keep(i, delivery); !kept)
        log_error(fmt::format("job={}", job), "a webhook would be lost by a crash: " + kept.error().message);
      if (const auto given_up = lines_[i].add(delivery)) give_up_locked(i, *given_up, "too many wait");
    }
  }

  void give_up_locked(std::size_t receiver, const Delivery& delivery, const std::string& why) {
    ++figures_.given_up;
    outbox_.forget(receiver, delivery);
    log_error(fmt::format("webhook={} delivery={}", receiver, log_value(delivery.id)), "given up: " + why);
  }

  void deliver(std::size_t receiver, const std::stop_token& token) {
    Line& line = lines_[receiver];
    std::unique_lock lock(mutex_);
    while (!token.stop_requested()) {
      const Delivery* next = line.due(options_.clock->now());
      if (!next) {
        wait(lock, line.next_due(), token);
        continue;
      }
      const Delivery sent = *next;  // a copy: while it is being sent, newer deliveries may push it out
      lock.unlock();
      const auto status = send(receiver, sent);
      lock.lock();
      next = line.due(options_.clock->now());
      if (next && next->number == sent.number) settle_locked(receiver, status);
    }
  }

  void wait(std::unique_lock<std::mutex>& lock, std::optional<TimePoint> until,
            const std::stop_token& token) {
    const auto have_new = [this, seen = last_number_] { return last_number_ != seen; };
    if (until)
      woken_.wait_for(lock, token, *until - options_.clock->now(), have_new);
    else
      woken_.wait(lock, token, have_new);
  }

  Result<int> send(std::size_t receiver, const Delivery& delivery) {
    const auto at = static_cast<std::int64_t>(options_.unix_time());
    return options_.send({options_.urls[receiver],
                          {{"Content-Type", "application/json"},
                           {"User-Agent", "lightshaft"},
                           {"Lightshaft-Event", delivery.event},
                           {"Lightshaft-Delivery", delivery.id},
                           {"Lightshaft-Signature", webhook_signature(options_.secret, at, delivery.body)}},
                          delivery.body});
  }

  void settle_locked(std::size_t receiver, const Result<int>& status) {
    Line& line = lines_[receiver];
    if (status && *status / 100 == 2) {
      ++figures_.delivered;
      outbox_.forget(receiver, *line.taken());
      return;
    }
    ++figures_.failed_attempts;
    const std::string why = status ? fmt::format("it answers {}", *status) : status.error().message;
    log_warn(fmt::format("webhook={} attempt={}", receiver, line.attempts() + 1),
             fmt::format("{} does not take a delivery: {}", options_.urls[receiver], why));
    if (const auto over = line.failed(options_.clock->now())) give_up_locked(receiver, *over, why);
  }

  Options options_;
  webhooks::Outbox outbox_;
  mutable std::mutex mutex_;
  std::condition_variable_any woken_;
  std::map<std::string, std::string> states_;  // by job, as last reported
  std::set<JobId> open_;                       // as in the outbox
  std::set<std::string> kept_;                 // JOB/STATE of the deliveries pending at the start
  std::deque<Line> lines_;                     // by receiver
  std::uint64_t last_number_ = 0;
  Figures figures_;
  std::shared_ptr<void> subscription_;
  std::vector<std::jthread> threads_;
};

}  // namespace

std::string webhook_signature(const std::string& secret, std::int64_t unix_seconds, const std::string& body) {
  return fmt::format("t={},v1={}", unix_seconds,
                     hmac_sha256(secret, fmt::format("{}.{}", unix_seconds, body)));
}

Result<std::unique_ptr<Webhooks>> Webhooks::start(Coordinator& coordinator, Options options) {
  for (const auto& url : options.urls)
    if (auto fine = webhooks::check_url(url); !fine) return tl::unexpected(fine.error());
  auto outbox = webhooks::Outbox::open(options.folder, options.urls);
  if (!outbox) return tl::unexpected(outbox.error());
  auto teller = std::make_unique<Teller>(std::move(options), std::move(*outbox));
  teller->start(coordinator);
  return teller;
}

}  // namespace ls::coordinator
