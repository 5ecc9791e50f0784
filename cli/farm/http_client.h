// The interface to libcurl: sends requests to a coordinator's HTTP API over one persistent connection. As
// most programs do, libcurl goes through the proxy that http_proxy, https_proxy or all_proxy names, also to
// this machine's own addresses, unless no_proxy names the host.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"

namespace ls::cli {

struct HttpResponse {
  int status = 0;
  std::string body;
  std::optional<std::uint64_t> upload_offset;  // header Upload-Offset: bytes of the file that the server has
  std::optional<std::int64_t> date;            // header Date, in seconds since 1970
  std::string proxy;  // the proxy that the request went through, and the variable that names it; empty: none
};

class HttpClient {
 public:
  struct Options {
    // The coordinator's address, such as "https://farm.example:8080": http or https, with or without a path
    // before /api. It may be a list, separated by commas, of coordinators that share a farm: if one does not
    // answer, the client tries the next.
    std::string url;
    std::string token;  // sent as a bearer token; may be empty
    std::string ca;     // file of CA certificates to trust instead of the system's; may be empty
  };
  // invalid_argument: the address, the token or the CA file cannot be used.
  static Result<HttpClient> open(Options options);
  ~HttpClient();
  HttpClient(HttpClient&&) noexcept;

  // Sends a request and returns the response, whatever its status. `path` begins with "/". Errors:
  // unavailable (no connection, a connection that broke, or no trusted certificate, as the message states),
  // resource_exhausted (the response is larger than kMaxAnswerBytes).
  Result<HttpResponse> request(std::string_view method, const std::string& path, std::string_view body = {},
                               std::string_view content_type = "application/json");
  // Sends the bytes of a file by PUT without holding them all in memory. With `offset`, sends only the bytes
  // from that position on. The server appends them to those that it has, and keeps them even if the
  // connection breaks.
  Result<HttpResponse> upload(const std::string& path, const std::filesystem::path& file,
                              std::optional<std::uint64_t> offset = std::nullopt);
  // Sends an archive (a scene with its files) by POST. The coordinator may take up to an hour to answer,
  // because it first unpacks the archive.
  Result<HttpResponse> post_file(const std::string& path, const std::filesystem::path& file,
                                 std::string_view content_type);
  // Writes the body of a 2xx answer to `file`: through a temporary file beside it, or directly if it is a
  // pipe or a device. The body of any other answer is returned.
  Result<HttpResponse> download(const std::string& path, const std::filesystem::path& file);

  static constexpr std::size_t kMaxAnswerBytes = std::size_t{256} << 20;

 private:
  struct State;
  explicit HttpClient(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// Returns the addresses in Options::url, without slashes at their ends. One without http:// or https:// gets
// https://, unless it is of this machine and there is no file of CA certificates (`has_ca`).
std::vector<std::string> addresses_in(const std::string& url, bool has_ca);

// Decides whether to repeat a failed request: a restart, a proxy in between, or too many requests may make a
// coordinator unreachable for a while.
class RetryPolicy {
 public:
  // Waits, each time longer, and returns true if the failed request should be repeated. Returns false without
  // waiting if `error` is permanent, or if the coordinator has been unreachable for two minutes since the
  // last answered().
  bool again(const Error& error);
  void answered();

 private:
  SystemClock clock_;
  TimePoint last_answer_ = clock_.now();
  int pause_milliseconds_ = 0;
};

// Runs `call`, which must be repeatable, until it succeeds or RetryPolicy::again() returns false.
template <class Call>
auto with_retries(Call call) {
  RetryPolicy retry;
  auto answer = call();
  while (!answer && retry.again(answer.error().error)) answer = call();
  return answer;
}

}  // namespace ls::cli
