// The command line of lightshaft-worker.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/base/log.h"
#include "worker/client/client.h"
#include "worker/fake/fake.h"

namespace ls::worker {

struct Options {
  std::vector<std::string> coordinators;  // the address HOST:PORT of each coordinator
  int threads = 1;
  std::filesystem::path cache;
  std::uint64_t cache_limit = 0;   // upper limit for the bytes of the cache; 0: no limit
  std::uint64_t memory_limit = 0;  // upper limit for the render child's memory in bytes; 0: no limit
  double hang_seconds = 300;       // longest time for one sample
  double build_seconds = 1800;     // longest time to build a scene
  double idle_seconds = 0;         // time without work after which the worker ends; 0: no limit
  std::string name;
  std::vector<std::string> tags;
  std::string join_token;
  std::optional<LinkTls> tls;  // certificates; nullopt: no encryption
  bool fake = false;
  FakeOptions fake_options;
  std::string fake_fault_text;
  std::string fake_class;  // if not empty, the SHA-256 of this text replaces the numeric class
  LogFormat log_format = LogFormat::text;
  bool render_child = false;  // this process is a render child; only workers pass this flag
};

// Parses the command line. Returns the process's exit code instead of Options if there is nothing to run
// (after --help), or if the usage is wrong (2, and the reason is on stderr).
std::variant<Options, int> parse_options(int argc, char** argv);

// Returns the arguments with which a worker with these options starts its render child, the same executable
// (worker/child).
std::vector<std::string> child_arguments(const Options& options);

}  // namespace ls::worker
