// Messages of the worker protocol. Each part of the input is a message on the wire, taken as one of either
// side; those of a worker go to a coordinator with a job. A message may say J for that job's id, L for the
// last lease, and a result of one byte stands for the right one.
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>

#include "coordinator/service/coordinator.h"
#include "formats/read.h"
#include "proto/convert.h"
#include "tests/fuzz/all_targets.h"
#include "worker/fake/fake_pixels.h"

namespace ls::fuzz {
namespace {

using namespace ls::coordinator;

constexpr const char* kScene =
    R"(<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="8"/></film></sensor><shape type="sphere"/><emitter type="constant"/></scene>)";
const Digest kClass = sha256("fuzz class");

class Sink final : public WorkerSink {
 public:
  void send(ToWorker message) override {
    const std::lock_guard lock(mutex_);
    acks_ += std::holds_alternative<ResultAck>(message);
    if (const auto* assign = std::get_if<AssignLease>(&message)) {
      lease_ = assign->lease;
      if (assign->brief) brief_ = *assign->brief;
    }
    changed_.notify_all();
  }
  void close() override {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  int acks() {
    const std::lock_guard lock(mutex_);
    return acks_;
  }
  // Every result and failure over an open stream is answered.
  bool answered(int acks) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(100), [&] { return closed_ || acks_ > acks; });
  }
  Lease lease() {
    const std::lock_guard lock(mutex_);
    return lease_;
  }
  JobBrief brief() {
    const std::lock_guard lock(mutex_);
    return brief_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int acks_ = 0;
  bool closed_ = false;
  Lease lease_;
  JobBrief brief_;
};

WorkerHello hello() {
  WorkerHello h;
  h.name = "fuzz";
  h.numeric_class = kClass;
  h.threads = 2;
  return h;
}

class Farm {
 public:
  Farm() {
    coordinator_ = std::move(Coordinator::open({.scenes = scenes_in_this_process}).value());
    JobSpec spec;
    spec.spp = 6;
    job_ = coordinator_->submit({"fuzz.xml", kScene, {}, spec}).value();
    session_ = coordinator_->connect(hello(), sink_).value();
  }

  void take(FromWorker message) {
    if (const auto* h = std::get_if<WorkerHello>(&message)) return join(*h);
    bool answer = false;
    if (auto* r = std::get_if<UnitResult>(&message))
      answer = true, name(r->unit), name(r->lease), complete(*r);
    if (auto* f = std::get_if<UnitFailure>(&message)) answer = true, name(f->unit), name(f->lease);
    if (auto* b = std::get_if<LeaseReturned>(&message)) {
      name(b->lease);
      for (UnitKey& key : b->unrendered) name(key);
    }
    if (auto* p = std::get_if<WorkerProgress>(&message))
      for (auto& entry : p->leases) name(entry.lease);
    const int before = sink_->acks();
    session_->receive(std::move(message));
    must(!answer || sink_->answered(before), "every result and failure is answered");
  }

  void check() const {
    const auto view = coordinator_->job(job_).value();
    must(view.units_done <= view.units_total, "no more is done than there is");
    must(view.health.nonfinite <= 40 * 8 * 6, "no more samples are rejected than there are");
    must(nlohmann::json::accept(coordinator_->report_json(job_).value()), "a report is JSON");
  }

 private:
  void join(const WorkerHello& h) {
    const auto sink = std::make_shared<Sink>();
    auto session = coordinator_->connect(h, sink);
    if (!session) return must(!session.error().message.empty(), "who is refused is told why");
    (*session)->disconnected();
  }
  void name(UnitKey& key) const {
    if (key.job.value == "J") key.job = job_;
  }
  void name(LeaseId& lease) const {
    if (lease.value == "L") lease = sink_->lease().id;
  }
  void complete(UnitResult& r) const {
    const JobBrief brief = sink_->brief();
    const TileGrid grid{brief.settings.size, brief.settings.tile};
    if (r.exr.size() != 1 || r.unit.tile >= grid.count() || r.unit.round > 2) return;
    const Partial partial = fake_partial(
        {brief.scene, brief.settings_digest, kClass, grid.rect(r.unit.tile), cut_range(r.unit.round, 6)});
    r.digest = unit_digest(partial);
    r.exr = encode_partial(partial, brief.settings.size).value();
  }

