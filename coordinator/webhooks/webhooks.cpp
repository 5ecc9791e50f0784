#include "coordinator/webhooks/webhooks.h"

#include <fmt/format.h>

#include <condition_variable>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "coordinator/views/views.h"
#include "coordinator/webhooks/webhook_outbox.h"
#include "core/base/guarded.h"
#include "core/base/log.h"
#include "core/base/secret.h"

namespace ls::coordinator {
namespace webhooks {
struct State;
}
namespace {

using nlohmann::json;
using webhooks::Delivery;
using webhooks::Line;

// Bytes of an answer that are read; the rest is left to the receiver. Only its status counts.
constexpr std::size_t kMostAnswer = 64u << 10;

bool ended(const std::string& state) {
  return state == "done" || state == "failed" || state == "cancelled" || state == "removed" ||
         state == "moved";
}

// Returns "https://HOST" of an address: its user, path and query are often the secret that lets one post
// there.
std::string host_of(const std::string& url) {
  const std::size_t scheme = url.find("://");
  if (scheme == std::string::npos) return "the receiver";
  const std::string host = url.substr(scheme + 3, url.find_first_of("/?#", scheme + 3) - scheme - 3);
  const std::size_t user = host.rfind('@');
  return url.substr(0, scheme + 3) + (user == std::string::npos ? host : host.substr(user + 1));
}

}  // namespace

// The last reported states of jobs, and the notifications that must still be sent.
struct webhooks::State {
  explicit State(webhooks::Outbox kept) : outbox(std::move(kept)), open(outbox.open_jobs()) {}

  void mark_open(const JobId& job) {
    if (!open.insert(job).second) return;
    if (const auto kept = outbox.job_is_open(job); !kept) {
      open.erase(job);
      log_error(fmt::format("job={}", job.value), "webhooks: " + kept.error().message);
    }
  }
  void mark_ended(const JobId& job) {
    open.erase(job);
    outbox.job_has_ended(job);
  }

  // Stores the notification of a job's new state for every receiver, and appends it to the receivers' queues.
  void add(const std::string& job, const std::string& state, std::uint64_t event, json view) {
    Delivery delivery;
    delivery.number = ++last_number;
    delivery.id = fmt::format("{}/{}/{}", job, state, event);
    delivery.event = "job." + state;
    delivery.body = json{{"event", delivery.event}, {"id", delivery.id}, {"job", std::move(view)}}.dump(
        -1, ' ', false, json::error_handler_t::replace);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (const auto kept = outbox.keep(i, delivery); !kept)
        log_error(fmt::format("job={}", job), "a webhook would be lost by a crash: " + kept.error().message);
      if (const auto given_up = lines[i].add(delivery)) give_up(i, *given_up, "too many wait");
    }
  }

  // Applies the answer to the first delivery of the receiver's queue: removes the delivery if it was
  // accepted, otherwise counts a failed attempt.
  void settle(std::size_t receiver, const std::string& url, const Result<HttpAnswer>& answer, TimePoint now) {
    Line& line = lines[receiver];
    if (answer && answer->status / 100 == 2) {
      ++figures.delivered;
      outbox.forget(receiver, *line.taken());
      return;
    }
    ++figures.failed_attempts;
    const std::string why = answer ? fmt::format("it answers {}", answer->status) : answer.error().message;
    log_warn(fmt::format("webhook={} attempt={}", receiver, line.attempts() + 1),
             fmt::format("{} does not take a delivery: {}", host_of(url), why));
    if (const auto over = line.failed(now)) give_up(receiver, *over, why);
  }

  void give_up(std::size_t receiver, const Delivery& delivery, const std::string& why) {
    ++figures.given_up;
    outbox.forget(receiver, delivery);
    log_error(fmt::format("webhook={} delivery={}", receiver, log_value(delivery.id)), "given up: " + why);
  }

  webhooks::Outbox outbox;
  std::set<JobId> open;                       // jobs that have a file open/JOB in the outbox
  std::map<std::string, std::string> states;  // last reported state, by job id
  std::deque<Line> lines;                     // one queue per receiver, in the order of Options::urls
  std::uint64_t last_number = 0;
  WebhookFigures figures;
};

