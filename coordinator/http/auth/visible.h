// Restricts farm-wide data to what a caller may see.
#pragma once

#include <optional>

#include "coordinator/http/message/caller.h"
#include "coordinator/views/job_view.h"

namespace ls::http {

// Clears the fields of `worker` that show what it does for other users' jobs.
void hide_work(coordinator::WorkerView& worker);

// Returns the event without what this caller may not see; nullopt: the caller may not see the event at all.
std::optional<coordinator::StreamEvent> visible(const coordinator::StreamEvent& event, const Caller& caller);

}  // namespace ls::http