  std::unique_ptr<Coordinator> coordinator_;
  JobId job_;
  std::shared_ptr<Sink> sink_ = std::make_shared<Sink>();
  std::unique_ptr<WorkerSession> session_;
};

template <class Message, class Wire>
std::optional<Message> read(Bytes part) {
  Wire wire;
  if (!wire.ParseFromArray(part.data(), static_cast<int>(part.size())) || !wire::known(wire))
    return std::nullopt;
  auto message = wire::from_wire(wire);
  if (!message) {
    must(!message.error().message.empty(), "what is refused is told why");
    return std::nullopt;
  }
  const auto again = wire::from_wire(wire::to_wire(*message));
  must(again && *again == *message, "a message that was read is sent and read back as it was");
  return std::move(*message);
}

std::string wire_of(const auto& message) { return wire::to_wire(message).SerializeAsString(); }

}  // namespace

void protocol(Bytes input) {
  std::optional<Farm> farm;
  for (const Bytes part : parts_of(input, 16)) {
    (void)read<ToWorker, wire::pb::ToWorker>(part);
    auto message = read<FromWorker, wire::pb::FromWorker>(part);
    if (!message) continue;
    if (!farm) farm.emplace();
    farm->take(std::move(*message));
  }
  if (farm) farm->check();
}

Seeds protocol_seeds() {
  const auto result = [](TileIndex tile, RoundIndex round) {
    UnitResult r;
    r.unit = {{"J"}, tile, round};
    r.lease = {"L"};
    r.exr = {std::byte{1}};
    r.cpu_seconds = .1;
    return r;
  };
  UnitResult unhealthy = result(0, 0);
  unhealthy.health.add(HealthCause::infinite, 2, {3, 4, 1});
  WorkerHello other = hello();
  other.tags = {"a"};
  other.blobs_held = {kClass};
  other.previous_id = {"w-1"};
  UnitFailure failure;
  failure.unit = {{"J"}, 1, 0};
  failure.lease = {"L"};
  failure.reason = "why";
  failure.signal = 11;
  failure.pixel = {33, 1};
  failure.sample = 1;
  std::string all;
  for (TileIndex t = 0; t < 2; ++t)
    for (RoundIndex r = 0; r < 3; ++r) all += with_length(wire_of(FromWorker(result(t, r))));
  Seeds seeds{all, with_length(wire_of(FromWorker(unhealthy))) + wire_of(FromWorker(result(0, 0)))};
  for (const FromWorker& m :
       {FromWorker(other), FromWorker(WorkerProgress{{{{"L"}, 1}}, "rendering", 1, 2, 3}),
        FromWorker(failure), FromWorker(LeaseReturned{{"L"}, {{{"J"}, 0, 0}}}), FromWorker(WorkerDraining{})})
    seeds.push_back(with_length(wire_of(m)) + wire_of(FromWorker(result(1, 0))));
  RenderSettings settings;
  settings.size = {64, 64};
  settings.integrator = "volpath";
  const JobBrief brief{{"j-1"}, kClass, settings, digest_of(settings), {{kClass, 12, "a.vol"}}};
  for (const ToWorker& m : {ToWorker(Welcome{{"w-1"}, 3}),
                            ToWorker(AssignLease{{{"l"}, {"j-1"}, {{0, 0, {0, 0, 32, 32}, {0, 2}}}}, brief}),
                            ToWorker(ResultAck{{{"j-1"}, 0, 0}, Error{Errc::internal, "x"}}),
                            ToWorker(CancelJob{{"j-1"}}), ToWorker(DrainNow{})})
    seeds.push_back(wire_of(m));
  return seeds;
}

}  // namespace ls::fuzz
