// Requests and responses as plain values, without sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/error.h"
#include "core/base/spawn.h"
#include "core/scene/diagnostic.h"

namespace ls::http {

// The caller of a request and its role. What each role may do: docs/reference/authorisation.md.
enum class Role {
  admin,   // may do everything
  submit,  // may submit jobs, and see and change only its own jobs
  read,    // may see everything, but change nothing
  join,    // a worker: may join the farm over gRPC, but may not use the HTTP API
};
std::string_view to_string(Role role);  // returns "admin", ...
std::optional<Role> parse_role(std::string_view name);

struct Caller {
  Role role = Role::join;  // the role with the fewest rights, until the caller is identified
  // The user that the caller's token belongs to, who becomes the owner of the jobs that the caller submits;
  // empty: the token belongs to no user, like the administrator's token (in the file `token`)
  std::string user;
  std::string token_id;
  // True if the caller may see the jobs of the user `owner`.
  bool sees(std::string_view owner) const {
    return role == Role::admin || role == Role::read || (role == Role::submit && owner == user);
  }
};

// A response body that is read from a file. It is sent slice by slice, so that it does not fill memory while
// a slow client reads it.
struct FileBody {
  // The open file. It is closed when the last copy of the FileBody is destroyed, and can be read until then,
  // even if the file has been removed from its folder.
  std::shared_ptr<const Descriptor> opened;
  std::uint64_t size = 0;  // bytes
};

// Opens a file as the body of a response. not_found: there is no such file.
Result<FileBody> open_file_body(const std::filesystem::path& path);

// Reads bytes from `offset` on and returns their number; 0: the file has become shorter, or cannot be read.
std::size_t read_slice(const FileBody& file, std::uint64_t offset, std::span<std::byte> into);

enum class Method { get, head, post, put, patch, del, options };
std::string_view to_string(Method method);                  // returns "GET", ...
std::optional<Method> parse_method(std::string_view name);  // case-sensitive, as in RFC 9110

using Fields = std::vector<std::pair<std::string, std::string>>;

// Returns the text with the letters A to Z in lower case.
std::string lower_case(std::string_view text);
// Returns the text of `rest` up to the first `separator`, and removes both from `rest`. Without a separator,
// returns all of `rest`.
std::string_view take_part(std::string_view& rest, char separator);

struct Request {
  Method method = Method::get;
  std::vector<std::string> segments;  // segments of the path, percent-decoded; none for "/"
  Fields query;                       // parameters of the query, percent-decoded, in their order
  Fields headers;                     // names in lower case
  std::optional<std::uint64_t> content_length;
  bool has_body = false;  // true for a Content-Length above zero or a chunked body
  std::string body;
  std::string peer;  // the client's address without port; empty: unknown
  Caller caller;     // set by Api::admit on routes that identify the caller; before, the default Caller

  std::string_view header(std::string_view lower_case_name) const;  // empty if absent
  // Value of the first parameter of the query with this name; nullopt: there is none
  std::optional<std::string_view> parameter(std::string_view name) const;
};

// Selects the events of a stream of Server-Sent Events. If a Response has an EventStream, the server sends
// these events after the header.
struct EventStream {
  // Only events whose ids are higher than this are sent; nullopt: only events that occur from now on
  std::optional<std::uint64_t> after_id;
  std::string job;  // id of a job: only its events are sent; empty: the events of all jobs
  Caller reader;    // who gets the stream: only events that this caller may see are sent
};

struct Response {
  int status = 200;
  std::string content_type;  // empty: no body
  Fields headers;
  // The body. A span is a file that is built into the program, so its bytes exist until the program ends.
  std::variant<std::string, std::vector<std::byte>, std::span<const std::byte>, FileBody> body;
  std::optional<EventStream> events;

  std::span<const std::byte> bytes() const;  // the body's bytes; empty if the body is a file
  std::uint64_t length() const;              // length of the body in bytes
  std::uint64_t in_memory() const;           // bytes held in memory while the response is sent
};

Response text_response(int status, std::string content_type, std::string body);
Response json_response(int status, std::string json);

std::string_view reason_phrase(int status);

// Returns the HTTP status for an error. No other function maps Errc to HTTP status codes.
int status_of(Errc code);

// Makes a response that reports an error as RFC 9457 problem details: JSON {type, title, status, detail}. The
// text `detail` states the cause, where it is, and the remedy.
Response problem(int status, std::string_view detail, Fields headers = {});
Response problem(const Error& error);
// Returns a 429 with the header Retry-After: `wait_seconds`.
Response too_many(int wait_seconds, std::string_view detail);
// Returns the problem of a rejected scene. It has an additional member diagnostics: [{severity, file, line,
// column, text, source_line, length}].
Response problem(const Error& error, std::span<const Diagnostic> diagnostics);

// Returns the media type in lower case without parameters: "application/json" for "Application/JSON;
// charset=utf-8".
std::string media_type(std::string_view content_type);

struct HeadOptions {
  bool keep_alive = false;
  bool streamed = false;  // true: there is no Content-Length, and the body ends with the connection
  Method method = Method::get;
};

// Returns the status line, the header fields and the empty line behind them. The fields are those of
// `response`, and Date (from `unix_seconds`), the length, and the security headers of every response.
std::string head_text(const Response& response, const HeadOptions& options, std::int64_t unix_seconds);

struct Target {
  std::vector<std::string> segments;
  Fields query;
};

// Parses "/api/v1/jobs?spp=4" or "http://host/path". Invalid percent codes, control characters, '/' or NUL
// hidden in a percent code, and more than kMaxQueryParameters are errors (400).
Result<Target> parse_target(std::string_view target);

}  // namespace ls::http
