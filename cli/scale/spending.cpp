#include "cli/scale/spending.h"

#include <algorithm>
#include <utility>

#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr double kNoBudget = std::numeric_limits<double>::infinity();

std::string user_called(const std::string& owner) { return owner.empty() ? "admin" : owner; }

}  // namespace

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
    // A worker that has rendered less than before was restarted.
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
