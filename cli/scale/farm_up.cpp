#include "cli/scale/farm_up.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>

#include "cli/output/console.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

double positive_field(const json& object, const char* key) {
  return std::max(0.0, number_field(object, key).value_or(0));
}

void observe(Spending& spending, const json& jobs, const json& workers, const OurWorkers& ours) {
  std::vector<JobCost> job_costs;
  for (const json& job : jobs)
    job_costs.push_back({text_field(job, "id"), text_field(job, "name"), text_field(job, "owner"),
                         positive_field(job, "core_seconds")});
  std::vector<WorkerCost> worker_costs;
  for (const json& worker : workers) {
    const bool is_ours = text_field(worker, "name").starts_with(ours.farm + "-");
    worker_costs.push_back(
        {text_field(worker, "id"), is_ours ? ours.engine : "others", positive_field(worker, "cpu_seconds")});
  }
  spending.observe(job_costs, worker_costs);
}

void read_jobs(const json& jobs, const Spending& spending, Demand& demand) {
  bool forecast = false, helps = false;
  std::map<std::string, double> left_of_user;
  for (const json& job : jobs) {
    const std::string state = text_field(job, "state"), owner = text_field(job, "owner");
    if (state != "queued" && state != "running") continue;
    double& left_of_owner = left_of_user.try_emplace(owner, spending.left_of_user(owner)).first->second;
    const double left = std::min(left_of_owner, spending.left_of_job(text_field(job, "id")));
    if (left <= 0) {
      ++demand.unpaid_jobs;
      continue;
    }
    ++demand.open_jobs;
    const double queued = std::min(left, positive_field(job, "queued_core_seconds"));
    demand.queued_core_seconds += queued;
    left_of_owner -= queued;
    if (!number_field(job, "eta_seconds")) {
      helps = true;  // without a forecast, assume that more workers help
      continue;
    }
    forecast = true;
    helps |= object_field(job, "eta_with_more") != nullptr;
  }
  demand.more_helps = !forecast || helps;
}

// The pause between two checks. It ends early if the user asks `farm up` to end.
class Pause {
 public:
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    wake_.notify_all();
  }
  // Returns true if the user has asked `farm up` to end.
  bool wait(double seconds) {
    std::unique_lock lock(mutex_);
    const bool before = ended_;
    wake_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return ended_ != before; });
    return ended_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ended_ = false;
};

// Prints a message only if it differs from the previous one.
class Notes {
 public:
  void print(const std::string& text) {
    if (text != last_ && !text.empty()) print_note("lightshaft: " + text);
    last_ = text;
  }

 private:
  std::string last_;
};

// Loads the costs in the report of an earlier run, so that this run continues them. Does nothing if there is
// no report.
Result<void> go_on_from(const std::filesystem::path& file, const std::string& farm, Ledger& ledger,
                        Spending& spending) {
  std::ifstream in(file);
  if (!in) return {};
  const json j = json::parse(in, nullptr, false);
  if (!j.is_object())
    return bad_argument(file.string() + " is no report of `farm up`: give another --report");
  if (text_field(j, "name") != farm)
    return bad_argument(fmt::format("{} is the report of '{}': give another --report or this --name",
                                    file.string(), text_field(j, "name")));
  const auto named = [&](const Error& error) {
    return bad_argument(fmt::format("{}: {}", file.string(), error.message));
  };
  auto read = Ledger::from_json(j.value("ledger", json()));
  if (!read) return named(read.error());
  ledger = std::move(*read);
  if (!j.contains("spending")) return {};
  const auto went_on = spending.go_on_from(j["spending"]);
  return went_on ? Result<void>{} : named(went_on.error());
}

FarmApi::Answer<Demand> ask_demand(FarmApi& api, const OurWorkers& ours, Spending& spending) {
  const auto jobs = api.get("/api/v1/jobs");
  if (!jobs) return tl::unexpected(jobs.error());
  const auto workers = api.get("/api/v1/workers");
  if (!workers) return tl::unexpected(workers.error());
  return demand_of(*jobs, *workers, ours, spending);
}

class FarmUp {
 public:
  FarmUp(FarmApi& api, Engine& engine, const FarmUpOptions& options, Ledger ledger, Spending spending)
      : api_(api),
        engine_(engine),
        options_(options),
        scaler_(options.limits),
        ledger_(std::move(ledger)),
        spending_(std::move(spending)) {}

  int run(Pause& pause) {
    bool ending = false;
    for (;; ending |= pause.wait(options_.limits.poll_seconds)) {
      const auto workers = engine_.list();
      if (!workers) {
        notes_.print(fmt::format("the workers are unknown, nothing changes: {}", workers.error().message));
        continue;
      }
      const TimePoint now = clock_.now();
      ledger_.observe(*workers, last_list_ ? seconds(now - *last_list_) : 0);
      last_list_ = now;
      if (const auto asked = look_at_jobs(); !asked) return print_rejected(asked.error());
      ending |= options_.until_done && demand_.open_jobs == 0;
      if (ending && workers->empty()) return finish();
      act(ending ? scaler_.end(*workers, now)
                 : scaler_.decide(demand_, *workers, ledger_.core_seconds(), now));
      if (const auto kept = write_report(); !kept) notes_.print(kept.error().message);
    }
  }

