#include "coordinator/http/message/problem.h"

#include <array>
#include <nlohmann/json.hpp>

namespace ls::http {
namespace {

struct Row {
  Errc code;
  int status;
};
constexpr std::array kStatus = {
    Row{Errc::invalid_argument, 400},   Row{Errc::not_found, 404},
    Row{Errc::already_exists, 409},     Row{Errc::failed_precondition, 409},
    Row{Errc::resource_exhausted, 507}, Row{Errc::permission_denied, 403},
    Row{Errc::unauthenticated, 401},    Row{Errc::unavailable, 503},
    Row{Errc::internal, 500},
};

Response problem_of(int status, const nlohmann::ordered_json& json) {
  // Texts may quote bytes of a scene. Invalid UTF-8 is replaced, so that dump() never throws.
  Response response =
      text_response(status, "application/problem+json",
                    json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  if (status == 401) response.headers.emplace_back("WWW-Authenticate", "Bearer realm=\"lightshaft\"");
  if (status == 503) response.headers.emplace_back("Retry-After", "2");
  return response;
}

nlohmann::ordered_json base(int status, std::string_view type, std::string_view detail) {
  return {{"type", type}, {"title", reason_phrase(status)}, {"status", status}, {"detail", detail}};
}

}  // namespace

int status_of(Errc code) {
  for (const auto& row : kStatus)
    if (row.code == code) return row.status;
  return 500;
}

Response problem(int status, std::string_view detail) {
  return problem_of(status, base(status, "about:blank", detail));
}

Response too_many(int wait_seconds, std::string_view detail) {
  Response response = problem(429, detail);
  response.headers.emplace_back("Retry-After", std::to_string(wait_seconds));
  return response;
}

Response problem(const Error& error) { return problem(status_of(error.code), error.message); }

Response problem(const Error& error, std::span<const Diagnostic> diagnostics) {
  if (diagnostics.empty()) return problem(error);
  const int status = status_of(error.code);
  auto json = base(status, "urn:lightshaft:problem:scene-rejected", error.message);
  auto& list = json["diagnostics"] = nlohmann::ordered_json::array();
  for (const auto& d : diagnostics)
    list.push_back({{"severity", d.severity == Diagnostic::Severity::error ? "error" : "warning"},
                    {"file", d.place.file},
                    {"line", d.place.line},
                    {"column", d.place.column},
                    {"text", d.text},
                    {"source_line", d.source_line},
                    {"length", d.length}});
  return problem_of(status, json);
}

}  // namespace ls::http
