// Many workers in one process, to load a coordinator: each has its own connection and stream, takes leases,
// and after the time that a unit shall take hands in a partial of the right form with plain pixels.
//   scale_load --coordinator HOST:PORT --workers N --seconds S [--unit-ms D] [--units U]
//   (LIGHTSHAFT_JOIN_TOKEN)
// Prints JSON: units handed in and acknowledged, how long it took until they were durable and acknowledged
// (ack), from the result that made room until another lease came (dispatch), and how long workers stood
// without a unit (gap). bench/scale.py makes its tables with it.
#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <map>
#include <mutex>
#include <queue>
#include <thread>

#include "core/base/overloaded.h"
#include "core/image/film/partial.h"
#include "worker/client/client.h"
#include "worker/fake/fake.h"

namespace ls::bench {
namespace {

using Instant = std::chrono::steady_clock::time_point;
double seconds_between(Instant a, Instant b) { return std::chrono::duration<double>(b - a).count(); }

struct Work {
  JobId job;
  LeaseId lease;
  LeaseUnit unit;
};

// What has been measured; one mutex, since it is touched a few thousand times a second.
struct Measured {
  std::mutex mutex;
  std::uint64_t sent = 0, acknowledged = 0, refused = 0, welcomed = 0, lost = 0;
  std::vector<float> ack, dispatch, gap;  // seconds
};

class Load;

// One worker with one thread: it renders its units in order.
class Worker final : public worker::LinkObserver {
 public:
  Worker(Load& load, const std::string& address, const std::string& token)
      : load_(load), link_(worker::make_grpc_link(address, token)) {}
  void received(ToWorker message) override;
  void lost(Error why) override;
  void finish();  // the unit in hand is rendered
  worker::CoordinatorLink& link() { return *link_; }

 private:
  void begin_locked(Instant now);
  void replaced_locked(Instant now);

  Load& load_;
  std::unique_ptr<worker::CoordinatorLink> link_;
  std::mutex mutex_;
  std::map<JobId, JobBrief> briefs_;
  std::deque<Work> queue_;
  std::optional<Work> in_hand_;
  std::map<UnitKey, Instant> unacknowledged_;
  std::optional<Instant> idle_since_;  // without a unit
  std::optional<Instant> room_since_;  // the last result, if no lease came after it
};

class Load {
 public:
  Load(double unit_seconds, std::uint64_t most_units) : unit_(unit_seconds), most_(most_units) {}

  Measured measured;

  double unit_seconds() const { return unit_; }
  void due_in_a_unit(Worker& worker, Instant now) {
    const std::lock_guard lock(mutex_);
    // Workers do not beat in time: the first turn of each is of another length.
    const double factor = .5 + static_cast<double>((turn_++ * 2654435761u) & 1023) / 1024;
    due_.push({now + std::chrono::duration_cast<std::chrono::nanoseconds>(
                         std::chrono::duration<double>(unit_ * factor)),
               &worker});
    woken_.notify_one();
  }
  void run(Instant until) {
    std::unique_lock lock(mutex_);
    while (std::chrono::steady_clock::now() < until && !enough()) {
      if (due_.empty()) {
        woken_.wait_until(lock, until);
        continue;
      }
      const Due next = due_.top();
      if (std::chrono::steady_clock::now() < next.at) {
        woken_.wait_until(lock, std::min(next.at, until));
        continue;
      }
      due_.pop();
      lock.unlock();
      next.worker->finish();
      lock.lock();
    }
  }

 private:
  struct Due {
    Instant at;
    Worker* worker;
    bool operator<(const Due& o) const { return at > o.at; }
  };
  bool enough() {
    const std::lock_guard lock(measured.mutex);
    return measured.acknowledged >= most_;  // what is only on the way is lost when this process ends
  }

