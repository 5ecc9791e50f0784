#include "cli/scale/costs.h"

#include <algorithm>
#include <utility>

#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr double kNoBudget = std::numeric_limits<double>::infinity();

std::string user_called(const std::string& owner) { return owner.empty() ? "admin" : owner; }

}  // namespace

void Ledger::observe(std::span<const EngineWorker> workers, double elapsed) {
  std::map<std::string, Line> now;
  for (const auto& w : workers) {
    unlisted_.erase(w.id);
    if (w.state != EngineWorker::State::running) continue;
    const auto before = running_.find(w.id);
    // If the worker has run for a shorter time than at the previous call, its earlier run has ended and the
    // engine has started it again.
    const bool same_run = before != running_.end() && w.seconds >= before->second.seconds;
    if (same_run)
      running_.erase(before);
    else
      ++started_;
    now.emplace(w.id, Line{w.seconds, w.cores});
  }
  for (const auto& [id, line] : running_) ended_ += (line.seconds + elapsed) * line.cores;
  running_ = std::move(now);
  for (const auto& [id, cores] : unlisted_) ended_ += elapsed * cores;
  started_ += static_cast<int>(unlisted_.size());
  unlisted_.clear();
}

void Ledger::started(std::span<const std::string> ids, int cores) {
  for (const std::string& id : ids) unlisted_.emplace(id, cores);
}

double Ledger::core_seconds() const {
  double sum = ended_;
  for (const auto& [id, line] : running_) sum += line.seconds * line.cores;
  return sum;
}

json Ledger::to_json() const {
  json running = json::object();
  for (const auto& [id, line] : running_) running[id] = {{"seconds", line.seconds}, {"cores", line.cores}};
  return {{"ended_core_seconds", ended_}, {"started", started_}, {"running", std::move(running)}};
}

Result<Ledger> Ledger::from_json(const json& j) {
  const auto ended = number_field(j, "ended_core_seconds");
  const auto running = j.is_object() ? j.find("running") : j.end();
  if (!ended || running == j.end() || !running->is_object())
    return bad_argument("it has no sum of core seconds");
  Ledger ledger;
  ledger.ended_ = *ended;
  ledger.started_ = int_field(j, "started", 0);
  for (const auto& [id, line] : running->items()) {
    const auto seconds = number_field(line, "seconds");
    if (!seconds) return bad_argument("the worker " + id + " has no seconds");
    ledger.running_.emplace(id, Line{*seconds, int_field(line, "cores", 1)});
  }
  return ledger;
}

void Spending::observe(std::span<const JobCost> jobs, std::span<const WorkerCost> workers) {
  for (const JobCost& cost : jobs) {
    const auto [it, is_new] = jobs_.try_emplace(cost.id);
    Job& job = it->second;
    job.name = cost.name, job.owner = cost.owner;
    if (is_new && !begun_) job.before = cost.core_seconds;
    // A coordinator that was killed may have lost the latest results, and then reports less. The core seconds
    // were still spent, so a sum never falls.
    job.now = std::max(job.now, cost.core_seconds);
  }
  for (const WorkerCost& cost : workers) {
    const auto [it, is_new] = workers_.try_emplace(cost.id);
    Worker& worker = it->second;
    worker.engine = cost.engine;
    if (is_new && !begun_) worker.before = cost.core_seconds;
    // A worker that reports less than before was restarted. What its earlier process has cost is kept.
    if (cost.core_seconds < worker.now) worker.earlier += worker.now - std::exchange(worker.before, 0);
    worker.now = cost.core_seconds;
  }
  begun_ = true;
}

double Spending::of_job(const std::string& id) const {
  const auto job = jobs_.find(id);
  return job == jobs_.end() ? 0 : job->second.now - job->second.before;
}

double Spending::of_user(const std::string& owner) const {
  double sum = 0;
  for (const auto& [id, job] : jobs_)
    if (job.owner == owner) sum += job.now - job.before;
  return sum;
}

double Spending::left_of_job(const std::string& id) const {
  return budgets_.job ? *budgets_.job - of_job(id) : kNoBudget;
}

double Spending::left_of_user(const std::string& owner) const {
  const auto named = budgets_.users.find(owner);
  if (named != budgets_.users.end()) return named->second - of_user(owner);
  return budgets_.user ? *budgets_.user - of_user(owner) : kNoBudget;
}

json Spending::report() const {
  json by_job = json::object(), by_user = json::object(), by_engine = json::object();
  const auto add = [](json& sums, const std::string& key, double core_seconds) {
    sums[key] = sums.value(key, 0.0) + core_seconds / kCoreHour;
  };
  for (const auto& [id, job] : jobs_) {
    if (job.now <= job.before) continue;
    by_job[id] = {
        {"name", job.name}, {"user", user_called(job.owner)}, {"core_hours", of_job(id) / kCoreHour}};
    add(by_user, user_called(job.owner), of_job(id));
  }
  for (const auto& [id, w] : workers_) add(by_engine, w.engine, w.earlier + w.now - w.before);
  return {{"by_job", by_job}, {"by_user", by_user}, {"by_engine", by_engine}};
}

json Spending::to_json() const {
  json jobs = json::object(), workers = json::object();
  for (const auto& [id, job] : jobs_)
    jobs[id] = {{"name", job.name}, {"owner", job.owner}, {"before", job.before}, {"now", job.now}};
  for (const auto& [id, w] : workers_)
    workers[id] = {{"engine", w.engine}, {"earlier", w.earlier}, {"before", w.before}, {"now", w.now}};
  return {{"jobs", jobs}, {"workers", workers}, {"begun", begun_}};
}

Result<void> Spending::go_on_from(const json& j) {
  for (const char* key : {"jobs", "workers"})
    if (!j.is_object() || !j.contains(key) || !j[key].is_object())
      return bad_argument("it has no sums of jobs and workers");
  for (const auto& [id, line] : j["jobs"].items()) {
    const auto before = number_field(line, "before"), now = number_field(line, "now");
    if (!before || !now) return bad_argument("the job " + id + " has no core seconds");
    jobs_[id] = {text_field(line, "name"), text_field(line, "owner"), *before, *now};
  }
  for (const auto& [id, line] : j["workers"].items()) {
    const auto before = number_field(line, "before"), now = number_field(line, "now");
    if (!before || !now) return bad_argument("the worker " + id + " has no core seconds");
    workers_[id] = {text_field(line, "engine"), number_field(line, "earlier").value_or(0), *before, *now};
  }
  begun_ = flag_field(j, "begun");
  return {};
}

}  // namespace ls::cli
