// Workers: how they join, what messages they send, and how they leave.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <future>
#include <random>

#include "common/base/failpoint.h"
#include "common/base/log.h"
#include "common/base/overloaded.h"
#include "common/protocol/limits.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/views/views.h"

namespace ls::coordinator {
namespace {

class Session final : public WorkerSession {
 public:
  Session(Service& service, std::shared_ptr<Connection> connection)
      : service_(service), connection_(std::move(connection)) {}
  ~Session() override { disconnected(); }
  void receive(FromWorker message) override {
    // This blocks until there is room or the coordinator ends (then the promise is broken).
    auto room = std::make_shared<std::promise<void>>();
    const auto granted = room->get_future();
    receive(std::move(message), [room = std::move(room)] { room->set_value(); });
    granted.wait();
  }
  void receive(FromWorker message, std::function<void()> next) override {
    if (*connection_->service_lives) service_.receive(connection_, std::move(message), std::move(next));
  }
  void disconnected() override {
    if (*connection_->service_lives) service_.disconnected(connection_);
  }

 private:
  Service& service_;
  std::shared_ptr<Connection> connection_;
};

Result<void> check_hello(const WorkerHello& hello, const JoinCheck& may_join, bool allow_fake) {
  if (!may_join(hello.join_token))
    return fail(Errc::unauthenticated,
                "the join token is missing or wrong; the coordinator keeps it in the file `join-token` of "
                "its data folder");
  if (hello.protocol != kProtocolVersion)
    return fail(Errc::failed_precondition,
                fmt::format("this worker speaks protocol {}, the coordinator {}: use the same build on both",
                            hello.protocol, kProtocolVersion));
  if (hello.fake && !allow_fake)
    return fail(
        Errc::failed_precondition,
        "this worker runs with --fake: it makes pixels up instead of rendering. Start it without --fake, "
        "or, for tests, start the coordinator with --allow-fake");
  if (hello.name.size() > ls::limits::kNameBytes || hello.build.size() > ls::limits::kNameBytes ||
      hello.previous_id.value.size() > ls::limits::kIdBytes)
    return fail(Errc::invalid_argument, "the worker's name, build or id is too long");
  if (hello.tags.size() > limits::kMaxTags)
    return fail(Errc::invalid_argument,
                fmt::format("{} tags are more than {}", hello.tags.size(), limits::kMaxTags));
  if (hello.threads < 1 || hello.threads > ls::limits::kThreads)
    return fail(Errc::invalid_argument,
                fmt::format("{} threads: it must be 1 to {}", hello.threads, ls::limits::kThreads));
  return {};
}

bool well_formed(const WorkerId& id) {
  return id.value.starts_with("w-") && std::all_of(id.value.begin() + 2, id.value.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || c == '-';
         });
}

// Makes the id of a new worker. A client that names an id gets the stream of that worker, so that the worker
// can continue after a broken connection. Therefore ids must not be guessable.
std::string new_worker_id(std::uint64_t start, std::uint64_t number) {
  std::random_device device;
  const std::uint64_t secret = (std::uint64_t{device()} << 32 | device()) & 0xffff'ffff'ffff;
  return fmt::format("w-{:x}-{:x}-{:012x}", start, number, secret);
}

// Returns n of a lease id "PREFIX-n"; nullopt if the lease is of another start of the coordinator.
std::optional<std::uint64_t> lease_number(const LeaseId& id, const std::string& prefix) {
  const std::size_t dash = prefix.size();
  if (!id.value.starts_with(prefix) || id.value.size() <= dash || id.value[dash] != '-') return std::nullopt;
  std::uint64_t n = 0;
  const char* end = id.value.data() + id.value.size();
  const auto parsed = std::from_chars(id.value.data() + dash + 1, end, n);
  return parsed.ec == std::errc() && parsed.ptr == end ? std::optional(n) : std::nullopt;
}

}  // namespace

