#include "coordinator/http/auth/visible.h"

#include <nlohmann/json.hpp>

namespace ls::http {

void hide_work(coordinator::WorkerView& worker) {
  worker.job.clear();
  worker.activity.clear();
}

std::optional<coordinator::StreamEvent> visible(const coordinator::StreamEvent& event, const Caller& caller) {
  if (caller.role != Role::submit) return event;
  if (event.type != "worker") return caller.sees(event.owner) ? std::optional(event) : std::nullopt;
  auto worker = nlohmann::json::parse(event.data, nullptr, false);
  if (!worker.is_object()) return std::nullopt;
  const auto job = worker.find("job");
  if (job == worker.end()) return std::nullopt;
  if (!job->is_null() && caller.sees(event.owner)) return event;
  coordinator::StreamEvent hidden = event;
  *job = nullptr;
  worker["activity"] = "";
  hidden.data = worker.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return hidden;
}

}  // namespace ls::http
