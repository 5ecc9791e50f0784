// A rig in simulated time: each render thread is busy for as long as its unit costs.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <queue>
#include <string>
#include <vector>

#include "tests/unit/domain/rig.h"

namespace ls::coordinator {

class Clockwork {
 public:
  explicit Clockwork(Farm::Options options = {.lease_prefix = "t"}) : rig(std::move(options)) {}
  Clockwork(JobPlan plan, const Workers& workers, Farm::Options options = {.lease_prefix = "t"})
      : Clockwork(std::move(options)) {
    for (const auto& [name, threads] : workers) join(name, threads);
    rig.submit(std::move(plan));
  }

  Rig rig;
  std::function<double(const UnitKey&)> cost = [](const UnitKey&) { return 0.5; };  // core seconds
  // Factors on the cost, for workers that are slower than others
  std::map<std::string, double> slow;
  // Core seconds that these workers report for each unit, whatever it has cost
  std::map<std::string, double> lies;
  // Core seconds that each job has used
  std::map<std::string, double> seconds;
  // Number of units rendered, by job and worker
  std::map<std::string, std::map<std::string, std::uint64_t>> units;
  // The accepted result of each unit, and the first one that arrived
  std::map<UnitKey, Digest> accepted, arrived;
  // When each job was finished, in seconds
  std::map<std::string, double> finished;
  std::function<Digest(const std::string& worker, const UnitKey&, const SampleRange&)> pixels =
      [](const std::string&, const UnitKey& unit, const SampleRange& range) { return honest(unit, range); };
  // When the first unit of a lease began and its last one ended, in seconds, and how long its longest one
  // took
  struct Span {
    double begun = 0, ended = 0, longest = 0;
  };
  std::map<LeaseId, Span> leases;
  std::vector<Effect> effects;  // all effects except folds and assignments

  void join(const std::string& name, int threads, std::uint64_t memory = 0, std::vector<Digest> blobs = {}) {
    threads_[name] = threads;
    note(rig.join(name, threads, 1, {}, memory, std::move(blobs)));
  }
  void send(const Event& event) { note(rig.send(event)); }
  // The stream breaks; results of the units that the worker holds still arrive.
  void lose(const std::string& name) { note(rig.lose(name)); }
  double now() const { return ls::seconds(rig.now.time_since_epoch()) - begin_; }

  // Runs until no unit is being rendered, or for this many seconds.
  void run(double for_seconds = 1e9) {
    const double end = now() + for_seconds;
    while (now() < end) {
      begin_units();
      if (busy_.empty()) {
        if (idle()) return;
        note(rig.pass(100ms));
        continue;
      }
      const Busy next = busy_.top();
      if (next.until > tick_at_) {
        rig.now = at(tick_at_);
        tick_at_ += .1;
        note(rig.send(Tick{}));
        continue;
      }
      busy_.pop();
      rig.now = std::max(rig.now, at(next.until));
      finish(next);
    }
  }
  bool idle() const {
    for (const JobId& job : jobs_of(rig.farm))
      if (const auto f = rig.farm.job(job);
          f->state == JobState::running && rig.farm.why_waiting(job).empty())
        return false;
    return true;
  }
  template <class T>
  std::vector<T> seen() const {
    return of<T>(effects);
  }

 private:
  struct Busy {
    double until;
    std::uint64_t order;
    std::string worker;
    Rig::Held unit;
    bool operator<(const Busy& o) const { return std::tie(until, order) > std::tie(o.until, o.order); }
  };
  TimePoint at(double t) const { return TimePoint{} + from_seconds(t + begin_); }

  void begin_units() {
    for (auto& [id, held] : rig.held) {
      int& busy = working_[id.value];
      while (!held.empty() && busy < threads_[id.value]) {
        ++busy;
        const double factor = slow.contains(id.value) ? slow.at(id.value) : 1;
        const Rig::Held unit = held.front();
        held.pop_front();
        const double end = now() + factor * cost(unit.key());
        Span& span = leases.try_emplace(unit.lease, Span{now(), 0, 0}).first->second;
        span.longest = std::max(span.longest, end - now());
        busy_.push({end, ++order_, id.value, unit});
      }
    }
  }
  void finish(const Busy& done) {
    --working_[done.worker];
    const UnitKey key = done.unit.key();
    const double cpu = cost(key);
    leases[done.unit.lease].ended = now();
    seconds[key.job.value] += cpu;
    ++units[key.job.value][done.worker];
    const Digest digest = pixels(done.worker, key, done.unit.unit.samples);
    if (!accepted.contains(key)) arrived[key] = digest;
    const auto lie = lies.find(done.worker);
    note(rig.send(UnitAccepted{
        key, done.unit.unit.samples, digest, {done.worker}, lie == lies.end() ? cpu : lie->second}));
  }
  // A worker that is told to give back the rest of a lease returns the units that it has not begun.
  void answer(const Send& sent) {
    const auto* recall = std::get_if<RecallLease>(&sent.message);
    if (recall == nullptr) return;
    LeaseReturned returned{recall->lease, {}};
    std::erase_if(rig.held[sent.worker], [&](const Rig::Held& h) {
      if (h.lease == recall->lease) returned.unrendered.push_back(h.key());
      return h.lease == recall->lease;
    });
    if (!returned.unrendered.empty()) note(rig.send(LeaseCameBack{sent.worker, returned}));
  }
  void note(std::vector<Effect> come) {
    for (Effect& e : come) {
      if (const auto* sent = std::get_if<Send>(&e)) answer(*sent);
      if (const auto* r = std::get_if<RecordUnit>(&e)) accepted[r->unit] = r->digest;
      if (const auto* f = std::get_if<JobFinished>(&e)) finished[f->job.value] = now();
      if (const auto* d = std::get_if<TileDiscarded>(&e))
        std::erase_if(accepted,
                      [&](const auto& a) { return a.first.job == d->job && a.first.tile == d->tile; });
      if (!std::holds_alternative<Fold>(e) && !std::holds_alternative<Send>(e))
        effects.push_back(std::move(e));
    }
  }

  double begin_ = 0, tick_at_ = .1;
  std::uint64_t order_ = 0;
  std::priority_queue<Busy> busy_;
  std::map<std::string, int> threads_, working_;
};

}  // namespace ls::coordinator
