#include "cli/farm/farm_api.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string_view>

#include "cli/farm/http_client.h"
#include "cli/output/job_options.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"
#include "core/base/secret.h"
#include "core/job/describe.h"
#include "core/job/objects.h"

namespace ls::cli {
namespace {

using coordinator::Rejected;
using nlohmann::json;

constexpr std::size_t kMaxShownBody = 300;
constexpr std::size_t kDigestsPerQuestion = 10'000;
// Files of at least this size are sent in parts, so that an upload can continue after a broken connection. A
// smaller file is sent as a whole, and again if necessary; this saves the request that asks how many bytes
// have arrived.
constexpr std::uintmax_t kSentInParts = 1u << 20;
// An upload fails after more than this many consecutive attempts without progress.
constexpr int kBarrenAttempts = 8;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

Errc code_of(int status) {
  switch (status) {
    case 400:
    case 413:
    case 415:
      return Errc::invalid_argument;
    case 401:
      return Errc::unauthenticated;
    case 403:
      return Errc::permission_denied;
    case 404:
      return Errc::not_found;
    case 409:
      return Errc::failed_precondition;
    case 408:
    case 429:
    case 502:
    case 503:
    case 504:
      return Errc::unavailable;
    case 507:
      return Errc::resource_exhausted;
    default:
      return Errc::internal;
  }
}

Diagnostic diagnostic_of(const json& d) {
  Diagnostic out;
  out.severity = text_field(d, "severity", "error") == "warning" ? Diagnostic::Severity::warning
                                                                 : Diagnostic::Severity::error;
  out.place = {text_field(d, "file", ""), int_field(d, "line", 0), int_field(d, "column", 0)};
  out.text = text_field(d, "text", "");
  out.source_line = text_field(d, "source_line", "");
  out.length = int_field(d, "length", 1);
  return out;
}

FarmApi::Answer<HttpResponse> checked(Result<HttpResponse> response) {
  if (!response) return coordinator::rejected(response.error());
  if (response->status / 100 != 2) return tl::unexpected(problem_of(*response));
  return std::move(*response);
}

FarmApi::Answer<json> as_json(Result<HttpResponse> response) {
  const auto good = checked(std::move(response));
  if (!good) return tl::unexpected(good.error());
  json j = json::parse(good->body, nullptr, false);
  if (!j.is_object())
    return coordinator::rejected(
        {Errc::internal,
         "the answer is no JSON object: is this address a Lightshaft coordinator?" +
             (good->proxy.empty() ? "" : " The request went through the proxy " + good->proxy)});
  return j;
}

FarmApi::Answer<void> without_content(Result<HttpResponse> response) {
  const auto good = checked(std::move(response));
  if (!good) return tl::unexpected(good.error());
  return {};
}

}  // namespace

Rejected problem_of(const HttpResponse& response) {
  Rejected out;
  out.error.code = code_of(response.status);
  const json j = json::parse(response.body, nullptr, false);
  if (!j.is_object()) {
    out.error.message =
        fmt::format("{} answered with status {}: {}",
                    response.proxy.empty() ? "the coordinator"
                                           : "the proxy " + response.proxy + ", or what is behind it,",
                    response.status, response.body.substr(0, kMaxShownBody));
    return out;
  }
  out.error.message =
      text_field(j, "detail", text_field(j, "title", fmt::format("status {}", response.status)));
  if (response.status == 401)
    out.error.message +=
        " (give the token with --token-file FILE or in LIGHTSHAFT_TOKEN; a coordinator keeps it in the file "
        "`token` of its data folder)";
  for (const json& d : objects_field(j, "diagnostics")) out.diagnostics.push_back(diagnostic_of(d));
  return out;
}

void FarmOptions::add_to(CLI::App& app) {
  add_option(app, "--to", url, "URL", "the coordinator's address; also LIGHTSHAFT_URL");
  add_option(app, "--token-file", token_file, "FILE",
             "file with the token; also LIGHTSHAFT_TOKEN, the token itself");
  add_option(app, "--ca", ca, "FILE", "certificates to trust instead of the system's; also LIGHTSHAFT_CA");
  app.add_flag("--json", json, "answer as JSON");
}

Result<HttpClient::Options> connection_of(const FarmOptions& options) {
  HttpClient::Options o;
  o.url = options.url.empty() ? environment("LIGHTSHAFT_URL") : options.url;
  if (o.url.empty())
    return bad_argument(
        "where is the coordinator? Give --to URL or set LIGHTSHAFT_URL, for example http://localhost:8080");
  o.ca = options.ca.empty() ? environment("LIGHTSHAFT_CA") : options.ca;
  o.token = environment("LIGHTSHAFT_TOKEN");
  if (!options.token_file.empty()) {
    auto token = read_secret(options.token_file);
    if (!token) return bad_argument("--token-file: " + token.error().message);
    o.token = std::move(*token);
  }
  return o;
}

Result<FarmApi> FarmApi::open(const FarmOptions& options) {
  auto connection = connection_of(options);
  if (!connection) return tl::unexpected(connection.error());
  auto client = HttpClient::open(std::move(*connection));
  if (!client) return tl::unexpected(client.error());
  return FarmApi(std::move(*client));
}

FarmApi::Answer<json> FarmApi::get(const std::string& path) { return as_json(client_.request("GET", path)); }

FarmApi::Answer<json> FarmApi::patch(const std::string& path, const json& body) {
  return as_json(client_.request("PATCH", path, body.dump()));
}

FarmApi::Answer<json> FarmApi::post(const std::string& path, const json& body) {
  return as_json(client_.request("POST", path, body.dump()));
}

FarmApi::Answer<void> FarmApi::ask(const std::string& path, const json& body) {
  return without_content(client_.request("PATCH", path, body.dump()));
}

FarmApi::Answer<void> FarmApi::put(const std::string& path, const json& body) {
  // Names of files may have any bytes.
  const std::string text = body.dump(-1, ' ', false, json::error_handler_t::replace);
  return without_content(client_.request("PUT", path, text));
}

FarmApi::Answer<void> FarmApi::remove(const std::string& path) {
  return without_content(client_.request("DELETE", path));
}

FarmApi::Answer<std::string> FarmApi::text(const std::string& path) {
  auto response = checked(client_.request("GET", path));
  if (!response) return tl::unexpected(response.error());
  return std::move(response->body);
}

FarmApi::Answer<void> FarmApi::download(const std::string& path, const std::filesystem::path& file) {
  const auto response = checked(client_.download(path, file));
  if (!response) return tl::unexpected(response.error());
  return {};
}

FarmApi::Answer<void> FarmApi::upload_missing(const LocalScene& scene, const JobSpec& spec,
                                              const Digest& text,
                                              const std::function<void(const std::string&)>& on_progress) {
  // The files that the job needs, by their digests in hexadecimal. Null stands for the scene's text, which is
  // in memory.
  std::map<std::string, const LocalFile*> by_digest{{text.hex(), nullptr}};
  for (const auto& [name, file] : scene.files)
    if (is_needed(scene, spec, file)) by_digest.emplace(file.digest.hex(), &file);
  for (auto next = by_digest.begin(); next != by_digest.end();) {
    json question{{"digests", json::array()}};
    for (; next != by_digest.end() && question["digests"].size() < kDigestsPerQuestion; ++next)
      question["digests"].push_back(next->first);
    const auto answer = as_json(client_.request("POST", "/api/v1/blobs/missing", question.dump()));
    if (!answer) return tl::unexpected(answer.error());
    const auto missing_ones = answer->find("missing");
    if (missing_ones == answer->end() || !missing_ones->is_array())
      return coordinator::rejected(
          {Errc::internal, "the coordinator's answer does not say which files it lacks"});
    for (const json& missing : *missing_ones) {
      const auto found = missing.is_string() ? by_digest.find(missing.get<std::string>()) : by_digest.end();
      if (found == by_digest.end()) continue;
      const std::string path = "/api/v1/blobs/" + found->first;
      if (found->second) on_progress(fmt::format("sending {}", found->second->path.string()));
      const auto put = found->second ? send_file(path, found->second->path) : with_retries([&] {
        return checked(client_.request("PUT", path, scene.text, "application/octet-stream"));
      });
      if (!put) return tl::unexpected(put.error());
    }
  }
  return {};
}

// After a broken connection the file, or its missing part, is sent again. That is safe, because the
// coordinator identifies files by digest, so that a second copy changes nothing.
FarmApi::Answer<HttpResponse> FarmApi::send_file(const std::string& path, const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::file_size(file, error) < kSentInParts || error)
    return with_retries([&] { return checked(client_.upload(path, file)); });
  Sending sending;
  while (true) {
    auto put = send_rest(path, file, sending);
    if (put || sending.barren > kBarrenAttempts || !sending.retry.again(put.error().error)) return put;
  }
}

