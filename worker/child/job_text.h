// A LocalJob as text, for the way into the render child.
#pragma once

#include <string>
#include <string_view>

#include "common/base/error.h"
#include "worker/backend.h"

namespace ls::worker::child {

std::string to_text(const LocalJob& job);
Result<LocalJob> from_text(std::string_view text);

}  // namespace ls::worker::child
