// Restricts farm-wide data to what a caller may see.
#pragma once

#include <optional>

#include "coordinator/http/message/caller.h"
#include "coordinator/views/job_view.h"

namespace ls::http {

// Removes what the worker does for other users.
void hide_work(coordinator::WorkerView& worker);

// The event as this caller may see it; nullopt: not at all.
std::optional<coordinator::StreamEvent> visible(const coordinator::StreamEvent& event, const Caller& caller);

}  // namespace ls::http