class Webhooks::Impl {
 public:
  Impl(Options options, webhooks::Outbox outbox) : options_(std::move(options)), state_(std::move(outbox)) {
    if (!options_.send) options_.send = &post;
    const auto state = state_.lock();
    for (std::size_t i = 0; i < options_.urls.size(); ++i) {
      state->lines.emplace_back();
      for (auto& delivery : state->outbox.waiting(i)) {
        state->last_number = std::max(state->last_number, delivery.number);
        kept_.insert(delivery.id.substr(0, delivery.id.rfind('/')));
        state->lines.back().add(std::move(delivery));
      }
    }
  }

  ~Impl() {
    subscription_.reset();  // waits for a running callback; then there are no more
    for (auto& thread : threads_) thread.request_stop();
  }

  void start(Coordinator& coordinator) {
    coordinator_ = &coordinator;
    // The subscription begins before catch_up() reads the states of the jobs, so that no change is missed.
    std::uint64_t last = coordinator.last_event_id();
    subscription_ = coordinator.subscribe(last, [this, &coordinator, last](const StreamEvent& event) mutable {
      // The coordinator keeps a limited number of events. A gap in the ids means that it dropped events while
      // this callback waited for the disk. Then look_again() reads the states of all jobs instead.
      if (event.id != last + 1) look_again(coordinator, event.id);
      last = event.id;
      if (event.type == "job") changed(event.job, event.data, event.id);
    });
    catch_up(coordinator);
    for (std::size_t i = 0; i < options_.urls.size(); ++i)
      threads_.emplace_back([this, i](const std::stop_token& token) { deliver(i, token); });
  }

  WebhookFigures figures() const {
    const auto state = state_.lock();
    WebhookFigures f = state->figures;
    for (const Line& line : state->lines) f.waiting += line.waiting();
    return f;
  }

 private:
  // Reports the end of those jobs whose end the previous process could not report because it was killed. Then
  // notes the present states of all jobs, so that only later changes are reported.
  void catch_up(Coordinator& coordinator) {
    const std::set<JobId> open = state_.lock()->outbox.open_jobs();
    for (const JobId& job : open) {
      const auto view = coordinator.job(job);
      const std::string word(view ? to_string(view->state) : "");
      // In two cases the end of the job is recorded without a new notification. Either the job does not exist
      // any more, or the previous process was killed after it had stored the notification of the end, but
      // before it recorded the end. In the latter case the notification is in kept_.
      if (!view || kept_.contains(job.value + "/" + word)) {
        const auto state = state_.lock();
        state->mark_ended(job);
        if (view) state->states.emplace(job.value, word);
      } else if (ended(word)) {
        changed(job.value, job_json(*view), 0);
      }
    }
    for (const JobView& view : coordinator.jobs()) {
      const auto state = state_.lock();
      const std::string word(to_string(view.state));
      if (state->states.emplace(view.id.value, word).second && !ended(word)) state->mark_open(view.id);
    }
  }

  void look_again(Coordinator& coordinator, std::uint64_t event) {
    std::set<std::string> gone;
    {
      const auto state = state_.lock();
      for (const auto& [job, word] : state->states)
        if (!ended(word)) gone.insert(job);
    }
    for (const JobView& view : coordinator.jobs()) {
      gone.erase(view.id.value);
      changed(view.id.value, job_json(view), event);
    }
    for (const std::string& job : gone) changed(job, job_removed_json(JobId{job}), event);
  }

  void changed(const std::string& job, const std::string& data, std::uint64_t event) {
    if (frame_of(JobId{job})) return;  // a sequence is reported as a whole, not frame by frame
    json view = json::parse(data, nullptr, false);
    if (!view.is_object() || !view.contains("state") || !view["state"].is_string()) return;
    const std::string word = view["state"].get<std::string>();
    const auto state = state_.lock();
    auto& known = state->states[job];
    if (known == word) return;
    const bool reopened = known.empty() || ended(known);
    known = word;
    if (word == "removed" || word == "moved") state->states.erase(job);
    if (reopened && !ended(word)) state->mark_open(JobId{job});
    state->add(job, word, event, std::move(view));
    if (ended(word)) state->mark_ended(JobId{job});
    woken_.notify_all();
  }

