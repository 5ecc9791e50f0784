// Requests to a coordinator in memory, as text: "METHOD target", header lines, an empty line, the body. What
// the HTTP library makes of bytes is not ours; what we make of its requests is.
#include "coordinator/http/message/message.h"
#include "tests/fuzz/all_targets.h"
#include "tests/fuzz/http_coordinator.h"

namespace ls::fuzz {
namespace {

using namespace ls::http;

std::string_view line_of(std::string_view& text) {
  const auto end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(text.size(), end + 1));
  return line;
}

// Nothing: the server would have refused it before.
std::optional<Request> request_of(std::string_view text) {
  const std::string_view first = line_of(text);
  const auto space = first.find(' ');
  const auto method = parse_method(first.substr(0, space));
  const auto target = parse_target(space == std::string_view::npos ? "" : first.substr(space + 1));
  if (!method || !target) return std::nullopt;
  Request r;
  r.method = *method;
  r.segments = target->segments;
  r.query = target->query;
  for (auto line = line_of(text); !line.empty(); line = line_of(text)) {
    const auto colon = line.find(": ");
    if (colon == std::string_view::npos) continue;
    std::string name(line.substr(0, colon));
    for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
    r.headers.emplace_back(std::move(name), line.substr(colon + 2));
  }
  r.body = text;
  r.has_body = !r.body.empty();
  r.content_length = r.body.size();
  return r;
}

}  // namespace

void http(Bytes input) {
  HttpCoordinator coordinator;
  for (const Bytes part : parts_of(input, 6)) {
    const auto request = request_of(coordinator.with_job(text_of(part)));
    if (request && coordinator.small()) coordinator.ask(*request);
  }
}

Seeds http_seeds() {
  const std::string token = std::string("authorization: Bearer ") + HttpCoordinator::kToken + "\n";
  const std::string scene =
      R"(<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="4"/></film></sensor><shape type="sphere"/><emitter type="constant"/></scene>)";
  const std::string submit = "POST /api/v1/jobs?spp=4&size=8x4&define=a=b&tags=x,y&name=s.xml HTTP\n" +
                             token + "content-type: application/xml\n\n" + scene;
  const std::string digest = sha256(scene).hex();
  Seeds seeds{submit};
  for (const char* what : {"", "/image.exr", "/image.png?exposure=1", "/report", "/convergence.csv", "/tiles",
                           "/log", "?frame=2", "/events"})
    seeds.push_back(with_length(submit) + "GET /api/v1/jobs/JOB" + what + "\n" + token + "\n");
  for (const char* body : {R"({"state":"paused"})", R"({"priority":3,"spp":64})", R"({"target_error":0.01})"})
    seeds.push_back(with_length(submit) + "PATCH /api/v1/jobs/JOB\n" + token +
                    "content-type: application/json\n\n" + body);
  seeds.push_back(with_length(submit) + with_length("DELETE /api/v1/jobs/JOB\n" + token + "\n") +
                  "DELETE /api/v1/jobs/JOB\n" + token + "\n");
  seeds.push_back(with_length("PUT /api/v1/blobs/" + digest + "\n" + token + "\n" + scene) +
                  with_length("HEAD /api/v1/blobs/" + digest + "\n" + token + "\n") + "POST /api/v1/jobs\n" +
                  token + "content-type: application/json\n\n" + R"({"scene":")" + digest +
                  R"(","assets":{"a.obj":")" + digest +
                  R"("},"spec":{"spp":4,"frames":"1-3"},"name":"s.xml"})");
  seeds.push_back("POST /api/v1/blobs/missing\n" + token +
                  "content-type: application/json\n\n{\"sha256\":[\"" + digest + "\"]}");
  seeds.push_back(std::string("POST /api/v1/session\ncontent-type: application/json\norigin: http://a\nhost: "
                              "a\n\n{\"token\":\"") +
                  HttpCoordinator::kToken + "\"}");
  for (const char* address :
       {"/healthz", "/readyz", "/metrics", "/", "/js/main.js", "/api/v1/openapi.json", "/api/v1/workers",
        "/api/v1/jobs", "/api/v1/events?last_event_id=3", "/%2e%2e/x?a=%00+b"})
    seeds.push_back(std::string("GET ") + address + "\n" + token +
                    "accept-encoding: gzip\nif-none-match: \"x\"\n\n");
  return seeds;
}

}  // namespace ls::fuzz
