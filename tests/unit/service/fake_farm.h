// Fake workers that render whole jobs through the coordinator's public interface. They send results of
// fake_partial in any order, twice, late or with errors, as the test chooses.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "coordinator/service/coordinator.h"
#include "worker/fake/fake_pixels.h"

namespace ls::coordinator {

// CPU seconds that a fake worker reports for a unit. The coordinator believes no more than have passed since
// the unit was leased: it is far less than making a result takes.
inline constexpr double kUnitSeconds = 0x1p-24;

inline const std::string kSceneText = R"(<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective">
    <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="24"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
  </sensor>
  <shape type="sphere"/>
  <emitter type="constant"/>
</scene>)";

// Returns kSceneText with another shape in line 7.
inline std::string with_shape(const std::string& shape) {
  std::string text = kSceneText;
  return text.replace(text.find("<shape type=\"sphere\"/>"), 22, shape);
}
inline std::string with_mesh(const std::string& name) {
  return with_shape("<shape type=\"ply\"><string name=\"filename\" value=\"" + name + "\"/></shape>");
}

// The messages from the coordinator to all fake workers, in order of arrival.
class Mailbox {
 public:
  void put(int worker, ToWorker message) {
    const std::lock_guard lock(mutex_);
    mail_.emplace_back(worker, std::move(message));
    arrived_.notify_all();
  }
  // Waits for the first message and removes it. nullopt: `enough`, which is called every 2 ms, returned true
  // before a message arrived, or 60 s have passed; so no test hangs longer.
  std::optional<std::pair<int, ToWorker>> take(const std::function<bool()>& enough = [] { return false; }) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    std::unique_lock lock(mutex_);
    while (mail_.empty()) {
      if (std::chrono::steady_clock::now() > until) return std::nullopt;
      arrived_.wait_for(lock, std::chrono::milliseconds(2));
      if (!mail_.empty()) break;
      lock.unlock();
      if (enough()) return std::nullopt;
      lock.lock();
    }
    auto first = std::move(mail_.front());
    mail_.pop_front();
    return first;
  }
  // Removes and returns the messages that answer results. Leases stay, since they may be for another job.
  std::vector<ToWorker> acks() {
    const std::lock_guard lock(mutex_);
    std::vector<ToWorker> taken;
    std::erase_if(mail_, [&](auto& mail) {
      if (!std::holds_alternative<ResultAck>(mail.second)) return false;
      taken.push_back(std::move(mail.second));
      return true;
    });
    return taken;
  }
  bool empty() {
    const std::lock_guard lock(mutex_);
    return mail_.empty();
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<std::pair<int, ToWorker>> mail_;
};

class MailSink final : public WorkerSink {
 public:
  MailSink(std::shared_ptr<Mailbox> mail, int worker) : mail_(std::move(mail)), worker_(worker) {}
  void send(ToWorker message) override { mail_->put(worker_, std::move(message)); }
  void close() override {}

 private:
  std::shared_ptr<Mailbox> mail_;
  int worker_;
};

class FakeFarm {
 public:
  FakeFarm(Coordinator& coordinator, int workers, bool fake = false) : coordinator_(coordinator) {
    for (int i = 0; i < workers; ++i) {
      WorkerHello hello;
      hello.name = "fake-" + std::to_string(i);
      hello.build = "test";
      hello.fake = fake;
      hello.numeric_class = sha256("fake class");
      hello.join_token = token;
      auto session = coordinator_.connect(hello, std::make_shared<MailSink>(mail_, i));
      if (session) sessions_.push_back(std::move(*session));
      EXPECT_EQ(sessions_.size(), static_cast<std::size_t>(i) + 1);
    }
  }

  // Returns the results to send for a rendered one: it may change the result, repeat it, or hold it back.
  std::function<std::vector<UnitResult>(UnitResult)> tamper = [](UnitResult r) {
    return std::vector{std::move(r)};
  };
  // True if the worker changes the pixels of this result.
  std::function<bool(int worker, const UnitResult&)> lies = [](int, const UnitResult&) { return false; };
  std::function<void(std::vector<LeaseUnit>&)> reorder = [](auto&) {};
  // True: the coordinator's tick() is called while no message arrives, since a worker that returned units
  // gets new ones at a tick.
  bool ticks = false;
  int results_sent = 0;
  int stop_after = -1;  // after this many results run() returns false; -1: never
  std::vector<ResultAck> refusals;
  static inline std::string token;

  // Renders until `until` returns true. That may happen without a message: the end of a job may depend on a
  // check of the denoised layers, or on the final image.
  bool run(const std::function<bool()>& until) {
    while (!until()) {
      bool holds = false;
      const auto letter = mail_->take([&] {
        if (ticks) coordinator_.tick();
        return holds = until();
      });
      if (holds) return true;
      if (!letter) {
        ADD_FAILURE() << "the farm stands still";
        return false;
      }
      note_refusal(letter->second);
      const auto* assign = std::get_if<AssignLease>(&letter->second);
      if (assign && !render(letter->first, *assign)) return false;
    }
    return true;
  }
  bool work_until_paused(const JobId& job) {
    return run([&] { return coordinator_.job(job)->state == JobState::paused; });
  }
  bool finish(const JobId& job) {
    const bool ended = run([&] {
      const auto state = coordinator_.job(job)->state;
      return state == JobState::failed || state == JobState::cancelled || state == JobState::done;
    });
    // A job can end before the answers to its last results are read; these may include refusals.
    for (const ToWorker& letter : mail_->acks()) note_refusal(letter);
    return ended;
  }
  std::vector<std::unique_ptr<WorkerSession>>& sessions() { return sessions_; }

