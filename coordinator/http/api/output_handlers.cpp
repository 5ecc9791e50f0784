// Handlers that return the output of jobs: images and their layers, videos, reports, logs.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>

#include "coordinator/base/limits.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/service/pages/report_page.h"
#include "coordinator/views/views.h"
#include "core/base/parse_number.h"
#include "util/report/job_page.h"

namespace ls::http {
namespace {

using coordinator::VideoAsked;

template <class Body>
Response file_response(std::string content_type, Result<Body> bytes, const std::string& name) {
  if (!bytes) return problem(bytes.error());
  return {.content_type = std::move(content_type),
          .headers = {{"Content-Disposition", fmt::format("inline; filename=\"{}\"", name)}},
          .body = std::move(*bytes)};
}

Response answer_json(Result<std::string> json) {
  return json ? json_response(200, std::move(*json)) : problem(json.error());
}

// Parses N non-negative whole numbers, separated by commas; false: the text is anything else.
template <std::size_t N>
bool read_numbers(std::string_view text, std::array<int, N>& out) {
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    if (i > 0 && (at == end || *at++ != ',')) return false;
    const auto [next, error] = std::from_chars(at, end, out[i]);
    if (error != std::errc{} || out[i] < 0) return false;
    at = next;
  }
  return at == end;
}

Result<VideoAsked> read_asked_video(std::string_view text) {
  const auto body = read_object(text, {"fps", "exposure", "layer", "view"});
  if (!body) return tl::unexpected(body.error());
  VideoAsked asked;
  for (const char* key : {"fps", "exposure"})
    if (body->contains(key) && !body->at(key).is_number())
      return bad_argument(fmt::format("'{}' must be a number", key));
  if (body->contains("fps")) asked.fps = body->at("fps").get<double>();
  if (body->contains("exposure")) asked.look.exposure = body->at("exposure").get<double>();
  if (const auto layer = body->find("layer"); layer != body->end()) {
    if (*layer != "rgb" && *layer != "denoised")
      return bad_argument("'layer' must be \"rgb\" or \"denoised\"");
    asked.look.denoised = *layer == "denoised";
  }
  if (const auto view = body->find("view"); view != body->end()) {
    if (!view->is_string()) return bad_argument("'view' must be a text");
    asked.look.view = view->get<std::string>();
  }
  return asked;
}

// Returns the mix of light groups in the query; nullopt: there is none.
Result<std::optional<LightMix>> mix_asked(const Request& request) {
  const auto text = request.parameter("mix");
  if (!text) return std::optional<LightMix>();
  auto mix = parse_light_mix(*text);
  if (!mix) return tl::unexpected(mix.error());
  return std::move(*mix);
}

}  // namespace

Response get_mix(Api& api, const Request& request, const JobId& id) {
  const auto mix = mix_asked(request);
  if (!mix) return problem(mix.error());
  return answer_json(api.coordinator().mix_json(id, mix->value_or(LightMix{})));
}

Response get_image_exr(Api& api, const Request& request, const JobId& id) {
  const auto mix = mix_asked(request);
  if (!mix) return problem(mix.error());
  if (*mix) return file_response("image/x-exr", api.coordinator().image_exr(id, *mix), id.value + "-mix.exr");
  if (const auto path = api.coordinator().final_file(id, "image.exr"); !path.empty())
    if (auto file = open_file_body(path))
      return file_response("image/x-exr", std::move(file), id.value + ".exr");
  return file_response("image/x-exr", api.coordinator().image_exr(id), id.value + ".exr");
}

Response get_deep_exr(Api& api, const Request&, const JobId& id) {
  if (const auto path = api.coordinator().final_file(id, "deep.exr"); !path.empty())
    if (auto file = open_file_body(path))
      return file_response("image/x-exr", std::move(file), id.value + ".deep.exr");
  return file_response("image/x-exr", api.coordinator().deep_exr(id), id.value + ".deep.exr");
}

Response get_image_png(Api& api, const Request& request, const JobId& id) {
  const auto exposure = parse_number<double>(request.parameter("exposure").value_or("0"));
  if (!exposure || !(std::abs(*exposure) <= coordinator::limits::kMaxExposure))
    return problem(400, fmt::format("'exposure' must be a number of stops from -{0} to {0}",
                                    coordinator::limits::kMaxExposure));
  const auto layer = request.parameter("layer");
  if (layer && *layer != "denoised")
    return problem(400, "'layer' must be \"denoised\", or be left out for the image itself");
  const auto mix = mix_asked(request);
  if (!mix) return problem(mix.error());
  const coordinator::Look look{*exposure, layer.has_value(),
                               std::string(request.parameter("view").value_or(""))};
  return file_response("image/png", api.coordinator().image_png(id, look, *mix), id.value + ".png");
}

