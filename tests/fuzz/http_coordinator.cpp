#include "tests/fuzz/http_coordinator.h"

#include <nlohmann/json.hpp>

#include "coordinator/http/message/message.h"
#include "formats/read.h"
#include "tests/fuzz/fuzz.h"

namespace ls::fuzz {

using namespace ls::http;

namespace {
constexpr std::int64_t kMostJobPixels = 1 << 16;  // of an image that is made whole
}

HttpCoordinator::HttpCoordinator() {
  auto opened = coordinator::Coordinator::open({.scenes = scenes_in_this_process});
  must(opened.has_value(), "a coordinator opens");
  coordinator_ = std::move(*opened);
  http::Limits limits;
  limits.blob_bytes = limits.bundle_bytes = 1 << 20;
  limits.unpacked_bytes = 4 << 20;
  limits.requests_per_second = limits.wrong_tokens_per_minute = 0;  // the fuzzer is quicker
  api_ = std::make_unique<Api>(*coordinator_, tokens_, limits, StaticFiles(embedded_files()));
}

std::string HttpCoordinator::with_job(std::string_view part) const {
  std::string text(part);
  for (std::size_t at = text.find("JOB"); !job_.empty() && at != std::string::npos;
       at = text.find("JOB", at + job_.size()))
    text.replace(at, 3, job_);
  return text;
}

bool HttpCoordinator::small() const {
  for (const auto& job : coordinator_->jobs())
    if (std::int64_t{job.size.width} * job.size.height > kMostJobPixels) return false;
  return true;
}

void HttpCoordinator::check(const Response& response, Method method) const {
  must(response.status >= 200 && response.status <= 599, "a response has a status");
  const std::string head = head_text(response, {.method = method}, 0);
  must(head.find("\r\n\r\n") == head.size() - 4, "a header ends where its empty line is");
  for (std::size_t i = 0; i < head.size(); ++i)
    must(head[i] != '\n' || (i > 0 && head[i - 1] == '\r'), "no header is cut in two");
  if (media_type(response.content_type).find("json") == std::string::npos || response.events) return;
  const auto bytes = response.bytes();
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  must(nlohmann::json::accept(text, text + bytes.size()), "a body that is called JSON is JSON");
}

Response HttpCoordinator::answer(Request r) {
  auto admitted = api_->admit(r);
  if (auto* response = std::get_if<Response>(&admitted)) return std::move(*response);
  const auto& match = std::get<Match>(admitted);
  if (r.body.size() > api_->body_limit(*match.route, r)) return text_response(413, "text/plain", "");
  const BodyKind kind = api_->body_kind(*match.route, r);
  if (kind != BodyKind::blob && kind != BodyKind::archive) return api_->handle(match, r);
  auto opened = api_->open_upload(match, r);
  if (auto* response = std::get_if<Response>(&opened)) return std::move(*response);
  auto& sink = std::get<std::unique_ptr<BodySink>>(opened);
  if (auto refused = sink->append(std::as_bytes(std::span(r.body)))) return std::move(*refused);
  return sink->finish();
}

void HttpCoordinator::ask(const Request& request) {
  const Response response = answer(request);
  check(response, request.method);
  if (response.status != 201) return;
  const auto bytes = response.bytes();
  const auto said = nlohmann::json::parse(
      std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), nullptr, false);
  if (said.is_object() && said.contains("id")) job_ = said["id"];
}

}  // namespace ls::fuzz