  void brief(const AssignLease& assign) {
    if (assign.brief) briefs_[assign.lease.job] = *assign.brief;
  }
  UnitResult render_unit(const Lease& lease, const LeaseUnit& unit,
                         std::string_view numeric_class = "fake class") {
    const JobBrief& brief = briefs_.at(lease.job);
    const Partial partial =
        fake_partial({brief.scene, brief.settings_digest, sha256(numeric_class), unit.rect, unit.samples},
                     aovs_of(brief.settings));
    UnitResult r;
    r.unit = {lease.job, unit.tile, unit.round};
    r.lease = lease.id;
    r.exr = encode_partial(partial, brief.settings.size).value();
    r.digest = unit_digest(partial);
    r.cpu_seconds = kUnitSeconds;
    return r;
  }

 private:
  void note_refusal(const ToWorker& message) {
    if (const auto* ack = std::get_if<ResultAck>(&message); ack && ack->refused) refusals.push_back(*ack);
  }
  void falsify(UnitResult& result, const LeaseUnit& unit) {
    const JobBrief& brief = briefs_.at(result.unit.job);
    Partial partial =
        fake_partial({brief.scene, brief.settings_digest, sha256("fake class"), unit.rect, unit.samples},
                     aovs_of(brief.settings));
    partial.sums[0] += 1;
    result.exr = encode_partial(partial, brief.settings.size).value();
    result.digest = unit_digest(partial);
  }
  bool render(int worker, const AssignLease& assign) {
    if (assign.brief) briefs_[assign.lease.job] = *assign.brief;
    auto units = assign.lease.units;
    reorder(units);
    for (const LeaseUnit& unit : units)
      for (UnitResult& result : tamper(render_unit(assign.lease, unit))) {
        if (lies(worker, result)) falsify(result, unit);
        if (results_sent == stop_after) return false;
        ++results_sent;
        sessions_[static_cast<std::size_t>(worker)]->receive(std::move(result));
      }
    return true;
  }

  Coordinator& coordinator_;
  std::shared_ptr<Mailbox> mail_ = std::make_shared<Mailbox>();
  std::vector<std::unique_ptr<WorkerSession>> sessions_;
  std::map<JobId, JobBrief> briefs_;
};

inline std::unique_ptr<Coordinator> open_at(const std::filesystem::path& data) {
  Coordinator::Options options;
  options.data = data;
  auto opened = Coordinator::open(std::move(options));
  EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
  return std::move(*opened);
}

inline JobId submit(Coordinator& coordinator, JobSpec spec = {}) {
  auto id = coordinator.submit({"test.xml", kSceneText, {}, std::move(spec)});
  EXPECT_TRUE(id) << (id ? "" : id.error().error.message + format_diagnostics(id.error().diagnostics));
  return id.value_or(JobId{});
}

// Returns a job whose coordinator was destroyed after its workers had sent `results` results.
inline JobId interrupted(const std::filesystem::path& data, int results, int workers, JobSpec spec = {}) {
  auto coordinator = open_at(data);
  const JobId job = submit(*coordinator, std::move(spec));
  FakeFarm farm(*coordinator, workers);
  farm.stop_after = results;
  farm.finish(job);
  return job;
}

// Renders the job with this many honest workers; true if it ends.
inline bool finish(Coordinator& coordinator, const JobId& job, int workers = 1) {
  return FakeFarm(coordinator, workers).finish(job);
}

inline Result<void> pause(Coordinator& coordinator, const JobId& job) {
  return coordinator.change(job, {.state = JobState::paused});
}
inline Result<void> resume(Coordinator& coordinator, const JobId& job) {
  return coordinator.change(job, {.state = JobState::running});
}
inline Result<void> set_priority(Coordinator& coordinator, const JobId& job, int priority) {
  return coordinator.change(job, {.priority = priority});
}
inline Result<void> extend(Coordinator& coordinator, const JobId& job, std::uint64_t spp) {
  return coordinator.change(job, {.spp = spp});
}

inline nlohmann::json report(const Coordinator& coordinator, const JobId& job) {
  return nlohmann::json::parse(coordinator.report_json(job).value_or("{}"));
}
inline std::string pixels(const Coordinator& coordinator, const JobId& job) {
  return report(coordinator, job).value("pixels_sha256", "");
}

// The pixels that other tests must reproduce: rendered by one worker, in memory, in order.
inline std::string reference_pixels(std::optional<std::uint64_t> spp = {}) {
  auto coordinator = open_at({});
  JobSpec spec;
  spec.spp = spp;
  const JobId job = submit(*coordinator, spec);
  EXPECT_TRUE(finish(*coordinator, job));
  return pixels(*coordinator, job);
}

}  // namespace ls::coordinator
