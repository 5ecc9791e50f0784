#include "coordinator/service/worker_sessions.h"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <random>

#include "coordinator/service/core.h"
#include "core/base/log.h"
#include "core/base/overloaded.h"
#include "core/base/secret.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {

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
        "this worker runs with --fake: it invents pixels instead of rendering. Start it without --fake, "
        "or, for tests, start the coordinator with --allow-fake");
  if (hello.name.size() > ls::limits::kNameBytes || hello.build.size() > ls::limits::kNameBytes ||
      hello.previous_id.value.size() > ls::limits::kIdBytes)
    return fail(Errc::invalid_argument, "the worker's name, build or id is too long");
  if (hello.tags.size() > ls::limits::kTags)
    return fail(Errc::invalid_argument, fmt::format("the worker has {} tags; at most {} are allowed",
                                                    hello.tags.size(), ls::limits::kTags));
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

// Digits of the last part of a worker's id. The longer ones are given to workers of an older version: they
// show nothing but their id when they connect again, so anyone who guessed it could take over their stream.
constexpr std::size_t kDigitsWithSecret = 8, kDigitsWithoutSecret = 12;

// True if a worker must show its secret to get this id again.
bool needs_secret(const WorkerId& id) {
  return id.value.size() - id.value.rfind('-') - 1 == kDigitsWithSecret;
}

// Makes the id of a new worker.
std::string new_worker_id(std::uint64_t start, std::uint64_t number, bool keeps_secret) {
  std::random_device device;
  const std::uint64_t random = std::uint64_t{device()} << 32 | device();
  return fmt::format(
      "w-{:x}-{:x}-{}", start, number,
      fmt::format("{:016x}", random).substr(0, keeps_secret ? kDigitsWithSecret : kDigitsWithoutSecret));
}

}  // namespace

class WorkerSessions::Session final : public WorkerSession {
 public:
  Session(WorkerSessions& sessions, std::shared_ptr<Connection> connection)
      : sessions_(sessions), alive_(sessions.alive_), connection_(std::move(connection)) {}
  ~Session() override { disconnected(); }
  void receive(FromWorker message) override {
    // This blocks until there is room for the message, or until the coordinator ends: the std::promise is
    // then destroyed, which also ends the wait.
    auto room = std::make_shared<std::promise<void>>();
    const auto granted = room->get_future();
    receive(std::move(message), [room = std::move(room)] { room->set_value(); });
    granted.wait();
  }
  void receive(FromWorker message, std::function<void()> next) override {
    if (*alive_) sessions_.receive(connection_, std::move(message), std::move(next));
  }
  void disconnected() override {
    if (*alive_) sessions_.disconnected(*connection_);
  }

 private:
  WorkerSessions& sessions_;
  const std::shared_ptr<const std::atomic<bool>> alive_;
  const std::shared_ptr<Connection> connection_;
};

Result<std::unique_ptr<WorkerSession>> WorkerSessions::connect(const WorkerHello& hello,
                                                               std::shared_ptr<WorkerSink> sink,
                                                               const std::string& principal) {
  if (auto ok = check_hello(hello, options_.may_join, options_.allow_fake); !ok)
    return tl::unexpected(ok.error());
  const auto core = core_.lock();
  WorkerTable& workers = core->workers;
  WorkerId id = hello.previous_id;
  const auto known = workers.find(id);
  // If a worker of another name has this id already (for example, because a running machine was cloned), that
  // worker keeps the id, and this one gets a new id.
  const bool taken = known != workers.end() && known->second.hello.name != hello.name;
  const bool proved =
      !well_formed(id) || !needs_secret(id) || equal_secret(hello.secret.value_or(""), secret_of(id));
  if (!proved)
    log_warn(fmt::format("worker={} name={}", log_value(id.value), log_value(hello.name)),
             "a worker shows this id without the secret that belongs to it, and gets another id");
  if (id.empty() || !well_formed(id) || taken || !proved)
    id.value = new_worker_id(options_.start, last_epoch_ & 0xffffffff, hello.secret.has_value());
  if (workers.size() >= limits::kMaxWorkers && !workers.contains(id))
    return fail(Errc::resource_exhausted,
                fmt::format("{} workers are known; more are not taken", workers.size()));

  auto connection =
      std::make_shared<Connection>(id, ++last_epoch_, hello, std::move(sink), options_.lease_prefix);
  WorkerEntry& worker = workers[id];
  if (worker.connection) worker.connection->close();
  worker.hello = hello;
  worker.hello.join_token.clear();
  worker.hello.secret.reset();
  worker.hello.blobs_held.clear();  // not needed in the table; the farm gets the list from `hello`
  worker.connection = connection;
  worker.last_seen = clock_.now();
  connection->sink->send(Welcome{id, connection->epoch, needs_secret(id) ? secret_of(id) : std::string()});
  log_info(fmt::format("worker={} name={} epoch={}", id.value, log_value(hello.name), connection->epoch),
           "joined");
  core->driver.run(WorkerJoined{id, connection->epoch, hello.name, hello.numeric_class, hello.threads,
                                hello.tags, hello.memory_bytes, hello.blobs_held,
                                options_.version.empty() || hello.build == options_.version, hello.platform,
                                principal, hello.brief_bytes});
  return std::make_unique<Session>(*this, std::move(connection));
}

std::string WorkerSessions::secret_of(const WorkerId& id) const {
  return hmac_sha256(options_.id_key, "worker " + id.value);
}