// Sends the part of the file that the coordinator does not have yet.
FarmApi::Answer<HttpResponse> FarmApi::send_rest(const std::string& path, const std::filesystem::path& file,
                                                 Sending& sending) {
  auto there = client_.request("HEAD", path);
  if (!there) return coordinator::rejected(there.error());
  if (there->status / 100 == 2) return std::move(*there);
  if (there->status != 404) return checked(std::move(there));
  const std::uint64_t offset = there->upload_offset.value_or(0);
  sending.barren = offset > sending.reached ? 0 : sending.barren + 1;
  sending.reached = std::max(sending.reached, offset);
  auto put = client_.upload(path, file, offset);
  sending.retry.answered();
  // Status 409: more bytes arrived over an earlier connection after the HEAD request, so `offset` is out of
  // date.
  if (put && put->status == 409)
    return coordinator::rejected({Errc::unavailable, problem_of(*put).error.message});
  return checked(std::move(put));
}

FarmApi::Answer<Digest> FarmApi::upload(const std::filesystem::path& file,
                                        const std::function<void(const std::string&)>& on_progress) {
  const auto digest = sha256_file(file);
  if (!digest) return coordinator::rejected({Errc::invalid_argument, digest.error().message});
  const json question{{"digests", {digest->hex()}}};
  const auto answer = as_json(client_.request("POST", "/api/v1/blobs/missing", question.dump()));
  if (!answer) return tl::unexpected(answer.error());
  if (const auto missing = answer->find("missing"); missing != answer->end() && missing->empty())
    return *digest;
  on_progress(fmt::format("sending {}", file.string()));
  const auto put = send_file("/api/v1/blobs/" + digest->hex(), file);
  if (!put) return tl::unexpected(put.error());
  return *digest;
}

