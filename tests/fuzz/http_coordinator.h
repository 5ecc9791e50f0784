// A coordinator in memory that answers HTTP requests. The fuzz targets `http` (requests as text) and `wire`
// (bytes of a connection) send to it.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "coordinator/http/api/api.h"

namespace ls::fuzz {

class HttpCoordinator {
 public:
  static constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

  HttpCoordinator();

  // The text with the id of the last submission wherever it says JOB.
  std::string with_job(std::string_view text) const;
  // No job has an image so large that making it would cost the fuzzer's time.
  bool small() const;
  // As the server's loop does: admits, then runs the handler or fills the upload. The response is checked.
  void ask(const http::Request& request);
  void check(const http::Response& response, http::Method method) const;

  http::Api& api() { return *api_; }

 private:
  http::Response answer(http::Request request);

  std::unique_ptr<coordinator::Coordinator> coordinator_;
  http::TokenRegistry tokens_{kToken};
  std::unique_ptr<http::Api> api_;
  std::string job_;
};

}  // namespace ls::fuzz
