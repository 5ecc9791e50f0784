#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/parse_number.h"
#include "common/job/limits.h"
#include "common/scene/limits.h"
#include "coordinator/base/limits.h"
#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/views/views.h"

namespace ls::http {
namespace {

using coordinator::SubmitRequest;
using nlohmann::json;

constexpr std::string_view kDefaultName = "scene.xml";

Result<std::map<std::string, Digest>> read_assets(const json& body) {
  std::map<std::string, Digest> assets;
  const auto found = body.find("assets");
  if (found == body.end()) return assets;
  if (!found->is_object()) return bad_argument("'assets' must be an object {name: SHA256}");
  if (found->size() > coordinator::limits::kMaxAssets)
    return bad_argument(fmt::format("'assets' names more than {} files", coordinator::limits::kMaxAssets));
  for (const auto& item : found->items()) {
    if (item.key().empty() || item.key().size() > kMaxAssetName)
      return bad_argument(fmt::format("an asset's name must have 1 to {} characters", kMaxAssetName));
    const auto digest = read_digest(item.value(), fmt::format("the digest of asset '{}'", item.key()));
    if (!digest) return tl::unexpected(digest.error());
    assets.emplace(item.key(), *digest);
  }
  return assets;
}

Result<SubmitRequest> from_json(Api& api, const Request& request) {
  const auto body = read_object(request.body, {"scene", "assets", "spec", "name"});
  if (!body) return tl::unexpected(body.error());
  SubmitRequest submit;
  submit.scene_name = kDefaultName;
  if (const auto name = body->find("name"); name != body->end()) {
    if (!name->is_string()) return bad_argument("'name' must be a text");
    submit.scene_name = name->get<std::string>().substr(0, kMaxAssetName);
  }
  const auto scene = body->find("scene");
  if (scene == body->end()) return bad_argument("the body names no 'scene' (SHA-256 of the scene file)");
  const auto digest = read_digest(*scene, "'scene'");
  if (!digest) return tl::unexpected(digest.error());
  auto assets = read_assets(*body);
  if (!assets) return tl::unexpected(assets.error());
  submit.assets = std::move(*assets);
  if (const auto spec = body->find("spec"); spec != body->end()) {
    auto parsed = job_spec_of(*spec);
    if (!parsed) return tl::unexpected(parsed.error());
    submit.spec = std::move(*parsed);
  }
  auto text = read_scene_blob(api, *digest);
  if (!text) return tl::unexpected(text.error());
  submit.scene_text = std::move(*text);
  return submit;
}

Result<SubmitRequest> from_xml(const Request& request) {
  SubmitRequest submit;
  submit.scene_name = std::string(request.parameter("name").value_or(kDefaultName)).substr(0, kMaxAssetName);
  auto spec = spec_from_query(request.query, "name");
  if (!spec) return tl::unexpected(spec.error());
  submit.spec = std::move(*spec);
  submit.scene_text = request.body;
  return submit;
}

// Reads all changes in the body of a PATCH, so that an error in one is found before any is applied.
Result<coordinator::JobChange> read_change(std::string_view text) {
  using coordinator::JobState;
  const auto body = read_object(text, {"state", "priority", "spp", "target_error", "focus"});
  if (!body) return tl::unexpected(body.error());
  if (body->empty())
    return bad_argument("the body changes nothing; possible: state, priority, spp, target_error, focus");
  coordinator::JobChange change;
  if (const auto target = body->find("target_error"); target != body->end()) {
    if (!target->is_number() || !(target->get<double>() > 0))
      return bad_argument("'target_error' must be a positive number");
    change.target_error = target->get<double>();
  }
  if (const auto state = body->find("state"); state != body->end()) {
    for (const JobState possible : {JobState::paused, JobState::running, JobState::cancelled})
      if (*state == std::string(to_string(possible))) change.state = possible;
    if (!change.state) return bad_argument("'state' must be \"paused\", \"running\" or \"cancelled\"");
  }
  if (const auto priority = body->find("priority"); priority != body->end()) {
    if (!priority->is_number_integer() || std::abs(priority->get<double>()) > kMaxPriority)
      return bad_argument(fmt::format("'priority' must be a whole number from -{0} to {0}", kMaxPriority));
    change.priority = priority->get<int>();
  }
  if (const auto spp = body->find("spp"); spp != body->end()) {
    if (!spp->is_number_unsigned() || spp->get<std::uint64_t>() == 0)
      return bad_argument("'spp' must be a whole number: the new total per pixel");
    change.spp = spp->get<std::uint64_t>();
  }
  if (const auto focus = body->find("focus"); focus != body->end()) {
    const auto pixel = [](const json& v) {
      return v.is_number_unsigned() && v.get<std::uint64_t>() <= std::numeric_limits<int>::max();
    };
    const bool rect =
        focus->is_array() && focus->size() == 4 && std::all_of(focus->begin(), focus->end(), pixel);
    if (!rect && !focus->is_null())
      return bad_argument("'focus' must be [x0, y0, x1, y1] in whole pixels, or null to render all alike");
    change.focus =
        rect ? std::optional(PixelRect{(*focus)[0], (*focus)[1], (*focus)[2], (*focus)[3]}) : std::nullopt;
  }
  return change;
}

template <class Body>
Response file_response(std::string content_type, Body bytes, const std::string& name) {
  return {.content_type = std::move(content_type),
          .headers = {{"Content-Disposition", fmt::format("inline; filename=\"{}\"", name)}},
          .body = std::move(bytes)};
}

}  // namespace

Response post_job(Api& api, const Request& request, const Params&) {
  const bool is_json = media_type(request.header("content-type")) == "application/json";
  auto submit = is_json ? from_json(api, request) : from_xml(request);
  if (!submit) return problem(submit.error());
  submit->owner = request.caller.user;
  submit->traceparent = request.header("traceparent");
  return submit_job(api, std::move(*submit), request.caller);
}

Response get_job(Api& api, const Request&, const JobId& id) {
  const auto job = api.coordinator().job(id);
  return job ? json_response(200, coordinator::job_json(*job)) : problem(job.error());
}

Response patch_job(Api& api, const Request& request, const JobId& id) {
  if (const auto job = api.coordinator().job(id); !job) return problem(job.error());
  const auto change = read_change(request.body);
  if (!change) return problem(change.error());
  if (change->priority)
    if (auto refused = refuse_priority(api, request.caller, *change->priority)) return std::move(*refused);
  if (const auto done = api.coordinator().change(id, *change); !done) return problem(done.error());
  return get_job(api, request, id);
}

Response delete_job(Api& api, const Request&, const JobId& id) {
  if (const auto done = api.coordinator().remove(id); !done) return problem(done.error());
  return {.status = 204};
}

Response get_image_exr(Api& api, const Request&, const JobId& id) {
  if (const auto path = api.coordinator().final_file(id, "image.exr"); !path.empty())
    if (auto file = open_file_body(path))
      return file_response("image/x-exr", std::move(*file), id.value + ".exr");
  auto image = api.coordinator().image_exr(id);
  return image ? file_response("image/x-exr", std::move(*image), id.value + ".exr") : problem(image.error());
}

Response get_image_png(Api& api, const Request& request, const JobId& id) {
  const auto exposure = parse_number<double>(request.parameter("exposure").value_or("0"));
  if (!exposure || !(std::abs(*exposure) <= coordinator::limits::kMaxExposure))
    return problem(400, fmt::format("'exposure' must be a number of stops from -{0} to {0}",
                                    coordinator::limits::kMaxExposure));
  const auto layer = request.parameter("layer");
  if (layer && *layer != "denoised")
    return problem(400, "'layer' must be \"denoised\", or be left out for the image itself");
  auto image = api.coordinator().image_png(id, *exposure, layer.has_value());
  return image ? file_response("image/png", std::move(*image), id.value + ".png") : problem(image.error());
}

Response get_error_png(Api& api, const Request&, const JobId& id) {
  auto map = api.coordinator().error_png(id);
  return map ? file_response("image/png", std::move(*map), id.value + "-error.png") : problem(map.error());
}

Response get_samples_png(Api& api, const Request&, const JobId& id) {
  auto map = api.coordinator().samples_png(id);
  return map ? file_response("image/png", std::move(*map), id.value + "-samples.png") : problem(map.error());
}

Response get_report(Api& api, const Request&, const JobId& id) {
  if (const auto path = api.coordinator().final_file(id, "report.json"); !path.empty())
    if (auto file = open_file_body(path)) {
      Response response = json_response(200, {});
      response.body = std::move(*file);
      return response;
    }
  auto report = api.coordinator().report_json(id);
  return report ? json_response(200, std::move(*report)) : problem(report.error());
}

Response get_convergence(Api& api, const Request&, const JobId& id) {
  const auto points = api.coordinator().convergence(id);
  return points ? text_response(200, "text/csv; charset=utf-8", coordinator::convergence_csv(*points))
                : problem(points.error());
}

Response get_tiles(Api& api, const Request&, const JobId& id) {
  const auto tiles = api.coordinator().tiles(id);
  return tiles ? json_response(200, coordinator::tiles_json(*tiles)) : problem(tiles.error());
}

Response get_log(Api& api, const Request&, const JobId& id) {
  auto log = api.coordinator().job_log(id);
  return log ? text_response(200, "text/plain; charset=utf-8", std::move(*log)) : problem(log.error());
}

Result<std::string> read_scene_blob(Api& api, const Digest& digest) {
  auto& blobs = api.coordinator().blobs();
  if (!blobs.has(digest))
    return fail(Errc::failed_precondition,
                fmt::format("the scene's blob {0} is not here: PUT /api/v1/blobs/{0} first", digest.hex()));
  const auto size = blobs.size(digest);
  if (!size) return tl::unexpected(size.error());
  if (*size > scene::kMaxTextBytes)
    return fail(Errc::invalid_argument, fmt::format("the scene file has {} bytes; at most {} are accepted",
                                                    *size, scene::kMaxTextBytes));
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
  return id ? submitted(api, *id) : problem(id.error().error, id.error().diagnostics);
}

Response submitted(Api& api, const JobId& id) {
  const std::string url = "/api/v1/jobs/" + id.value;
  const auto job = api.coordinator().job(id);
  nlohmann::ordered_json body{{"id", id.value}, {"url", url}};
  body["warnings"] = job ? job->warnings : std::vector<std::string>{};
  body["reference_same_seed"] = job && job->reference_same_seed;
  Response response = json_response(201, write_json(body));
  response.headers.emplace_back("Location", url);
  return response;
}

}  // namespace ls::http
