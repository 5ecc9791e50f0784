#include "cli/scale/ledger.h"

#include "cli/output/reply_fields.h"

namespace ls::cli {

using nlohmann::json;

void Ledger::observe(std::span<const EngineWorker> workers, double elapsed) {
  std::map<std::string, Line> now;
  for (const auto& w : workers) {
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

}  // namespace ls::cli
