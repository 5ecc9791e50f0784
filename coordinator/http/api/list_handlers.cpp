// Handlers for the list of jobs, and for submitting a job's scene once more.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "common/base/parse_number.h"
#include "common/job/settings.h"
#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/views/views.h"

namespace ls::http {
namespace {

using coordinator::JobsAsked;

constexpr std::size_t kMaxPage = 1000;
constexpr std::size_t kMaxSearch = 200;  // characters
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
    const auto found = std::find_if(kStates.begin(), kStates.end(),
                                    [&](coordinator::JobState state) { return to_string(state) == word; });
    if (found == kStates.end())
      return bad_argument(
          "'state' has an unknown word; possible: queued, running, paused, done, failed, cancelled");
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

}  // namespace

Response get_jobs(Api& api, const Request& request, const Params&) {
  const auto asked = read_asked(request);
  if (!asked) return problem(asked.error());
  return json_response(200, coordinator::jobs_json(api.coordinator().list(*asked)));
}

Response post_again(Api& api, const Request& request, const JobId& id) {
  if (const auto owner = api.coordinator().owner(id); !owner) return problem(owner.error());
  const auto body = read_object(request.body, {"spp", "target_error", "time", "seed", "priority"});
  if (!body) return problem(body.error());
  const auto changes = job_spec_of(*body);
  if (!changes) return problem(changes.error());
  if (auto refused = refuse_priority(api, request.caller, changes->priority)) return std::move(*refused);
  const auto made = api.coordinator().submit_again(id, *changes, request.caller.user,
                                                   std::string(request.header("traceparent")));
  return made ? submitted(api, *made) : problem(made.error());
}

Response get_thumbnail(Api& api, const Request&, const JobId& id) {
  auto image = api.coordinator().thumbnail_png(id);
  if (!image) return problem(image.error());
  return {.content_type = "image/png", .body = std::move(*image)};
}

}  // namespace ls::http
