#include "cli/scale/demand.h"

#include <algorithm>
#include <map>

#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

const json& list_in(const json& answer, const char* key) {
  static const json none = json::array();
  const auto found = answer.find(key);
  return found != answer.end() && found->is_array() ? *found : none;
}

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
    const auto more = job.find("eta_with_more");
    helps |= more != job.end() && more->is_object();
  }
  demand.more_helps = !forecast || helps;
}

}  // namespace

Demand demand_of(const json& jobs, const json& workers, const OurWorkers& ours, Spending& spending) {
  observe(spending, list_in(jobs, "jobs"), list_in(workers, "workers"), ours);
  Demand demand;
  read_jobs(list_in(jobs, "jobs"), spending, demand);
  for (const json& worker : list_in(workers, "workers")) {
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

FarmApi::Answer<Demand> ask_demand(FarmApi& api, const OurWorkers& ours, Spending& spending) {
  const auto jobs = api.get("/api/v1/jobs");
  if (!jobs) return tl::unexpected(jobs.error());
  const auto workers = api.get("/api/v1/workers");
  if (!workers) return tl::unexpected(workers.error());
  return demand_of(*jobs, *workers, ours, spending);
}

}  // namespace ls::cli
