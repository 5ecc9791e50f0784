// A farm whose time the test sets, with short names for events and effects.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "coordinator/domain/farm/farm.h"
#include "coordinator/domain/limits.h"
#include "tests/unit/domain/farm_inspector.h"
#include "util/protocol/briefs.h"

namespace ls::coordinator {

template <class T>
std::vector<T> of(const std::vector<Effect>& effects) {
  std::vector<T> found;
  for (const Effect& e : effects) {
    if (const T* t = std::get_if<T>(&e)) found.push_back(*t);
  }
  return found;
}

template <class T>
std::vector<std::pair<WorkerId, T>> sent(const std::vector<Effect>& effects) {
  std::vector<std::pair<WorkerId, T>> found;
  for (const Send& send : of<Send>(effects)) {
    if (const T* t = std::get_if<T>(&send.message)) found.emplace_back(send.worker, *t);
  }
  return found;
}

inline Digest digest_number(std::uint64_t n) {
  Digest d;
  for (int i = 0; i < 8; ++i) d.bytes[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(n >> (8 * i));
  d.bytes[31] = 1;
  return d;
}
// The digest of an honest worker's result: a function of the unit and its range.
inline Digest honest(const UnitKey& unit, const SampleRange& range) {
  return digest_number(std::hash<JobId>{}(unit.job) ^ (std::uint64_t{unit.tile} * 0x9e3779b97f4a7c15u) ^
                       (std::uint64_t{unit.round} * 0xc2b2ae3d27d4eb4fu) ^ (range.s1 * 0x165667b19e3779f9u));
}

// Returns a plan with `tiles` tiles in one row.
inline JobPlan plan_of(const std::string& id, int tiles, std::optional<std::uint64_t> spp) {
  JobPlan plan;
  plan.brief.job = {id};
  plan.grid = {{tiles * 8, 8}, 8};
  plan.spp = spp;
  return plan;
}

using Workers = std::vector<std::pair<std::string, int>>;  // names and numbers of threads

// Drives a farm: carries out Fold effects immediately, as an assembler, and keeps which units each worker
// holds.
class Rig {
 public:
  struct Held {
    JobId job;
    LeaseId lease;
    LeaseUnit unit;
    UnitKey key() const { return {job, unit.tile, unit.round}; }
  };

  explicit Rig(Farm::Options options = {.lease_prefix = "t"}) : farm(std::move(options)) {}
  // A farm whose workers, with these numbers of threads, join before the job is submitted.
  Rig(JobPlan plan, const Workers& workers, Farm::Options options = {.lease_prefix = "t"})
      : Rig(std::move(options)) {
    for (const auto& [name, threads] : workers) join(name, threads);
    submit(std::move(plan));
  }

  Farm farm;
  TimePoint now{};
  std::map<WorkerId, std::deque<Held>> held;
  std::function<double(const UnitKey&)> rel_error = [](const UnitKey&) { return 1.0; };
  // The upper end of the interval that each check of the denoised layers' error finds, immediately. Empty:
  // the test sends the results of checks itself
  std::function<double(const CheckDenoised&)> denoised;
  double cpu_seconds = 0.01;                // reported for each unit
  std::uint64_t brief_bytes = kBriefBytes;  // memory for briefs of the workers that join
  // Seconds that the thread waited, reported for each unit
  double wait_seconds = 0;
  // Who answers for a worker, by its name (WorkerJoined::principal)
  std::map<std::string, std::string> principals;
  // True: the test sets the time. Otherwise each unit that render() renders takes as long as it reports.
  bool own_time = false;

  // Returns the effects of the event and of all folds that result from it.
  std::vector<Effect> send(const Event& event) {
    std::vector<Effect> all;
    std::deque<Event> events{event};
    while (!events.empty()) {
      for (Effect& effect : farm.handle(events.front(), now)) {
        if (const Fold* fold = std::get_if<Fold>(&effect)) {
          events.push_back(UnitFolded{fold->unit, fold->samples, rel_error(fold->unit)});
        }
        if (const CheckDenoised* check = std::get_if<CheckDenoised>(&effect); check != nullptr && denoised)
          events.push_back(DenoisedChecked{check->job, {check->spp, 0, denoised(*check)}});
        observe(effect);
        all.push_back(std::move(effect));
      }
      events.pop_front();
    }
    return all;
  }
  std::vector<Effect> pass(Duration d) {
    now += d;
    return send(Tick{});
  }
  std::vector<Effect> submit(JobPlan plan) { return send(JobSubmitted{std::move(plan)}); }
  std::vector<Effect> join(const std::string& name, int threads, std::uint64_t numeric_class = 1,
                           std::vector<std::string> tags = {}, std::uint64_t memory = 0,
                           std::vector<Digest> blobs = {}) {
    return send(WorkerJoined{{name},
                             ++epochs_[{name}],
                             name,
                             digest_number(numeric_class),
                             threads,
                             std::move(tags),
                             memory,
                             std::move(blobs),
                             true,
                             {},
                             principals[name],
                             brief_bytes});
  }
  std::vector<Effect> join_another_version(const std::string& name, int threads,
                                           std::uint64_t numeric_class) {
    return send(WorkerJoined{
        {name}, ++epochs_[{name}], name, digest_number(numeric_class), threads, {}, 0, {}, false});
  }
  std::vector<Effect> join_of_platform(const std::string& name, int threads, std::uint64_t numeric_class,
                                       const std::string& platform) {
    return send(WorkerJoined{
        {name}, ++epochs_[{name}], name, digest_number(numeric_class), threads, {}, 0, {}, true, platform});
  }
  std::vector<Effect> lose(const std::string& name) {
    held.erase({name});
    return send(WorkerLost{{name}, epochs_[{name}]});
  }
  // The worker renders the first unit that it holds, and delivers the result.
  std::vector<Effect> render(const std::string& name) {
    const Held unit = take(name);
    if (!own_time) now += from_seconds(cpu_seconds + wait_seconds);
    return result(name, unit);
  }
  std::vector<Effect> result(const std::string& name, const Held& unit) {
    return send(UnitAccepted{unit.key(),
                             unit.unit.samples,
                             honest(unit.key(), unit.unit.samples),
                             {name},
                             cpu_seconds,
                             wait_seconds});
  }
  std::vector<Effect> fail(const std::string& name, bool scene_at_fault = false) {
    const Held unit = take(name);
    return send(UnitFailed{{name}, {unit.key(), unit.lease, scene_at_fault, "crashed", 11, {{3, 4}}, 5}});
  }
  // The worker gives all units back that it holds.
  std::vector<Effect> give_back(const std::string& name, const std::string& why) {
    std::map<LeaseId, std::vector<UnitKey>> back;
    for (const Held& unit : held[{name}]) back[unit.lease].push_back(unit.key());
    held[{name}].clear();
    std::vector<Effect> all;
    for (const auto& [lease, units] : back)
      for (Effect& effect : send(LeaseCameBack{{name}, {lease, units, why}}))
        all.push_back(std::move(effect));
    return all;
  }
  Held take(const std::string& name) {
    auto& units = held[{name}];
    EXPECT_FALSE(units.empty()) << name << " holds nothing";
    if (units.empty()) return {};
    const Held unit = units.front();
    units.pop_front();
    return unit;
  }
  // Workers render in turn until none holds a unit.
  std::vector<Effect> render_all() {
    std::vector<Effect> all;
    for (bool any = true; any;) {
      any = false;
      std::vector<WorkerId> names;
      for (const auto& [id, units] : held) names.push_back(id);
      for (const WorkerId& id : names) {
        if (held[id].empty()) continue;
        for (Effect& e : render(id.value)) all.push_back(std::move(e));
        any = true;
      }
    }
    return all;
  }
  JobFigures job(const std::string& id = "j") const { return farm.job({id}).value(); }
  WorkerFigures worker(const std::string& id) const { return farm.worker({id}).value(); }

 private:
  void observe(const Effect& effect) {
    const Send* send = std::get_if<Send>(&effect);
    if (send == nullptr) return;
    auto& units = held[send->worker];
    if (const auto* assign = std::get_if<AssignLease>(&send->message)) {
      for (const LeaseUnit& u : assign->lease.units)
        units.push_back({assign->lease.job, assign->lease.id, u});
    } else if (const auto* lease = std::get_if<CancelLease>(&send->message)) {
      std::erase_if(units, [&](const Held& h) { return h.lease == lease->lease; });
    } else if (const auto* job = std::get_if<CancelJob>(&send->message)) {
      std::erase_if(units, [&](const Held& h) { return h.job == job->job; });
    }
  }
  std::map<WorkerId, std::uint64_t> epochs_;
};

}  // namespace ls::coordinator