  double unit_;
  std::uint64_t most_;
  std::mutex mutex_;
  std::condition_variable woken_;
  std::priority_queue<Due> due_;
  std::uint32_t turn_ = 0;
};

void Worker::begin_locked(Instant now) {
  if (in_hand_) return;
  if (queue_.empty()) {
    idle_since_ = now;
    return;
  }
  if (idle_since_) {
    const std::lock_guard measuring(load_.measured.mutex);
    load_.measured.gap.push_back(static_cast<float>(seconds_between(*idle_since_, now)));
    idle_since_.reset();
  }
  in_hand_ = std::move(queue_.front());
  queue_.pop_front();
  load_.due_in_a_unit(*this, now);
}

// A lease came: for the last result, since results make room, though not each (a worker holds some seconds of
// work). Units take far longer than this, so that the last result is the one. The first leases are for none.
void Worker::replaced_locked(Instant now) {
  if (!room_since_) return;
  const std::lock_guard measuring(load_.measured.mutex);
  load_.measured.dispatch.push_back(static_cast<float>(seconds_between(*room_since_, now)));
  room_since_.reset();
}

void Worker::received(ToWorker message) {
  const Instant now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  std::visit(
      overloaded{
          [&](const Welcome&) {
            const std::lock_guard measuring(load_.measured.mutex);
            ++load_.measured.welcomed;
          },
          [&](const Refused& m) {
            fmt::print(stderr, "refused: {}\n", m.error.message);
            std::exit(1);
          },
          [&](const AssignLease& m) {
            if (m.brief) briefs_[m.lease.job] = *m.brief;
            for (const LeaseUnit& unit : m.lease.units) queue_.push_back({m.lease.job, m.lease.id, unit});
            replaced_locked(now);
            begin_locked(now);
          },
          [&](const ResultAck& m) {
            const auto sent = unacknowledged_.find(m.unit);
            if (sent == unacknowledged_.end()) return;
            const std::lock_guard measuring(load_.measured.mutex);
            ++load_.measured.acknowledged;
            load_.measured.refused += m.refused.has_value();
            load_.measured.ack.push_back(static_cast<float>(seconds_between(sent->second, now)));
            unacknowledged_.erase(sent);
          },
          [&](const CancelLease& m) {
            std::erase_if(queue_, [&](const Work& w) { return w.lease == m.lease; });
          },
          [&](const CancelJob& m) { std::erase_if(queue_, [&](const Work& w) { return w.job == m.job; }); },
          [](const RecallLease&) {}, [](const DrainNow&) {}},
      message);
}

void Worker::lost(Error) {
  const std::lock_guard measuring(load_.measured.mutex);
  ++load_.measured.lost;
}

void Worker::finish() {
  std::unique_lock lock(mutex_);
  const Work work = std::move(*in_hand_);
  in_hand_.reset();
  const JobBrief& brief = briefs_.at(work.job);
  Partial partial{
      {brief.scene, brief.settings_digest, worker::fake_numeric_class(), work.unit.rect, work.unit.samples},
      {},
      {}};
  const auto half = static_cast<float>(work.unit.samples.count() / 2);
  partial.sums.resize(static_cast<std::size_t>(work.unit.rect.pixels()) * kPartialChannels);
  for (std::size_t i = 0; i < partial.sums.size(); ++i)
    partial.sums[i] = half * (1.f + static_cast<float>(i & 7) / 64);
  UnitResult result;
  result.unit = {work.job, work.unit.tile, work.unit.round};
  result.lease = work.lease;
  result.exr = encode_partial(partial, brief.settings.size).value();
  result.digest = unit_digest(partial);
  result.cpu_seconds = std::max(1e-3, load_.unit_seconds());  // leases are made by it
  const Instant now = std::chrono::steady_clock::now();
  unacknowledged_[result.unit] = now;
  room_since_ = now;
  begin_locked(now);
  lock.unlock();
  {
    const std::lock_guard measuring(load_.measured.mutex);
    ++load_.measured.sent;
  }
  link_->send(std::move(result));
}

double quantile(std::vector<float>& values, double q) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

void print(Measured& m, double seconds, double cpu) {
  const std::lock_guard lock(m.mutex);
  const auto figures = [](std::vector<float>& v) {
    return fmt::format("{{\"n\":{},\"p50\":{:.6f},\"p90\":{:.6f},\"p99\":{:.6f}}}", v.size(), quantile(v, .5),
                       quantile(v, .9), quantile(v, .99));
  };
  fmt::print(
      "{{\"seconds\":{:.3f},\"sent\":{},\"acknowledged\":{},\"refused\":{},\"lost\":{},\"cpu_seconds\":{:.3f}"
      ","
      "\"ack\":{},\"dispatch\":{},\"gap\":{}}}\n",
      seconds, m.sent, m.acknowledged, m.refused, m.lost, cpu, figures(m.ack), figures(m.dispatch),
      figures(m.gap));
}

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto of = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return of(usage.ru_utime) + of(usage.ru_stime);
}

struct Flags {
  std::string address;
  int workers = 100;
  double seconds = 10, warm_up = 2, unit_ms = 0;
  std::uint64_t units = ~std::uint64_t{0};
};

int run(const Flags& flags) {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
  const char* token = std::getenv("LIGHTSHAFT_JOIN_TOKEN");
  Load load(flags.unit_ms / 1000, flags.units);
  std::vector<std::shared_ptr<Worker>> workers;
  for (int i = 0; i < flags.workers; ++i) {
    WorkerHello hello;
    hello.name = fmt::format("load-{}", i);
    hello.build = "load";
    hello.numeric_class = worker::fake_numeric_class();
    hello.fake = true;
    hello.join_token = token ? token : "";
    workers.push_back(std::make_shared<Worker>(load, flags.address, hello.join_token));
    if (auto connected = workers.back()->link().connect(hello, workers.back()); !connected) return 1;
  }
  const auto start = std::chrono::steady_clock::now();
  const auto after = [](Instant t, double s) {
    return t + std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(s));
  };
  load.run(after(start, flags.warm_up));
  {
    const std::lock_guard lock(load.measured.mutex);
    if (load.measured.welcomed < static_cast<std::uint64_t>(flags.workers))
      fmt::print(stderr, "only {} of {} workers are welcome so far\n", load.measured.welcomed, flags.workers);
    load.measured.ack.clear(), load.measured.dispatch.clear(), load.measured.gap.clear();
    load.measured.acknowledged = 0;
  }
  const double cpu = cpu_seconds();
  const auto begin = std::chrono::steady_clock::now();
  fmt::print("begin\n");
  std::fflush(stdout);
  load.run(after(begin, flags.seconds));
  print(load.measured, seconds_between(begin, std::chrono::steady_clock::now()), cpu_seconds() - cpu);
  std::fflush(stdout);
  std::_Exit(0);  // a thousand polite good-byes are not what is measured
}

}  // namespace
}  // namespace ls::bench

int main(int argc, char** argv) {
  ls::bench::Flags flags;
  CLI::App app("Loads a coordinator with many workers of one process.");
  app.add_option("--coordinator", flags.address)->required();
  app.add_option("--workers", flags.workers)->check(CLI::Range(1, 20000));
  app.add_option("--seconds", flags.seconds);
  app.add_option("--warm-up", flags.warm_up);
  app.add_option("--unit-ms", flags.unit_ms, "that a unit takes; 0: none");
  app.add_option("--units", flags.units, "ends after so many are acknowledged");
  CLI11_PARSE(app, argc, argv);
  return ls::bench::run(flags);
}