void WorkerSessions::disconnected(Connection& connection) {
  const auto core = core_.lock();
  if (!std::exchange(connection.open, false)) return;
  log_info(fmt::format("worker={} epoch={}", connection.worker.value, connection.epoch), "disconnected");
  core->driver.run(WorkerLost{connection.worker, connection.epoch});
}

void WorkerSessions::receive(const std::shared_ptr<Connection>& from, FromWorker message,
                             std::function<void()> next) {
  if (auto* result = std::get_if<UnitResult>(&message)) {
    {
      const auto core = core_.lock();
      if (const auto w = core->workers.find(from->worker); w != core->workers.end())
        w->second.last_seen = clock_.now();
    }
    return results_.receive(from, std::move(*result), std::move(next));
  }
  {
    const auto core = core_.lock();
    handle(*core, *from, std::move(message));
  }
  next();
}

void WorkerSessions::handle(Core& core, Connection& from, FromWorker message) {
  const auto found = core.workers.find(from.worker);
  if (!from.open || found == core.workers.end()) return;
  found->second.last_seen = clock_.now();
  std::visit(
      // UnitResult and WorkerHello never come here: receive() handles the former, connect() the latter, and a
      // second WorkerHello on a stream is rejected before.
      overloaded{[](const UnitResult&) {}, [](const WorkerHello&) {},
                 [&](const WorkerProgress& m) { note_progress(core, from, found->second, m); },
                 [&](const UnitFailure& m) {
                   // The acknowledgement is sent first, since run() may lease the unit to this worker again.
                   // If the acknowledgement came after that lease, the worker could mistake it for the answer
                   // to its new attempt.
                   from.sink->send(ResultAck{m.unit, std::nullopt});
                   if (core.driver.farm().failure_is_new(from.worker, m.unit)) {
                     core.records.log(m.unit.job,
                                      fmt::format("tile {} round {} failed on {}: {}", m.unit.tile,
                                                  m.unit.round, from.worker.value, m.reason));
                     found->second.note(fmt::format("job {} tile {} round {} failed: {}", m.unit.job.value,
                                                    m.unit.tile, m.unit.round, m.reason));
                   }
                   core.driver.run(UnitFailed{from.worker, m});
                 },
                 [&](const LeaseReturned& m) {
                   core.driver.run(LeaseCameBack{from.worker, m});
                 },
                 [&](const WorkerDraining& m) {
                   if (!m.refused.empty()) found->second.note("does not restart: " + m.refused);
                   core.driver.run(WorkerDrains{from.worker, m.withdrawn, m.restarts});
                 }},
      message);
}

void WorkerSessions::note_progress(Core& core, Connection& from, WorkerEntry& worker,
                                   const WorkerProgress& m) {
  worker.activity = m.activity.substr(0, ls::limits::kNameBytes);
  worker.cpu_seconds = m.cpu_seconds_total;
  worker.rss_bytes = m.rss_bytes;
  if (const auto entry = core.jobs.find(worker.last_job)) {
    JobTotals& totals = entry->stored.totals;
    totals.peak_rss_bytes = std::max(totals.peak_rss_bytes, m.rss_bytes);
    if (m.load_seconds < 1e9) totals.load_seconds = std::max(totals.load_seconds, m.load_seconds);
  }
  // The worker may still report leases from an earlier stream. Their units went to others when that stream
  // broke, so the worker is asked to cancel them.
  for (const auto& lease : m.leases)
    if (!from.assigned(lease.lease)) from.sink->send(CancelLease{lease.lease});
  core.driver.run(LeaseProgress{from.worker, m.leases});
  core.publisher.worker(from.worker, false);
}

Result<void> WorkerSessions::drain(const WorkerId& id, DrainNow how) {
  const auto core = core_.lock();
  const auto found = core->workers.find(id);
  if (found == core->workers.end())
    return fail(Errc::not_found, fmt::format("there is no worker \"{}\"", id.value));
  const auto& connection = found->second.connection;
  if (!connection || !connection->open)
    return fail(Errc::failed_precondition,
                fmt::format("worker {} is not connected, so it receives no requests", id.value));
  const auto figures = core->driver.farm().worker(id);
  if (how.withdrawn && !(figures && is_leaving(figures->state)))
    return fail(Errc::failed_precondition,
                fmt::format("worker {} is not draining: it takes units as before", id.value));
  // It would come back under another id, and be trusted as before.
  if (how.restart && core->driver.farm().quarantined(id))
    return fail(
        Errc::failed_precondition,
        fmt::format(
            "worker {} is quarantined: drain it, find out why its results differ, and start it again on "
            "its machine",
            id.value));
  if (how.restart && !found->second.hello.restarts)
    return fail(Errc::failed_precondition,
                fmt::format("worker {} cannot restart itself, since its version is too old: drain it, and "
                            "start it again on its machine",
                            id.value));
  connection->sink->send(how);
  return {};
}

void WorkerSessions::report_held_back(Core& core) const {
  for (const auto& [id, worker] : core.workers)
    if (worker.connection && worker.connection->open && worker.connection->held_back)
      core.driver.run(ResultsWait{id});
}

void WorkerSessions::close() {
  const auto core = core_.lock();
  for (auto& [id, worker] : core->workers)
    if (worker.connection) worker.connection->close();
}

}  // namespace ls::coordinator
