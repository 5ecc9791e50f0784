// The control thread of the agent, the part of a worker that talks to the coordinator. The thread keeps the
// connection, handles messages and timers, and ends the work when the worker drains (finishes its units and
// leaves).
#include <fmt/format.h>

#include <algorithm>

#include "core/base/failpoint.h"
#include "core/base/log.h"
#include "core/base/overloaded.h"
#include "util/protocol/limits.h"
#include "worker/agent/agent_impl.h"

namespace ls::worker {
namespace {
// The connection is given up if the Welcome of the coordinator does not arrive within this time.
constexpr Duration kWelcomeLimit = std::chrono::seconds(30);
// After a connection that lasted this long, the pauses between attempts to connect start at kFirstPause
// again.
constexpr Duration kGoodConnection = std::chrono::seconds(5);
// The first pause before a new attempt: after a lost connection, and after a problem of this machine such as
// a full disk.
constexpr Duration kFirstPause = std::chrono::milliseconds(100), kFirstTroublePause = std::chrono::seconds(1);
constexpr Duration kLongestWait = std::chrono::seconds(1);
constexpr Duration kRefusalShown = std::chrono::minutes(1);  // how long its activity names a refused restart
constexpr int kProgressWhenIdle = 5;  // an idle worker sends only every fifth progress report
// Number of cached files that the hello names. The coordinator remembers no more of them (kBlobsRemembered),
// and takes a longer hello from few workers at a time.
constexpr std::size_t kBlobsReported = 1024;
}  // namespace

Agent::Impl::Impl(AgentOptions o, CoordinatorLink& l, RenderBackend& b, BlobFiles& f, const Clock& c)
    : options(std::move(o)),
      link(l),
      backend(b),
      files(f),
      clock(c),
      backoff(kFirstPause, options.backoff_most, options.backoff_seed),
      briefs(options.brief_bytes),
      trouble_backoff(kFirstTroublePause, options.backoff_most, options.backoff_seed) {}

Result<void> Agent::Impl::run() {
  connection_timer = last_busy = clock.now();
  threads.emplace_back([this](std::stop_token token) { load_loop(token); });
  for (int i = 0; i < options.threads; ++i) slots.push_back(std::make_unique<RenderSlot>());
  for (auto& slot : slots)
    threads.emplace_back([this, &slot](std::stop_token token) { render_loop(*slot, token); });
  while (!ended) {
    std::deque<Arrival> arrivals = inbox->wait(until_next_timer());
    for (Arrival& arrival : arrivals) handle(arrival);
    if (stop_requested) break;
    look_at_backend();
    look_at_idleness();
    look_at_drain();
    if (connection == Connection::opening && clock.now() >= connection_timer) {
      link.close();
      connection_ended({Errc::unavailable, "the coordinator did not answer the hello"});
    }
    if (connection == Connection::down && clock.now() >= connection_timer && !ended) open_connection();
    for (FromWorker& message : due_messages()) {
      const auto* result = std::get_if<UnitResult>(&message);
      if (result && options.tracer) trace_sent(result->unit);
      link.send(std::move(message));
      if (result) failpoint("result-sent");
    }
    if (!ended) ended = verdict();
  }
  end_threads();
  return ended.value_or(Result<void>{});
}

void Agent::Impl::end_threads() {
  for (std::jthread& thread : threads) thread.request_stop();
  {
    const std::lock_guard lock(mutex);
    for (auto& slot : slots) slot->stop = true;
    stop_loading = true;
  }
  work.notify_all();
  link.close();
  backend.shutdown();
  threads.clear();
  if (gaps.count() > 0) log_info(fmt::format("worker={}", id.value), gaps.text());
}

void Agent::Impl::handle(Arrival& arrival) {
  if (arrival.connection != connection_count || connection == Connection::down) return;
  std::visit(overloaded{[this](ToWorker& message) { handle_message(message); },
                        [this](ConnectionLost& lost) { connection_ended(lost.why); }},
             arrival.what);
}

void Agent::Impl::handle_message(ToWorker& message) {
  std::visit(overloaded{
                 [this](Welcome& welcome) {
                   const std::lock_guard lock(mutex);
                   connection = Connection::up;
                   up_since = clock.now();
                   next_progress = up_since;
                   id = welcome.worker;
                   secret = welcome.secret;
                   if (draining) outgoing.push_front(WorkerDraining{.restarts = restarting});
                   log_info(fmt::format("worker={}", id.value), "joined the coordinator");
                 },
                 [this](Refused& refused) {
                   link.close();
                   if (!refused.retry) ended = tl::unexpected<Error>(refused.error);
                   connection_ended(refused.error);
                 },
                 [this](AssignLease& assign) { accept_lease(assign); },
                 [this](ResultAck& ack) {
                   if (ack.refused)
                     log_warn(fmt::format("job={} tile={} round={}", ack.unit.job.value, ack.unit.tile,
                                          ack.unit.round),
                              "result refused: " + ack.refused->message);
                   failpoint("acknowledged-seen");
                   const std::lock_guard lock(mutex);
                   outbox.acknowledge(ack.unit);
                   table.acknowledged(ack.unit, ack.refused.has_value());
                 },
                 [this](CancelJob& c) {
                   const std::lock_guard lock(mutex);
                   drop_work(c.job);
                   if (const auto it = jobs.find(c.job); it != jobs.end()) it->second.trouble.clear();
                 },
                 [this](CancelLease& c) {
                   const std::lock_guard lock(mutex);
                   table.drop_lease(c.lease);
                   stop_dropped_work();
                 },
                 [this](RecallLease& r) {
                   const std::lock_guard lock(mutex);
                   for (LeaseReturned& returned : table.return_waiting(r.lease))
                     outgoing.push_back(std::move(returned));
                   stop_dropped_work();
                 },
                 [this](DrainNow& d) { apply_drain(d); },
             },
             message);
  work.notify_all();
}

void Agent::Impl::connection_ended(const Error& why) {
  const std::lock_guard lock(mutex);
  const TimePoint now = clock.now();
  if (connection == Connection::up && now - up_since >= kGoodConnection) backoff.reset();
  connection = Connection::down;
  outbox.connection_lost();
  const Duration pause = backoff.next();
  connection_timer = now + pause;
  if (!ended && !(draining && outbox.empty()))
    log_warn(fmt::format("worker={}", id.empty() ? options.hello.name : id.value),
             fmt::format("no connection to the coordinator ({}); trying again in {:.1f} s", why.message,
                         seconds(pause)));
}

void Agent::Impl::open_connection() {
  WorkerHello hello = options.hello;
  hello.threads = options.threads;
  hello.numeric_class = backend.numeric_class();
  hello.platform = backend.platform();
  hello.blobs_held = files.held(kBlobsReported);
  hello.brief_bytes = options.brief_bytes;
  hello.restarts = options.may_restart != nullptr;
  hello.previous_id = id;
  hello.secret = secret;
  {
    const std::lock_guard lock(mutex);
    connection = Connection::opening;
    briefs.clear();
  }
  connection_timer = clock.now() + kWelcomeLimit;
  const auto connected = link.connect(hello, std::make_shared<InboxObserver>(inbox, ++connection_count));
  if (!connected) connection_ended(connected.error());
}

void Agent::Impl::accept_lease(AssignLease& assign) {
  failpoint("lease-received");
  const std::lock_guard lock(mutex);
  const JobId& id = assign.lease.job;
  if (assign.brief) {
    const auto it = jobs.find(id);
    // A brief describes a job (its settings and files). If the id is known but the brief differs, the
    // coordinator's data were replaced and this is a different job.
    if (it != jobs.end() && it->second.brief != *assign.brief) {
      drop_work(id);
      jobs.erase(it);
      backend.forget(id);
    }
    jobs.try_emplace(id, Job{.brief = *assign.brief}).first->second.last_use = ++uses;
  }
  briefs.leased(id, assign.brief ? std::optional(memory_of(*assign.brief)) : std::nullopt);
  const bool unknown = !jobs.contains(id), too_many = table.lease_count() >= limits::kLeasesPerWorker;
  if (draining || unknown || too_many) {
    LeaseReturned returned{.lease = assign.lease.id, .unknown_job = unknown};
    if (!draining && too_many) returned.reason = "it holds too many leases already";
    for (const LeaseUnit& unit : assign.lease.units)
      returned.unrendered.push_back({id, unit.tile, unit.round});
    outgoing.push_back(std::move(returned));
    return;
  }
  const bool traced = options.tracer && assign.trace && assign.trace->sampled;
  table.add(
      assign.lease, [this](const UnitKey& key) { return outbox.has_result(key); },
      traced ? assign.trace : std::nullopt, traced ? options.tracer->unix_ns(clock.now()) : 0);
  if (jobs.size() <= briefs.size()) return;
  std::erase_if(jobs, [this](const auto& known) {
    return known.second.state == Job::State::idle && known.second.lost.empty() && !briefs.has(known.first) &&
           !table.holds(known.first);
  });
}

void Agent::Impl::drop_work(const JobId& job) {
  table.drop_job(job);
  outbox.drop_job(job);
  std::erase_if(unsent, [&](const auto& one) { return one.first.job == job; });
  stop_dropped_work();
}

void Agent::Impl::stop_dropped_work() {
  for (auto& slot : slots)
    if (slot->unit && !table.is_running(*slot->unit)) slot->stop = true;
  if (loaded_job && !table.holds(*loaded_job)) stop_loading = true;
}

void Agent::Impl::look_at_backend() {
  const auto error = backend.broken();
  const std::lock_guard lock(mutex);
  if (!error || broken) return;
  broken = error;
  drain_requested = true;
}

void Agent::Impl::look_at_idleness() {
  if (options.idle_limit == Duration::zero()) return;
  const TimePoint now = clock.now();
  const std::lock_guard lock(mutex);
  if (table.lease_count() > 0 || !outbox.empty()) last_busy = now;
  if (draining || drain_requested || now - last_busy < options.idle_limit) return;
  const double limit = seconds(options.idle_limit);
  if (id.value.empty()) {
    ended = fail(Errc::unavailable, fmt::format("did not join the coordinator within {:.0f} s", limit));
    return;
  }
  log_info(fmt::format("worker={}", id.value), fmt::format("no work for {:.0f} s", limit));
  drain_requested = true;
}

void Agent::Impl::apply_drain(const DrainNow& asked) {
  const auto possible = !asked.restart        ? Result<void>{}
                        : options.may_restart ? options.may_restart()
                                              : fail(Errc::failed_precondition, "this worker cannot restart");
  if (possible) {
    drain_asked = asked.withdrawn ? std::nullopt : std::optional(asked);
    return;
  }
  log_warn(fmt::format("worker={}", id.value), "does not restart, and works on: " + possible.error().message);
  const std::lock_guard lock(mutex);
  outgoing.push_back(WorkerDraining{!draining, restarting, possible.error().message});
  restart_refused = possible.error().message;
  restart_refused_until = clock.now() + kRefusalShown;
}

void Agent::Impl::look_at_drain() {
  const std::lock_guard lock(mutex);
  const bool wanted = drain_requested || drain_asked;
  const bool anew = !drain_requested && drain_asked && drain_asked->restart;
  if (draining == wanted && restarting == anew) return;
  if (draining != wanted) drain_deadline = clock.now() + options.drain_limit;
  draining = wanted;
  restarting = anew;
  outgoing.push_back(WorkerDraining{.withdrawn = !wanted, .restarts = anew});
  if (draining)
    for (LeaseReturned& returned : table.return_waiting()) outgoing.push_back(std::move(returned));
  work.notify_all();
  log_info(fmt::format("worker={}", id.value),
           restarting ? "draining for a restart: finishing the units in hand"
           : draining ? "draining: finishing the units in hand"
                      : "the coordinator has withdrawn the drain: taking units again");
}

std::vector<FromWorker> Agent::Impl::due_messages() {
  const std::lock_guard lock(mutex);
  if (connection != Connection::up) return {};
  std::vector<FromWorker> messages = outbox.take_unsent();
  for (FromWorker& message : outgoing) messages.push_back(std::move(message));
  outgoing.clear();
  const TimePoint now = clock.now();
  if (now >= next_progress) {
    WorkerProgress p = progress();
    next_progress = now + options.progress_period * (p.leases.empty() ? kProgressWhenIdle : 1);
    messages.push_back(std::move(p));
  }
  return messages;
}

WorkerProgress Agent::Impl::progress() const {
  WorkerProgress p;
  p.leases = table.progress();
  const std::string bad =
      clock.now() < restart_refused_until ? "does not restart: " + restart_refused : trouble();
  p.activity = restarting            ? "draining for a restart"
               : draining            ? "draining"
               : !bad.empty()        ? bad
               : table.running() > 0 ? "rendering"
               : !loading.empty()    ? "loading " + loading
                                     : "idle";
  p.cpu_seconds_total = cpu_seconds;
  p.rss_bytes = backend.rss_bytes();
  p.load_seconds = load_seconds;
  return p;
}

std::optional<Result<void>> Agent::Impl::verdict() {
  const std::lock_guard lock(mutex);
  if (!draining) return std::nullopt;
  const bool rendering =
      std::any_of(slots.begin(), slots.end(), [](const auto& slot) { return slot->unit.has_value(); });
  if (!rendering && outbox.empty() && (outgoing.empty() || connection != Connection::up))
    return broken ? Result<void>(tl::unexpected<Error>(*broken)) : Result<void>{};
  if (clock.now() < drain_deadline) return std::nullopt;
  const std::string lost = fmt::format(
      "gave up draining after {:.0f} s: {} finished units could not be delivered; other workers will render "
      "them again",
      seconds(options.drain_limit), outbox.size());
  if (!restarting) return fail(Errc::unavailable, lost);
  log_warn(fmt::format("worker={}", id.value), lost);
  return Result<void>{};
}

void Agent::Impl::record(const char* name, const trace::SpanContext& parent, TimePoint begin, TimePoint end,
                         trace::Attributes attributes, bool failed) const {
  options.tracer->record({.context = {parent.trace, options.tracer->new_span_id(), true},
                          .parent = parent.span,
                          .name = name,
                          .start_ns = options.tracer->unix_ns(begin),
                          .end_ns = options.tracer->unix_ns(std::max(begin, end)),
                          .attributes = std::move(attributes),
                          .failed = failed});
}

void Agent::Impl::trace_sent(const UnitKey& unit) {
  Unsent sent;
  {
    const std::lock_guard lock(mutex);
    const auto found = unsent.find(unit);
    if (found == unsent.end()) return;  // the lease is not traced, or the result was sent before
    sent = found->second;
    unsent.erase(found);
  }
  record("send partial", sent.lease, sent.since, clock.now(), {{"lightshaft.job", unit.job.value}});
}

Duration Agent::Impl::until_next_timer() const {
  const TimePoint now = clock.now();
  TimePoint next = now + kLongestWait;
  if (connection == Connection::up) {
    const std::lock_guard lock(mutex);
    const bool working = table.lease_count() > 0;
    next = std::min(next, working ? std::min(next_progress, now + options.progress_period) : next_progress);
  } else {
    next = std::min(next, connection_timer);
  }
  if (draining) next = std::min(next, drain_deadline);
  return std::max(next - now, Duration::zero());
}

Agent::Agent(AgentOptions options, CoordinatorLink& link, RenderBackend& backend, BlobFiles& files,
             const Clock& clock)
    : impl_(std::make_unique<Impl>(std::move(options), link, backend, files, clock)) {}
Agent::~Agent() = default;

Result<void> Agent::run() { return impl_->run(); }

void Agent::drain() {
  impl_->drain_requested = true;
  impl_->inbox->nudge();
}

bool Agent::to_restart() const {
  return impl_->restarting && !impl_->drain_requested && !impl_->stop_requested;
}

void Agent::stop() {
  impl_->stop_requested = true;
  impl_->inbox->nudge();
}

void Agent::wake() { impl_->inbox->nudge(); }

}  // namespace ls::worker
