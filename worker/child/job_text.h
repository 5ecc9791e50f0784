// Converts a LocalJob (a job whose files are on this machine) to text and back, to send it to the render
// child.
#pragma once

#include <string>
#include <string_view>

#include "common/base/error.h"
#include "worker/agent/backend.h"

namespace ls::worker::child {

std::string to_text(const LocalJob& job);
Result<LocalJob> from_text(std::string_view text);

}  // namespace ls::worker::child
