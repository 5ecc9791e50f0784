// A coordinator's HTTP interface as calls: addresses and tokens from options and environment, problem details
// as errors.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/http_client.h"
#include "cli/local_scene.h"
#include "cli/patience.h"
#include "coordinator/service.h"

namespace ls::cli {

struct FarmOptions {
  std::string url, token_file, ca;
  bool json = false;
  void add_to(CLI::App& app);
};

class FarmApi {
 public:
  template <class T>
  using Answer = tl::expected<T, coordinator::Rejected>;
  using Json = nlohmann::json;

  static Result<FarmApi> open(const FarmOptions& options);

  Answer<Json> get(const std::string& path);
  Answer<Json> post(const std::string& path, const Json& body);
  Answer<void> remove(const std::string& path);
  Answer<Json> patch(const std::string& path, const Json& body);
  Answer<std::string> get_text(const std::string& path);
  Answer<void> download(const std::string& path, const std::filesystem::path& file);

  // Uploads what the coordinator lacks of the scene and its files, then makes the job. `said` is told of each
  // upload.
  Answer<Json> submit(const LocalScene& scene, const JobSpec& spec,
                      const std::function<void(const std::string&)>& said);
  // Uploads a file if the coordinator lacks it; the digest is how a spec names it.
  Answer<Digest> upload(const std::filesystem::path& file,
                        const std::function<void(const std::string&)>& said);
  // Sends an archive as it is; `query` as of spec_query().
  Answer<Json> submit_bundle(const std::filesystem::path& file, const std::string& type,
                             const std::string& query);

 private:
  explicit FarmApi(HttpClient client) : client_(std::move(client)) {}
  Answer<void> upload_missing(const LocalScene& scene, const JobSpec& spec, const Digest& text,
                              const std::function<void(const std::string&)>& said);
  // Sends a file, and goes on behind what arrived where the connection breaks.
  Answer<HttpResponse> send_file(const std::string& path, const std::filesystem::path& file);
  struct Sending {
    Patience patience;
    std::uint64_t reached = 0;  // the most that the coordinator said it has
    int barren = 0;             // attempts since it had more
  };
  Answer<HttpResponse> send_rest(const std::string& path, const std::filesystem::path& file,
                                 Sending& sending);

  HttpClient client_;
};

std::string job_path(const std::string& id);  // "/api/v1/jobs/ID", escaped

// A response of an error status as an error, with the diagnostics inside if there are some.
coordinator::Rejected problem_of(const HttpResponse& response);

}  // namespace ls::cli
