// A coordinator's HTTP API as functions. Addresses and tokens come from options and the environment; error
// responses ("problem details", RFC 9457) become errors.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/farm/http_client.h"
#include "cli/local/local_scene.h"
#include "coordinator/service/coordinator.h"
#include "core/job/settings.h"

namespace ls::cli {

struct FarmOptions {
  std::string url, token_file, ca;
  bool json = false;
  void add_to(CLI::App& app);
};

// Returns the address, token and CA file that options and environment give. invalid_argument: there is no
// address, or the file of the token cannot be read.
Result<HttpClient::Options> connection_of(const FarmOptions& options);

class FarmApi {
 public:
  template <class T>
  using Answer = tl::expected<T, coordinator::Rejected>;
  using Json = nlohmann::json;

  static Result<FarmApi> open(const FarmOptions& options);

  Answer<Json> get(const std::string& path);
  Answer<Json> post(const std::string& path, const Json& body);
  Answer<void> remove(const std::string& path);
  Answer<void> put(const std::string& path, const Json& body);
  Answer<Json> patch(const std::string& path, const Json& body);
  Answer<void> ask(const std::string& path, const Json& body);  // a PATCH whose answer has no content
  Answer<std::string> text(const std::string& path);
  Answer<void> download(const std::string& path, const std::filesystem::path& file);

  // Uploads the scene and those of its files that the coordinator does not have, then creates the job.
  // `on_progress` receives a message for each upload.
  Answer<Json> submit(const LocalScene& scene, const JobSpec& spec,
                      const std::function<void(const std::string&)>& on_progress);
  // Uploads a file unless the coordinator has it. Returns its digest, by which a job's spec can name the
  // file.
  Answer<Digest> upload(const std::filesystem::path& file,
                        const std::function<void(const std::string&)>& on_progress);
  // Sends an archive of a scene unchanged, to create a job from it. `type` comes from bundle_type(), `query`
  // from spec_query().
  Answer<Json> submit_bundle(const std::filesystem::path& file, const std::string& type,
                             const std::string& query);

 private:
  explicit FarmApi(HttpClient client) : client_(std::move(client)) {}
  Answer<void> upload_missing(const LocalScene& scene, const JobSpec& spec, const Digest& text,
                              const std::function<void(const std::string&)>& on_progress);
  // Sends a file. If the connection breaks, continues after the last byte that the coordinator has.
  Answer<HttpResponse> send_file(const std::string& path, const std::filesystem::path& file);
  struct Sending {
    RetryPolicy retry;
    std::uint64_t reached = 0;  // the largest number of bytes that the coordinator has acknowledged
    int barren = 0;             // attempts since `reached` last increased
  };
  Answer<HttpResponse> send_rest(const std::string& path, const std::filesystem::path& file,
                                 Sending& sending);

  HttpClient client_;
};

std::string job_path(const std::string& id);  // "/api/v1/jobs/ID" with the id percent-encoded

// Returns "?key=value&...", percent-encoded, without the keys whose value is empty.
std::string query_of(const std::vector<std::pair<std::string, std::string>>& given);

// Converts a response with an error status to an error, including its diagnostics.
coordinator::Rejected problem_of(const HttpResponse& response);

// Returns the content type of an archive (a scene with its files) by its name: "application/zip" for .zip,
// "application/x-tar" for .tar, .tar.gz and .tgz. nullopt: the file is a scene, not an archive. `submit`
// sends an archive unchanged, with the options in the query of the request.
std::optional<std::string> bundle_type(const std::string& file);

// Returns the spec as query parameters, such as "?spp=8&define=a%3D1", or an empty text. Settings that have
// their default are left out, because the archive may set them, except those in `given`, the names of what
// the user gave. `name`: the job's; empty: not given.
std::string spec_query(const JobSpec& spec, const std::set<std::string_view>& given,
                       const std::string& name = {});

}  // namespace ls::cli
