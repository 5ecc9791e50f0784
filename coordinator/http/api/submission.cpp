#include "coordinator/http/api/submission.h"

#include <fmt/format.h>

#include "coordinator/http/message/json_read.h"
#include "coordinator/http/message/problem.h"

namespace ls::http {

Result<std::string> read_scene_blob(Api& api, const Digest& digest) {
  auto& blobs = api.coordinator().blobs();
  if (!blobs.has(digest))
    return fail(Errc::failed_precondition,
                fmt::format("the scene's blob {0} is not here: PUT /api/v1/blobs/{0} first", digest.hex()));
  const auto size = blobs.size(digest);
  if (!size) return tl::unexpected(size.error());
  if (*size > kMaxSceneXml)
    return fail(Errc::invalid_argument,
                fmt::format("the scene file has {} bytes; at most {} are accepted", *size, kMaxSceneXml));
  const auto bytes = blobs.read(digest, 0, *size);
  if (!bytes) return tl::unexpected(bytes.error());
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

std::optional<Response> refuse_priority(const Api& api, const Caller& caller, int priority) {
  if (caller.role != Role::submit || priority <= api.limits().user_priority) return std::nullopt;
  return problem(
      403, fmt::format("priority {} goes before other users' jobs: with a token of the role 'submit' at most "
                       "{} is possible; ask the administrator (--user-priority)",
                       priority, api.limits().user_priority));
}

Response submit_job(Api& api, coordinator::SubmitRequest request, const Caller& caller) {
  if (auto refused = refuse_priority(api, caller, request.spec.priority)) return std::move(*refused);
  const auto id = api.coordinator().submit(std::move(request));
  if (!id) return problem(id.error().error, id.error().diagnostics);
  const std::string url = "/api/v1/jobs/" + id->value;
  const auto job = api.coordinator().job(*id);
  nlohmann::ordered_json body{{"id", id->value}, {"url", url}};
  body["warnings"] = job ? job->warnings : std::vector<std::string>{};
  body["reference_same_seed"] = job && job->reference_same_seed;
  Response response = json_response(201, write_json(body));
  response.headers.emplace_back("Location", url);
  return response;
}

}  // namespace ls::http
