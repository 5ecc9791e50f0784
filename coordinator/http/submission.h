// The last step of every way in which a job is handed in, whatever its body was.
#pragma once

#include "coordinator/http/api.h"

namespace ls::http {

// The text of a scene file in the store; at most kMaxSceneXml bytes.
Result<std::string> read_scene_blob(Api& api, const Digest& digest);

// Submits and answers: 201 {id, url, warnings}, or why not, with the scene's diagnostics.
Response submit_job(Api& api, coordinator::SubmitRequest request, const Caller& caller);

// 403 where a user asks for more than Limits::user_priority: higher ones go before all lower ones, also of
// others.
std::optional<Response> refuse_priority(const Api& api, const Caller& caller, int priority);

}  // namespace ls::http
