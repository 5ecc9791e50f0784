// The last step of every submission, whatever its body was.
#pragma once

#include "coordinator/http/api/api.h"

namespace ls::http {

// The text of a scene file in the store; at most kMaxSceneXml bytes.
Result<std::string> read_scene_blob(Api& api, const Digest& digest);

// Submits the job and answers: 201 {id, url, warnings}, or the error with the scene's diagnostics.
Response submit_job(Api& api, coordinator::SubmitRequest request, const Caller& caller);

// 403 if a user asks for a priority above Limits::user_priority: higher priorities go before all lower ones,
// including those of other users. nullopt: allowed.
std::optional<Response> refuse_priority(const Api& api, const Caller& caller, int priority);

}  // namespace ls::http
