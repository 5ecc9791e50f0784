// The steps that all submissions of jobs share, whether the body was a scene, JSON or an archive.
#pragma once

#include "coordinator/http/api/api.h"

namespace ls::http {

// Returns the text of a scene file from the blob store; a file of more than kMaxSceneXml bytes is an error.
Result<std::string> read_scene_blob(Api& api, const Digest& digest);

// Submits the job and answers: 201 {id, url, warnings}, or the error with the scene's diagnostics.
Response submit_job(Api& api, coordinator::SubmitRequest request, const Caller& caller);

// Returns a 403 if a caller with a submit token asks for a priority above Limits::user_priority, because jobs
// of a higher priority are rendered before all jobs of lower ones, including those of other users. nullopt:
// the priority is allowed.
std::optional<Response> refuse_priority(const Api& api, const Caller& caller, int priority);

}  // namespace ls::http
