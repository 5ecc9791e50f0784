// Command line and config file of lightshaft-coordinator.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "coordinator/http/message/limits.h"
#include "coordinator/service/coordinator.h"
#include "core/base/log.h"
#include "core/base/machine_memory.h"

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
  std::string secrets;  // folder of tokens and TLS files; empty: the folder of --data
  // Hours for which a blob (file of a scene) is kept after the last job that needs it. nullopt: 24 hours, or
  // forever if --blobs is given, because other coordinators may use that store
  std::optional<double> keep_unused_hours;
  std::vector<std::string> webhooks;
  LogFormat log_format = LogFormat::text;
  http::Limits limits;
  ShareLimits shares;
  std::uint64_t film_memory = usable_memory_bytes() / 2;  // as Coordinator::Options::film_bytes
  double audit_percent = 1;
  std::string usd_python;  // a Python that reads stages of USD; empty: they are refused
  std::string ocio;        // an OpenColorIO configuration; empty: that of $OCIO, or the built-in views
  bool allow_fake = false;
};

// Returns the flags. Returns an exit code instead if the program is to end at once: 0 after help, 2 after
// wrong usage (reported on stderr).
std::variant<Flags, int> parse_flags(int argc, char** argv);

}  // namespace ls::coordinator
