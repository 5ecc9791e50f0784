// Requests and responses as plain values, without sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "coordinator/http/message/caller.h"
#include "coordinator/http/message/file_body.h"

namespace ls::http {

enum class Method { get, head, post, put, patch, del, options };
std::string_view to_string(Method method);                  // "GET", ...
std::optional<Method> parse_method(std::string_view name);  // case-sensitive, as in RFC 9110

using Fields = std::vector<std::pair<std::string, std::string>>;

struct Request {
  Method method = Method::get;
  std::vector<std::string> segments;  // of the path, percent-decoded; none for "/"
  Fields query;                       // decoded, in order
  Fields headers;                     // names in lower case
  std::optional<std::uint64_t> content_length;
  bool has_body = false;  // Content-Length above zero, or chunked
  std::string body;
  std::string peer;  // the client's address without port; empty: unknown
  Caller caller;     // set by Api::admit for routes that identify the caller; the least role before

  std::string_view header(std::string_view lower_case_name) const;         // empty if absent
  std::optional<std::string_view> parameter(std::string_view name) const;  // the first of this name
};

// What a stream of Server-Sent Events shall contain. A Response with an EventStream is followed by the
// events.
struct EventStream {
  std::optional<std::uint64_t> after_id;  // only events with higher ids; nullopt: only those from now on
  std::string job;                        // only events of this job; empty: of all jobs
  Caller reader;                          // restricts the events to what the reader may see
};

struct Response {
  int status = 200;
  std::string content_type;  // empty: no body
  Fields headers;
  // The body; a span refers to static data
  std::variant<std::string, std::vector<std::byte>, std::span<const std::byte>, FileBody> body;
  std::optional<EventStream> events;

  std::span<const std::byte> bytes() const;  // empty for a file
  std::uint64_t length() const;              // of the body
  std::uint64_t in_memory() const;           // bytes held in memory while the response is sent
};

Response text_response(int status, std::string content_type, std::string body);
Response json_response(int status, std::string json);

std::string_view reason_phrase(int status);

// Returns "application/json" for "Application/JSON; charset=utf-8".
std::string media_type(std::string_view content_type);

}  // namespace ls::http
