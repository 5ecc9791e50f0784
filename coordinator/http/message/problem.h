// Errors as RFC 9457 problem details, and the only mapping from Errc to HTTP status.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/error.h"
#include "common/scene/diagnostic.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

int status_of(Errc code);

// Makes a response {type, title, status, detail}; `detail` contains the cause, the place and the remedy.
Response problem(int status, std::string_view detail);
Response problem(const Error& error);
// Returns a 429 with the header Retry-After: `wait_seconds`.
Response too_many(int wait_seconds, std::string_view detail);
// Returns the problem of a rejected scene. It has an additional member diagnostics: [{severity, file, line,
// column, text, source_line, length}].
Response problem(const Error& error, std::span<const Diagnostic> diagnostics);

}  // namespace ls::http
