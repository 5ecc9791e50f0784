// The interface to libcurl: requests to a coordinator's HTTP API over one persistent connection.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/error.h"

namespace ls::cli {

struct HttpResponse {
  int status = 0;
  std::string content_type;
  std::string body;
  std::optional<std::uint64_t> upload_offset;  // the header Upload-Offset
};

class HttpClient {
 public:
  struct Options {
    // "https://farm.example:8080"; http or https, with or without a path before /api. If several coordinators
    // share a farm, several addresses separated by commas: if one does not answer, the next is tried.
    std::string url;
    std::string token;  // sent as a bearer token; may be empty
    std::string ca;     // file of CA certificates to trust instead of the system's; may be empty
  };
  // invalid_argument: the address, the token or the CA file cannot be used.
  static Result<HttpClient> open(Options options);
  ~HttpClient();
  HttpClient(HttpClient&&) noexcept;

  // `path` begins with "/". Errors: unavailable (no connection, cut off, no trusted certificate: the message
  // says which), resource_exhausted (the answer is larger than kMaxAnswerBytes). Any status counts as a
  // response.
  Result<HttpResponse> request(std::string_view method, const std::string& path, std::string_view body = {},
                               std::string_view content_type = "application/json");
  // PUTs a file's bytes without holding them in memory; with an offset only those after it, as a part of the
  // whole that the server keeps if the connection breaks.
  Result<HttpResponse> upload(const std::string& path, const std::filesystem::path& file,
                              std::optional<std::uint64_t> offset = std::nullopt);
  // POSTs a file; the coordinator may take up to an hour to answer, because it unpacks the archive first.
  Result<HttpResponse> post_file(const std::string& path, const std::filesystem::path& file,
                                 std::string_view content_type);
  // Writes the body of a 2xx answer to `file` through a temporary file beside it, or directly if it is a pipe
  // or a device. For other answers the body is returned.
  Result<HttpResponse> download(const std::string& path, const std::filesystem::path& file);

  static constexpr std::size_t kMaxAnswerBytes = std::size_t{256} << 20;

 private:
  struct State;
  explicit HttpClient(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ls::cli
