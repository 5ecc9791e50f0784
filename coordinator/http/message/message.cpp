#include "coordinator/http/message/message.h"

#include <algorithm>
#include <array>

#include "common/base/overloaded.h"

namespace ls::http {
namespace {

struct MethodName {
  Method method;
  std::string_view name;
};
constexpr std::array kMethods = {
    MethodName{Method::get, "GET"},         MethodName{Method::head, "HEAD"},
    MethodName{Method::post, "POST"},       MethodName{Method::put, "PUT"},
    MethodName{Method::patch, "PATCH"},     MethodName{Method::del, "DELETE"},
    MethodName{Method::options, "OPTIONS"},
};

struct StatusName {
  int status;
  std::string_view phrase;
};
constexpr std::array kPhrases = {
    StatusName{200, "OK"},
    StatusName{201, "Created"},
    StatusName{202, "Accepted"},
    StatusName{204, "No Content"},
    StatusName{304, "Not Modified"},
    StatusName{307, "Temporary Redirect"},
    StatusName{400, "Bad Request"},
    StatusName{401, "Unauthorized"},
    StatusName{403, "Forbidden"},
    StatusName{404, "Not Found"},
    StatusName{405, "Method Not Allowed"},
    StatusName{408, "Request Timeout"},
    StatusName{409, "Conflict"},
    StatusName{411, "Length Required"},
    StatusName{413, "Content Too Large"},
    StatusName{414, "URI Too Long"},
    StatusName{415, "Unsupported Media Type"},
    StatusName{416, "Range Not Satisfiable"},
    StatusName{429, "Too Many Requests"},
    StatusName{431, "Request Header Fields Too Large"},
    StatusName{500, "Internal Server Error"},
    StatusName{501, "Not Implemented"},
    StatusName{503, "Service Unavailable"},
    StatusName{505, "HTTP Version Not Supported"},
    StatusName{507, "Insufficient Storage"},
};

}  // namespace

std::string_view to_string(Method method) {
  for (const auto& m : kMethods)
    if (m.method == method) return m.name;
  return "GET";
}

std::optional<Method> parse_method(std::string_view name) {
  for (const auto& m : kMethods)
    if (m.name == name) return m.method;
  return std::nullopt;
}

std::string_view Request::header(std::string_view lower_case_name) const {
  for (const auto& [name, value] : headers)
    if (name == lower_case_name) return value;
  return {};
}

std::optional<std::string_view> Request::parameter(std::string_view wanted) const {
  for (const auto& [name, value] : query)
    if (name == wanted) return value;
  return std::nullopt;
}

std::span<const std::byte> Response::bytes() const {
  return std::visit(overloaded{[](const std::string& s) { return std::as_bytes(std::span(s)); },
                               [](const std::vector<std::byte>& v) { return std::span<const std::byte>(v); },
                               [](std::span<const std::byte> s) { return s; },
                               [](const FileBody&) { return std::span<const std::byte>(); }},
                    body);
}

std::uint64_t Response::length() const {
  const auto* file = std::get_if<FileBody>(&body);
  return file ? file->size : bytes().size();
}

std::uint64_t Response::in_memory() const {
  return std::holds_alternative<std::span<const std::byte>>(body) ? 0 : bytes().size();
}

Response text_response(int status, std::string content_type, std::string body) {
  Response response;
  response.status = status;
  response.content_type = std::move(content_type);
  response.body = std::move(body);
  return response;
}

Response json_response(int status, std::string json) {
  return text_response(status, "application/json", std::move(json));
}

std::string_view reason_phrase(int status) {
  for (const auto& s : kPhrases)
    if (s.status == status) return s.phrase;
  return "Unknown";
}

std::string media_type(std::string_view content_type) {
  std::string type(content_type.substr(0, content_type.find(';')));
  while (!type.empty() && (type.back() == ' ' || type.back() == '\t')) type.pop_back();
  std::transform(type.begin(), type.end(), type.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return type;
}

}  // namespace ls::http
