// Handlers of announced jobs.
#include <fmt/format.h>

#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/json_read.h"
#include "core/base/frame_range.h"

namespace ls::http {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxMachine = 253;  // characters of a host's name

Result<std::string> read_text(const json& body, const char* key, std::size_t most, bool needed) {
  const auto found = body.find(key);
  if (found == body.end() && !needed) return std::string();
  if (found == body.end() || !found->is_string())
    return bad_argument(fmt::format("'{}' must be a text", key));
  return found->get<std::string>().substr(0, most);
}

Result<AnnouncedJob> read_announced(const Request& request) {
  const auto body = read_object(request.body, {"name", "machine", "frames", "files", "count"});
  if (!body) return tl::unexpected(body.error());
  AnnouncedJob job;
  auto name = read_text(*body, "name", kMaxAssetName, true);
  if (!name) return tl::unexpected(name.error());
  auto machine = read_text(*body, "machine", kMaxMachine, false);
  if (!machine) return tl::unexpected(machine.error());
  const auto frames = read_text(*body, "frames", kMaxControlJson, false);
  if (!frames) return tl::unexpected(frames.error());
  job.name = std::move(*name), job.machine = std::move(*machine);
  if (!frames->empty()) {
    const auto range = parse_frames(*frames);
    if (!range) return tl::unexpected(range.error());
    job.frames = to_string(*range);
  }
  const auto files = body->find("files");
  if (files == body->end() || !files->is_array() || files->empty())
    return bad_argument("'files' must be the names of files that are waited for");
  for (const json& file : *files) {
    if (!file.is_string()) return bad_argument("'files' must be the names of files that are waited for");
    if (job.files.size() < AnnouncedJobs::kFilesShown)
      job.files.push_back(file.get<std::string>().substr(0, kMaxAssetName));
  }
  job.count = files->size();
  if (const auto count = body->find("count"); count != body->end()) {
    if (!count->is_number_unsigned() || *count < files->size())
      return bad_argument("'count' must be a whole number, and at least the number of 'files'");
    job.count = count->get<std::uint64_t>();
  }
  job.owner = request.caller.user;
  job.since_unix = system_unix_seconds();
  return job;
}

}  // namespace

Response get_announced(Api& api, const Request& request, const Params&) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [id, job] : api.announced().list(SystemClock().now()))
    if (request.caller.sees(job.owner))
      list.push_back({{"id", id},
                      {"name", job.name},
                      {"owner", job.owner},
                      {"machine", job.machine},
                      {"frames", job.frames.empty() ? json() : json(job.frames)},
                      {"files", job.files},
                      {"count", job.count},
                      {"since_unix", job.since_unix}});
  return json_response(200, write_json({{"announced", std::move(list)}}));
}

Response put_announced(Api& api, const Request& request, const Params& params) {
  if (!plausible_id(params[0]))
    return problem(400, "the last part of the address must be letters, digits, - and _");
  auto job = read_announced(request);
  if (!job) return problem(job.error());
  const auto done = api.announced().announce(params[0], std::move(*job), SystemClock().now());
  return done ? Response{.status = 204} : problem(done.error());
}

Response delete_announced(Api& api, const Request& request, const Params& params) {
  if (api.announced().withdraw(params[0], request.caller.user)) return {.status = 204};
  return problem(404, "there is no such announcement of this user");
}

}  // namespace ls::http