 private:
  // Asks the coordinator for the demand (how much work waits). While the coordinator does not answer, the
  // number of workers does not change. Returns an error only if the coordinator has never answered.
  FarmApi::Answer<void> look_at_jobs() {
    auto asked = ask_demand(api_, {options_.limits.farm, engine_.version()}, spending_);
    if (asked) {
      demand_ = std::move(*asked);
      known_ = true;
      return {};
    }
    if (!known_) return tl::unexpected(asked.error());
    demand_.more_helps = false;
    demand_.idle.clear();
    notes_.print("the coordinator does not answer, nothing changes: " + asked.error().error.message);
    return {};
  }

  void act(const ScaleActions& actions) {
    notes_.print(actions.why);
    if (!actions.drain.empty()) {
      print_note(fmt::format("lightshaft: drains {} workers", actions.drain.size()));
      if (const auto done = engine_.drain(actions.drain); !done) {
        scaler_.drain_failed(actions.drain);
        notes_.print(done.error().message);
      }
    }
    if (!actions.kill.empty()) {
      print_note(fmt::format("lightshaft: ends {} workers that did not drain", actions.kill.size()));
      if (const auto done = engine_.kill(actions.kill); !done) notes_.print(done.error().message);
    }
    if (actions.start == 0) return;
    print_note(fmt::format("lightshaft: starts {} workers", actions.start));
    if (const auto ids = engine_.start(actions.start)) {
      scaler_.started(*ids);
      ledger_.started(*ids, options_.limits.threads);
    } else {
      scaler_.start_failed(clock_.now());
      notes_.print(ids.error().message);
    }
  }

  double hours() const { return ledger_.core_seconds() / kCoreHour; }

  json report() const {
    const auto& budget = options_.limits.budget_core_seconds;
    return {{"name", options_.limits.farm},
            {"engine", engine_.version()},
            {"spent_core_hours", hours()},
            {"budget_core_hours", budget ? json(*budget / kCoreHour) : json()},
            {"workers_started", ledger_.started()},
            {"rendered_core_hours", spending_.report()},
            {"ledger", ledger_.to_json()},
            {"spending", spending_.to_json()}};
  }

  Result<void> write_report() const { return write_output(options_.report, dump(report()) + "\n"); }

  int finish() {
    if (const auto kept = write_report(); !kept) return print_error(kept.error());
    if (options_.json) {
      print(dump(report()));
      return kOk;
    }
    const auto& budget = options_.limits.budget_core_seconds;
    print(fmt::format("{}: {} workers started, {:.3f} core hours spent{}", engine_.version(),
                      ledger_.started(), hours(),
                      budget ? fmt::format(" of {:.3f}", *budget / kCoreHour) : ""));
    const json rendered = spending_.report();
    for (const auto& [user, core_hours] : rendered["by_user"].items())
      print(fmt::format("{}: {:.3f} core hours rendered", user, core_hours.get<double>()));
    return kOk;
  }

  FarmApi& api_;
  Engine& engine_;
  const FarmUpOptions& options_;
  const SystemClock clock_;
  Scaler scaler_;
  Ledger ledger_;
  Spending spending_;
  Demand demand_;
  bool known_ = false;
  std::optional<TimePoint> last_list_;
  Notes notes_;
};

}  // namespace

int run_farm_up(FarmApi& api, Engine& engine, const FarmUpOptions& options, Interrupt& interrupt) {
  Ledger ledger;
  Spending spending(options.budgets);
  if (const auto read = go_on_from(options.report, options.limits.farm, ledger, spending); !read)
    return print_error(read.error());
  if (const auto writable = check_output("--report", options.report); !writable)
    return print_error(writable.error());
  Pause pause;
  interrupt.on_signal([&pause] { pause.end(); });
  return FarmUp(api, engine, options, std::move(ledger), std::move(spending)).run(pause);
}

Demand demand_of(const json& jobs, const json& workers, const OurWorkers& ours, Spending& spending) {
  observe(spending, list_field(jobs, "jobs"), list_field(workers, "workers"), ours);
  Demand demand;
  read_jobs(list_field(jobs, "jobs"), spending, demand);
  for (const json& worker : list_field(workers, "workers")) {
    const std::string name = text_field(worker, "name");
    if (text_field(worker, "state") != "connected") continue;
    if (!name.starts_with(ours.farm + "-")) {
      demand.other_threads += int_field(worker, "threads", 0);
      continue;
    }
    demand.joined.insert(name);
    if (text_field(worker, "job").empty()) demand.idle.insert(name);
  }
  return demand;
}

}  // namespace ls::cli