Response get_thumbnail(Api& api, const Request&, const JobId& id) {
  auto image = api.coordinator().thumbnail_png(id);
  if (!image) return problem(image.error());
  return {.content_type = "image/png", .body = std::move(*image)};
}

Response get_error_png(Api& api, const Request&, const JobId& id) {
  return file_response("image/png", api.coordinator().error_png(id), id.value + "-error.png");
}

Response get_samples_png(Api& api, const Request&, const JobId& id) {
  return file_response("image/png", api.coordinator().samples_png(id), id.value + "-samples.png");
}

Response get_layers(Api& api, const Request&, const JobId& id) {
  return answer_json(api.coordinator().layers_json(id));
}

Response get_pixels(Api& api, const Request& request, const JobId& id) {
  if (const auto owner = api.coordinator().owner(id); !owner) return problem(owner.error());
  std::array<int, 1> level{};
  if (const auto text = request.parameter("level"); text && !read_numbers(*text, level))
    return problem(400, "'level' must be a whole number: 0 is the image, each level more has half the side");
  std::array<int, 4> rect{};
  if (!read_numbers(request.parameter("rect").value_or(""), rect))
    return problem(400, "'rect' must be four whole numbers x0,y0,x1,y1, in pixels of the level");
  auto pixels = api.coordinator().pixels(id, {std::string(request.parameter("layer").value_or("rgb")),
                                              level[0],
                                              {rect[0], rect[1], rect[2], rect[3]}});
  if (!pixels) return problem(pixels.error());
  return {.content_type = "application/octet-stream", .body = std::move(*pixels)};
}

Response post_video(Api& api, const Request& request, const JobId& id) {
  if (const auto job = api.coordinator().job(id); !job) return problem(job.error());
  const auto asked = read_asked_video(request.body);
  if (!asked) return problem(asked.error());
  const auto video = api.coordinator().make_video(id, *asked);
  return video ? json_response(202, coordinator::video_json(*video)) : problem(video.error());
}

Response get_video(Api& api, const Request&, const JobId& id) {
  return answer_json(api.coordinator().video(id).map(coordinator::video_json));
}

Response get_video_mp4(Api& api, const Request&, const JobId& id) {
  const auto path = api.coordinator().video_file(id);
  if (!path) return problem(path.error());
  auto file = open_file_body(*path);
  if (!file) return problem(404, fmt::format("the video of job {} is gone: ask for it again", id.value));
  return file_response("video/mp4", std::move(file), id.value + ".mp4");
}

Response get_meters(Api& api, const Request&, const JobId& id) {
  return answer_json(api.coordinator().meters_json(id));
}

Response get_report(Api& api, const Request&, const JobId& id) {
  if (const auto path = api.coordinator().final_file(id, "report.json"); !path.empty())
    if (auto file = open_file_body(path)) {
      Response response = json_response(200, {});
      response.body = std::move(*file);
      return response;
    }
  return answer_json(api.coordinator().report_json(id));
}

Response get_report_page(Api& api, const Request&, const JobId& id) {
  auto report = api.coordinator().report_json(id);
  if (!report) return problem(report.error());
  auto page = coordinator::report_page(api.coordinator(), id, std::move(*report));
  if (!page) return problem(page.error());
  Response response = text_response(200, "text/html; charset=utf-8", std::move(*page));
  response.headers.emplace_back("Content-Security-Policy",
                                report::job_page_policy() + "; frame-ancestors 'none'");
  response.headers.emplace_back("Content-Disposition", fmt::format("inline; filename=\"{}.html\"", id.value));
  return response;
}

Response get_convergence(Api& api, const Request&, const JobId& id) {
  const auto points = api.coordinator().convergence(id);
  return points ? text_response(200, "text/csv; charset=utf-8", coordinator::convergence_csv(*points))
                : problem(points.error());
}

Response get_tiles(Api& api, const Request&, const JobId& id) {
  return answer_json(api.coordinator().tiles(id).map(coordinator::tiles_json));
}

Response get_log(Api& api, const Request&, const JobId& id) {
  auto log = api.coordinator().job_log(id);
  return log ? text_response(200, "text/plain; charset=utf-8", std::move(*log)) : problem(log.error());
}

}  // namespace ls::http