  void deliver(std::size_t receiver, const std::stop_token& token) {
    auto state = state_.lock();
    while (!token.stop_requested()) {
      const Delivery* next = state->lines[receiver].due(options_.clock->now());
      if (!next) {
        wait(state, state->lines[receiver].next_due(), token);
        continue;
      }
      // Sends a copy: during the attempt the lock is free, and newer deliveries may push this one out of a
      // full queue.
      const Delivery sent = *next;
      state.unlock();
      const auto answer = send(receiver, sent);
      state.lock();
      next = state->lines[receiver].due(options_.clock->now());
      if (next && next->number == sent.number)
        state->settle(receiver, options_.urls[receiver], answer, options_.clock->now());
    }
  }

  void wait(Guarded<webhooks::State>::Lock& state, std::optional<TimePoint> until,
            const std::stop_token& token) {
    const auto have_new = [&, seen = state->last_number] { return state->last_number != seen; };
    if (until)
      woken_.wait_for(state, token, *until - options_.clock->now(), have_new);
    else
      woken_.wait(state, token, have_new);
  }

  Result<HttpAnswer> send(std::size_t receiver, const Delivery& delivery) {
    const auto at = static_cast<std::int64_t>(options_.unix_time());
    HttpPost request{options_.urls[receiver],
                     {{"Content-Type", "application/json"},
                      {"User-Agent", "lightshaft"},
                      {"Lightshaft-Event", delivery.event},
                      {"Lightshaft-Delivery", delivery.id},
                      {"Lightshaft-Signature", webhook_signature(options_.secret, at, delivery.body)}},
                     delivery.body};
    request.most_answer_bytes = kMostAnswer;
    const std::string job = delivery.id.substr(0, delivery.id.find('/'));
    const auto parent = options_.tracer ? coordinator_->trace_of(JobId{job}) : std::nullopt;
    if (!parent) return options_.send(request);
    const trace::SpanContext own{parent->trace, options_.tracer->new_span_id(), true};
    request.headers.emplace_back("traceparent", to_traceparent(own));
    const TimePoint begin = options_.clock->now();
    auto answer = options_.send(request);
    // The span does not contain the receiver's address, which may include a secret.
    options_.tracer->record(
        {.context = own,
         .parent = parent->span,
         .name = "deliver webhook",
         .kind = trace::SpanKind::client,
         .start_ns = options_.tracer->unix_ns(begin),
         .end_ns = options_.tracer->unix_ns(options_.clock->now()),
         .attributes = {{"lightshaft.job", job},
                        {"lightshaft.event", delivery.event},
                        {"http.response.status_code", std::int64_t{answer ? answer->status : 0}}},
         .failed = !answer || answer->status / 100 != 2});
    return answer;
  }

  Options options_;
  Coordinator* coordinator_ = nullptr;
  std::set<std::string> kept_;  // "JOB/STATE" (id and new state) of each delivery found on disk at start-up
  mutable Guarded<webhooks::State> state_;
  std::condition_variable_any woken_;
  std::shared_ptr<void> subscription_;
  std::vector<std::jthread> threads_;
};

Webhooks::Webhooks(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Webhooks::~Webhooks() = default;
WebhookFigures Webhooks::figures() const { return impl_->figures(); }

std::string webhook_signature(const std::string& secret, std::int64_t unix_seconds, const std::string& body) {
  return fmt::format("t={},v1={}", unix_seconds,
                     hmac_sha256(secret, fmt::format("{}.{}", unix_seconds, body)));
}

Result<std::unique_ptr<Webhooks>> Webhooks::start(Coordinator& coordinator, Options options) {
  for (const auto& url : options.urls)
    if (auto fine = check_http_url(url, "--webhook"); !fine) return tl::unexpected(fine.error());
  auto outbox = webhooks::Outbox::open(options.folder, options.urls);
  if (!outbox) return tl::unexpected(outbox.error());
  auto impl = std::make_unique<Impl>(std::move(options), std::move(*outbox));
  impl->start(coordinator);
  return std::unique_ptr<Webhooks>(new Webhooks(std::move(impl)));
}

}  // namespace ls::coordinator
