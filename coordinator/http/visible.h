// What of the farm a caller sees in what is about all users.
#pragma once

#include <optional>

#include "coordinator/http/caller.h"
#include "coordinator/service.h"

namespace ls::http {

// Of a worker: what it does for others.
void hide_work(coordinator::WorkerView& worker);

// The event as this caller may see it; nothing: not at all.
std::optional<coordinator::StreamEvent> visible(const coordinator::StreamEvent& event, const Caller& caller);

}  // namespace ls::http
