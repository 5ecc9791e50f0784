// Handlers for videos of sequences.
#include <fmt/format.h>

#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/views/views.h"

namespace ls::http {
namespace {

using coordinator::VideoAsked;

Result<VideoAsked> read_asked_video(std::string_view text) {
  const auto body = read_object(text, {"fps", "exposure", "layer"});
  if (!body) return tl::unexpected(body.error());
  VideoAsked asked;
  for (const auto& [key, value] : {std::pair("fps", &asked.fps), std::pair("exposure", &asked.exposure)}) {
    const auto found = body->find(key);
    if (found == body->end()) continue;
    if (!found->is_number()) return bad_argument(fmt::format("'{}' must be a number", key));
    *value = found->get<double>();
  }
  if (const auto layer = body->find("layer"); layer != body->end()) {
    if (*layer != "rgb" && *layer != "denoised")
      return bad_argument("'layer' must be \"rgb\" or \"denoised\"");
    asked.denoised = *layer == "denoised";
  }
  return asked;
}

}  // namespace

Response post_video(Api& api, const Request& request, const JobId& id) {
  if (const auto job = api.coordinator().job(id); !job) return problem(job.error());
  const auto asked = read_asked_video(request.body);
  if (!asked) return problem(asked.error());
  const auto video = api.coordinator().make_video(id, *asked);
  return video ? json_response(202, coordinator::video_json(*video)) : problem(video.error());
}

Response get_video(Api& api, const Request&, const JobId& id) {
  const auto video = api.coordinator().video(id);
  return video ? json_response(200, coordinator::video_json(*video)) : problem(video.error());
}

Response get_video_mp4(Api& api, const Request&, const JobId& id) {
  const auto path = api.coordinator().video_file(id);
  if (!path) return problem(path.error());
  auto file = open_file_body(*path);
  if (!file) return problem(404, fmt::format("the video of job {} is gone: ask for it again", id.value));
  return {.content_type = "video/mp4",
          .headers = {{"Content-Disposition", fmt::format("inline; filename=\"{}.mp4\"", id.value)}},
          .body = std::move(*file)};
}

}  // namespace ls::http
