// Handlers that list, submit, show and change jobs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "coordinator/base/limits.h"
#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/bundle/stage.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/views/describe_change.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "core/job/spec_draft.h"
#include "core/scene/limits.h"

namespace ls::http {
namespace {

using coordinator::JobChange;
using coordinator::JobsAsked;
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
  if (auto ok = load_scene(api, *digest, request.caller, submit); !ok) return tl::unexpected(ok.error());
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
Result<JobChange> read_change(std::string_view text) {
  const auto body = parse_json(text, "the body");
  if (!body) return tl::unexpected(body.error());
  auto change = job::read_object<JobChange>(*body, "change");
  if (change && body->empty())
    return bad_argument(
        fmt::format("the body changes nothing; possible: {}", fmt::join(job::names_of<JobChange>(), ", ")));
  return change;
}

// Refuses prerequisites that the caller may not see, as if there were no such jobs.
std::optional<Response> refuse_after(Api& api, const Caller& caller, const std::vector<std::string>& after) {
  for (const std::string& name : after)
    if (const auto owner = api.coordinator().owner({name}); !owner || !caller.sees(*owner))
      return problem(Error{Errc::invalid_argument, fmt::format("after: there is no job {}", name)});
  return std::nullopt;
}

constexpr std::size_t kMaxPage = 1000;
constexpr std::size_t kMaxSearch = 200;  // greatest length of the query parameter `search`, in bytes
constexpr std::array kStates = {coordinator::JobState::queued, coordinator::JobState::running,
                                coordinator::JobState::paused, coordinator::JobState::done,
                                coordinator::JobState::failed, coordinator::JobState::cancelled};

template <class T>
Result<void> read_number(const Request& request, std::string_view name, T& out) {
  const auto text = request.parameter(name);
  if (!text) return {};
  const auto value = parse_number<T>(*text);
  if (!value || !(*value >= 0)) return bad_argument(fmt::format("'{}' must be a number from 0 on", name));
  out = *value;
  return {};
}

Result<void> read_states(std::string_view text, JobsAsked& asked) {
  while (!text.empty()) {
    const std::string_view word = take_part(text, ',');
    if (word == coordinator::kHeld) {
      asked.held = true;
      continue;
    }
    const auto found = std::find_if(kStates.begin(), kStates.end(),
                                    [&](coordinator::JobState state) { return to_string(state) == word; });
    if (found == kStates.end())
      return bad_argument(
          "'state' has an unknown word; possible: queued, held, running, paused, done, failed, cancelled");
    asked.states.insert(*found);
  }
  return {};
}

Result<void> read_order(std::string_view text, JobsAsked& asked) {
  asked.descending = text.starts_with('-');
  if (asked.descending) text.remove_prefix(1);
  const auto& known = coordinator::kJobOrders;
  const auto found = std::find(known.begin(), known.end(), text);
  if (found == known.end())
    return bad_argument(fmt::format("'sort' must be one of {}, with '-' before it for the other way round",
                                    fmt::join(known, ", ")));
  asked.by = static_cast<coordinator::JobOrder>(found - known.begin());
  return {};
}

Result<JobsAsked> read_asked(const Request& request) {
  JobsAsked asked;
  asked.visible = [&request](const std::string& owner) { return request.caller.sees(owner); };
  if (auto ok = read_states(request.parameter("state").value_or(""), asked); !ok)
    return tl::unexpected(ok.error());
  if (auto ok = read_order(request.parameter("sort").value_or("order"), asked); !ok)
    return tl::unexpected(ok.error());
  if (auto ok = read_number(request, "since", asked.since_unix); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_number(request, "offset", asked.offset); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_number(request, "limit", asked.limit); !ok) return tl::unexpected(ok.error());
  if (request.parameter("limit") && asked.limit > kMaxPage)
    return bad_argument(fmt::format("'limit' must be at most {}; without it all jobs come", kMaxPage));
  if (const auto owner = request.parameter("owner")) asked.owner = std::string(*owner);
  asked.search = request.parameter("search").value_or("");
  if (asked.search.size() > kMaxSearch)
    return bad_argument(fmt::format("'search' may have at most {} characters", kMaxSearch));
  return asked;
}

Result<std::string> read_text(const coordinator::BlobStore& blobs, const Digest& digest) {
  const auto size = blobs.size(digest);
  if (!size) return tl::unexpected(size.error());
  if (*size > scene::kMaxTextBytes)
    return fail(Errc::invalid_argument, fmt::format("the scene file has {} bytes; at most {} are accepted",
                                                    *size, scene::kMaxTextBytes));
  const auto bytes = blobs.read(digest, 0, *size);
  if (!bytes) return tl::unexpected(bytes.error());
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

Result<void> load_stage(Api& api, const Digest& digest, const Caller& caller, SubmitRequest& job) {
  if (!api.stages())
    return bad_argument(fmt::format(
        "{} is a stage of USD, which this coordinator does not read: its administrator can give it "
        "--usd-python. The Python package makes a scene of the stage: python3 -m lightshaft.usd FILE -o "
        "FOLDER",
        plain_text(job.scene_name)));
  const BundleLimits limits{api.limits().blob_bytes, api.limits().unpacked_bytes};
  Stage stage{job.scene_name, digest, std::move(job.assets), job.spec.frames, {}};
  if (job.spec.size) stage.size = *job.spec.size;
  auto scene =
      api.stages()->read(stage, caller.token_id, limits, api.coordinator().blobs(), api.stop_token());
  if (!scene) return tl::unexpected(scene.error());
  auto text = read_text(api.coordinator().blobs(), scene->bundle.scene_digest);
  if (!text) return tl::unexpected(text.error());
  job.scene_text = std::move(*text);
  job.assets = std::move(scene->bundle.assets);
  job.warnings = std::move(scene->warnings);
  return {};
}

}  // namespace

Response get_jobs(Api& api, const Request& request, const Params&) {
  const auto asked = read_asked(request);
  if (!asked) return problem(asked.error());
  return json_response(200, coordinator::jobs_json(api.coordinator().list(*asked)));
}

Response post_again(Api& api, const Request& request, const JobId& id) {
  if (const auto owner = api.coordinator().owner(id); !owner) return problem(owner.error());
  const auto body = parse_json(request.body, "the body");
  if (!body) return problem(body.error());
  job::SpecDraft draft(job::Form::json);
  if (auto ok = draft.add(*body, job::goes_with_again); !ok) return problem(ok.error());
  const auto changes = draft.finish();
  if (!changes) return problem(changes.error());
  if (auto refused = refuse_priority(api, request.caller, changes->priority)) return std::move(*refused);
  if (auto refused = refuse_after(api, request.caller, changes->after)) return std::move(*refused);
  const auto made = api.coordinator().submit_again(id, *changes, request.caller.user,
                                                   std::string(request.header("traceparent")));
  return made ? submitted(api, *made) : problem(made.error());
}

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
  if (change->after)
    if (auto refused = refuse_after(api, request.caller, *change->after)) return std::move(*refused);
  if (const auto done = api.coordinator().change(id, *change); !done) return problem(done.error());
  return get_job(api, request, id);
}

Response delete_job(Api& api, const Request&, const JobId& id) {
  if (const auto done = api.coordinator().remove(id); !done) return problem(done.error());
  return {.status = 204};
}

Result<void> load_scene(Api& api, const Digest& digest, const Caller& caller, SubmitRequest& job) {
  auto& blobs = api.coordinator().blobs();
  if (!blobs.has(digest))
    return fail(Errc::failed_precondition,
                fmt::format("the scene's blob {0} is not here: PUT /api/v1/blobs/{0} first", digest.hex()));
  const auto begin = blobs.read(digest, 0, kStageMagic);
  if (!begin) return tl::unexpected(begin.error());
  if (is_stage(job.scene_name, *begin)) return load_stage(api, digest, caller, job);
  auto text = read_text(blobs, digest);
  if (!text) return tl::unexpected(text.error());
  job.scene_text = std::move(*text);
  return {};
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
  if (auto refused = refuse_after(api, caller, request.spec.after)) return std::move(*refused);
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