Result<std::unique_ptr<WorkerSession>> Service::connect(const WorkerHello& hello,
                                                        std::shared_ptr<WorkerSink> sink) {
  if (auto ok = check_hello(hello, options_.may_join, options_.allow_fake); !ok)
    return tl::unexpected(ok.error());
  const std::lock_guard lock(mutex_);
  WorkerId id = hello.previous_id;
  const auto known = workers_.find(id);
  // The worker may have its id from a copied folder. Then the id stays with the worker that uses it already,
  // and this one gets a new id.
  const bool taken = known != workers_.end() && known->second.hello.name != hello.name;
  if (id.empty() || !well_formed(id) || taken) id.value = new_worker_id(start_, last_epoch_ & 0xffffffff);
  if (workers_.size() >= limits::kMaxWorkers && !workers_.contains(id))
    return fail(Errc::resource_exhausted,
                fmt::format("{} workers are known; more are not taken", workers_.size()));

  auto connection = std::make_shared<Connection>();
  connection->worker = id;
  connection->epoch = ++last_epoch_;
  connection->numeric_class = hello.numeric_class;
  connection->fake = hello.fake;
  connection->sink = std::move(sink);
  connection->service_lives = alive_;
  WorkerEntry& worker = workers_[id];
  if (worker.connection && worker.connection->open) {
    worker.connection->open = false;
    worker.connection->sink->close();
  }
  worker.hello = hello;
  worker.hello.join_token.clear();
  worker.hello.blobs_held.clear();  // the farm keeps those that it needs
  worker.connection = connection;
  worker.last_seen = now();
  connection->sink->send(Welcome{id, connection->epoch});
  log_info(fmt::format("worker={} name={} epoch={}", id.value, log_value(hello.name), connection->epoch),
           "joined");
  run_locked(WorkerJoined{id, connection->epoch, hello.name, hello.numeric_class, hello.threads, hello.tags,
                          hello.memory_bytes, hello.blobs_held});
  return std::make_unique<Session>(*this, std::move(connection));
}

void Service::disconnected(const std::shared_ptr<Connection>& connection) {
  const std::lock_guard lock(mutex_);
  const bool was_open = std::exchange(connection->open, false);
  if (!was_open) return;
  log_info(fmt::format("worker={} epoch={}", connection->worker.value, connection->epoch), "disconnected");
  run_locked(WorkerLost{connection->worker, connection->epoch});
}

void Service::receive(const std::shared_ptr<Connection>& from, FromWorker message,
                      std::function<void()> next) {
  if (auto* result = std::get_if<UnitResult>(&message)) {
    {
      const std::lock_guard lock(mutex_);
      if (const auto w = workers_.find(from->worker); w != workers_.end()) w->second.last_seen = now();
    }
    return receive_result(from, std::move(*result), std::move(next));
  }
  {
    const std::lock_guard lock(mutex_);
    receive_locked(from, std::move(message));
  }
  next();
}

void Service::receive_locked(const std::shared_ptr<Connection>& from, FromWorker message) {
  const auto found = workers_.find(from->worker);
  if (!from->open || found == workers_.end()) return;
  found->second.last_seen = now();
  std::visit(overloaded{[](const UnitResult&) {},
                        [](const WorkerHello&) {},  // handled by connect(); a second one is rejected earlier
                        [&](const WorkerProgress& m) { on_message_locked(from, m); },
                        [&](const UnitFailure& m) {
                          // The acknowledgement goes first, so that the worker does not take it for the
                          // answer to its next attempt.
                          from->sink->send(ResultAck{m.unit, std::nullopt});
                          if (!find_locked(m.unit.job)) return;  // no log for a job that does not exist
                          log_job(m.unit.job, fmt::format("tile {} round {} failed on {}: {}", m.unit.tile,
                                                          m.unit.round, from->worker.value, m.reason));
                          run_locked(UnitFailed{from->worker, m});
                        },
                        [&](const LeaseReturned& m) {
                          run_locked(LeaseCameBack{from->worker, m});
                        },
                        [&](const WorkerDraining&) { run_locked(WorkerDrains{from->worker}); }},
             message);
}

void Service::on_message_locked(const std::shared_ptr<Connection>& from, const WorkerProgress& m) {
  WorkerEntry& worker = workers_[from->worker];
  worker.activity = m.activity.substr(0, ls::limits::kNameBytes);
  worker.cpu_seconds = m.cpu_seconds_total;
  worker.rss_bytes = m.rss_bytes;
  if (const auto entry = find_locked(worker.last_job)) {
    JobTotals& totals = entry->stored.totals;
    totals.peak_rss_bytes = std::max(totals.peak_rss_bytes, m.rss_bytes);
    if (m.load_seconds < 1e9) totals.load_seconds = std::max(totals.load_seconds, m.load_seconds);
  }
  // The worker may still report leases of an earlier stream; their units went to others when that stream
  // broke.
  for (const auto& lease : m.leases) {
    const auto n = lease_number(lease.lease, lease_prefix());
    const bool ours = n && from->first_lease && *n >= *from->first_lease;
    if (!ours && from->open) from->sink->send(CancelLease{lease.lease});
  }
  run_locked(LeaseProgress{from->worker, m.leases});
  publish_worker_locked(from->worker, false);
}

