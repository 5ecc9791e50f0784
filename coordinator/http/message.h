// A request and its response as plain values: what the routes see, without sockets.
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

#include "coordinator/http/caller.h"
#include "coordinator/http/file_body.h"

namespace ls::http {

enum class Method { get, head, post, put, patch, del, options };
std::string_view to_string(Method method);                  // "GET" ...
std::optional<Method> parse_method(std::string_view name);  // case matters, as in RFC 9110

using Fields = std::vector<std::pair<std::string, std::string>>;

struct Request {
  Method method = Method::get;
  std::vector<std::string> segments;  // of the path, percent-decoded; "/" has none
  Fields query;                       // decoded, in order
  Fields headers;                     // names in lower case
  std::optional<std::uint64_t> content_length;
  bool has_body = false;  // a length above zero, or chunked
  std::string body;
  std::string peer;  // address that it comes from, without port; empty: unknown
  Caller caller;     // set by Api::admit for a route that asks who it is; of the least role before

  std::string_view header(std::string_view lower_case_name) const;         // empty if absent
  std::optional<std::string_view> parameter(std::string_view name) const;  // the first of this name
};

// Set in a response that goes on as Server-Sent Events.
struct EventStream {
  std::optional<std::uint64_t> after_id;  // nothing: from now on
  std::string job;                        // empty: everything
  Caller reader;                          // who may see it
};

struct Response {
  int status = 200;
  std::string content_type;  // empty: no body
  Fields headers;
  std::variant<std::string, std::vector<std::byte>, std::span<const std::byte>, FileBody>
      body;  // the span: static data
  std::optional<EventStream> events;

  std::span<const std::byte> bytes() const;  // of a file: none
  std::uint64_t length() const;              // of the body
  std::uint64_t in_memory() const;           // bytes that this response keeps while it is sent
};

Response text_response(int status, std::string content_type, std::string body);
Response json_response(int status, std::string json);

std::string_view reason_phrase(int status);

// "application/json" out of "Application/JSON; charset=utf-8".
std::string media_type(std::string_view content_type);

}  // namespace ls::http
