// The command line of lightshaft-coordinator, and its config file.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/log.h"
#include "coordinator/http/limits.h"
#include "coordinator/service.h"

namespace ls::coordinator {

struct Flags {
  std::string http = "127.0.0.1:8080";
  std::string grpc = "127.0.0.1:50051";
  std::string data = "lightshaft-data";
  std::string store = "sqlite";
  bool tls = false;
  std::vector<std::string> tls_names;
  std::string tls_ca, tls_cert, tls_key;
  std::string blobs;
  bool shared = false;
  std::string public_http, public_grpc;
  std::string secrets;  // folder of tokens and TLS; empty: --data
  // Not given: 24, and nothing is removed of a store that others may share.
  std::optional<double> keep_unused_hours;
  std::vector<std::string> webhooks;
  LogFormat log_format = LogFormat::text;
  http::Limits limits;
  ShareLimits shares;
  double audit_percent = 1;
  bool allow_fake = false;
};

// The exit code instead, when there is nothing to run (help) or the usage is wrong (2, said on stderr).
std::variant<Flags, int> parse_flags(int argc, char** argv);

}  // namespace ls::coordinator
