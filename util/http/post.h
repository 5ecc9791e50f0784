// Sends one HTTP POST to an address that the operator named: a receiver of notifications or a collector of
// traces. It follows no redirects, ignores the proxies that the environment names, and speaks only http and
// https, so that the answering side cannot make this program send requests to other addresses.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace ls {

struct HttpPost {
  std::string url;
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  double seconds = 15;                // time limit of the whole request, in seconds
  std::size_t most_answer_bytes = 0;  // the body of the answer is cut to this many bytes
  // file of the certificates of the authorities to trust; empty: the system's certificates
  std::string ca_file;
  // Called about once a second while the request runs; if it returns true, the request ends with an error.
  // May be empty.
  std::function<bool()> give_up = {};
};

struct HttpAnswer {
  int status = 0;
  std::string body;
};

// Returns the answer, whatever its status. Error unavailable: no connection, or no answer in time.
Result<HttpAnswer> post(const HttpPost& request);

// Returns invalid_argument unless requests can be sent to this address. `setting` is the flag or environment
// variable that gave the address; the message names it.
Result<void> check_http_url(const std::string& url, std::string_view setting);

}  // namespace ls