FarmApi::Answer<json> FarmApi::submit(const LocalScene& scene, const JobSpec& spec,
                                      const std::function<void(const std::string&)>& on_progress) {
  const Digest text = sha256(scene.text);
  if (auto sent = upload_missing(scene, spec, text, on_progress); !sent) return tl::unexpected(sent.error());
  json body{
      {"scene", text.hex()},
      {"assets", json::object()},
      {"name", scene.title.empty() ? std::filesystem::path(scene.name).filename().string() : scene.title}};
  for (const auto& [name, file] : scene.files) body["assets"][name] = file.digest.hex();
  body["spec"] = json::parse(canonical_json(spec), nullptr, false);
  return as_json(client_.request("POST", "/api/v1/jobs", dump(body, -1)));
}

FarmApi::Answer<json> FarmApi::submit_bundle(const std::filesystem::path& file, const std::string& type,
                                             const std::string& query) {
  return as_json(client_.post_file("/api/v1/jobs" + query, file, type));
}

std::string job_path(const std::string& id) { return "/api/v1/jobs/" + percent_encode(id); }

namespace {

class Query {
 public:
  void add(std::string_view key, std::string_view value) {
    text_ += fmt::format("{}{}={}", text_.empty() ? "?" : "&", key, percent_encode(value));
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

}  // namespace

std::string query_of(const std::vector<std::pair<std::string, std::string>>& given) {
  Query query;
  for (const auto& [key, value] : given)
    if (!value.empty()) query.add(key, value);
  return query.take();
}

std::optional<std::string> bundle_type(const std::string& file) {
  std::string name = file;
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (name.ends_with(".zip")) return "application/zip";
  for (const char* end : {".tar", ".tar.gz", ".tgz"})
    if (name.ends_with(end)) return "application/x-tar";
  return std::nullopt;
}

std::string spec_query(const JobSpec& spec, const std::set<std::string_view>& given,
                       const std::string& name) {
  Query query;
  if (!name.empty()) query.add("name", name);
  job::for_each_setting(spec, [&]<class T>(const job::Setting& s, const T& value) {
    if (value == T{} && !given.contains(s.name)) return;
    if constexpr (std::is_same_v<T, job::Defines>) {
      for (const auto& [define, text] : value) query.add(s.query_name(), define + "=" + text);
    } else {
      job::with_value(value, [&](const auto& one) { query.add(s.query_name(), job::text_of(one)); });
    }
  });
  return query.take();
}

}  // namespace ls::cli