void Service::on(const Send& e, Todo&) {
  const auto found = workers_.find(e.worker);
  if (found == workers_.end() || !found->second.connection || !found->second.connection->open) return;
  Connection& connection = *found->second.connection;
  if (const auto* assign = std::get_if<AssignLease>(&e.message)) {
    const Lease& lease = assign->lease;
    ++figures_.leases_granted;
    figures_.units_leased += lease.units.size();
    if (!connection.first_lease) connection.first_lease = lease_number(lease.id, lease_prefix());
    found->second.last_job = lease.job;
    if (const auto entry = find_locked(lease.job)) note_leased_locked(*entry, lease, e.worker);
  }
  connection.sink->send(e.message);
  if (std::holds_alternative<AssignLease>(e.message)) failpoint("lease-sent");
}

void Service::note_leased_locked(JobEntry& entry, const Lease& lease, const WorkerId& worker) {
  for (const LeaseUnit& unit : lease.units) {
    auto& holders = entry.leased[{unit.tile, unit.round}];
    if (std::find(holders.begin(), holders.end(), worker) == holders.end()) holders.push_back(worker);
    hub_->publish("tile",
                  tile_event_json(lease.job, unit.tile, unit.rect, "leased", unit.samples.s0, worker.value),
                  lease.job.value, entry.stored.owner);
  }
}

void Service::on(const WorkerStateChanged& e, Todo&) {
  log_info(fmt::format("worker={} state={}", e.worker.value, to_string(e.to)), e.why);
  if (e.to == WorkerState::unhealthy) log_error(fmt::format("worker={}", e.worker.value), "sick: " + e.why);
  if (const auto w = workers_.find(e.worker); w != workers_.end())
    w->second.trouble = e.to == WorkerState::unhealthy ? e.why : "";
  publish_worker_locked(e.worker, true);
}

void Service::on(const WorkerBlocked& e, Todo&) {
  log_warn(fmt::format("worker={} job={}", e.worker.value, e.job.value),
           "gets no more of this job: " + e.why);
  log_job(e.job, fmt::format("worker {} gets no more of it: {}", e.worker.value, e.why));
}

// A faulty worker is stored apart from the jobs, and for longer: none of its results is accepted after a
// restart, or in jobs that are extended then. Until it is stored every job waits, since a restart would
// accept the worker's results that are in the log.
void Service::on(const WorkerFoundFaulty& e, Todo& todo) {
  log_error(fmt::format("worker={} job={} tile={} round={}", e.worker.value, e.unit.job.value, e.unit.tile,
                        e.unit.round),
            "barred: " + e.evidence);
  quarantined_unsaved_.push_back({e.worker, e.evidence});
  if (const auto saved = save_quarantined_locked(); !saved)
    for (const auto& [id, entry] : entries_) {
      if (entry->unloaded || !entry->assembly) continue;
      entry->trouble = saved.error().message;
      todo.push_back(JobPaused{id});
    }
  log_job(e.unit.job, fmt::format("worker {} is barred: {}", e.worker.value, e.evidence));
}

Result<void> Service::save_quarantined_locked() {
  while (!quarantined_unsaved_.empty()) {
    if (const auto kept = store_->quarantine(quarantined_unsaved_.back()); !kept) {
      store_trouble_ = kept.error().message;
      log_error(fmt::format("worker={}", quarantined_unsaved_.back().worker.value), kept.error().message);
      return fail(
          Errc::unavailable,
          fmt::format("that a worker is barred cannot be stored: {}; then resume the job", store_trouble_));
    }
    quarantined_unsaved_.pop_back();
  }
  return {};
}

void Service::apply_quarantine_locked(const std::vector<QuarantinedWorker>& workers) {
  for (const QuarantinedWorker& one : workers) run_locked(WorkerQuarantined{one.worker, one.evidence});
}

void Service::on(const TileDiscarded& e, Todo&) {
  const auto entry = find_locked(e.job);
  if (!entry || !entry->assembly) return;
  entry->assembly->discard(e.tile);
  if (entry->reference_tiles) entry->reference_tiles->discard(e.tile);
  forget_curve_locked(*entry);
  log_job(e.job, fmt::format("tile {} is rendered again from its first round", e.tile));
  if (restoring_) return;
  hub_->publish("tile", tile_event_json(e.job, e.tile, entry->grid.rect(e.tile), "free", 0, ""), e.job.value,
                entry->stored.owner);
}

void Service::on(const WorkerForgotten& e, Todo&) {
  workers_.erase(e.worker);
  hub_->publish("worker", worker_gone_json(e.worker), "");
}

void Service::publish_worker_locked(const WorkerId& id, bool at_once) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  if (!at_once && seconds(now() - found->second.last_event) < 1) return;
  found->second.last_event = now();
  const WorkerView view = view_locked(id, found->second);
  const auto job = find_locked(JobId{view.job});
  hub_->publish("worker", worker_json(view), "", job ? job->stored.owner : "");
}

}  // namespace ls::coordinator
