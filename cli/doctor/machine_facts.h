// Facts about this machine for `lightshaft doctor`. Observing them changes nothing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "worker/child/sandbox.h"

namespace ls::cli {

struct FolderFacts {
  std::string name;  // purpose of the folder: "cache"
  std::filesystem::path path;
  bool usable = false;  // true if a writable folder exists there or can be created
  std::uint64_t free_bytes = 0;
};

struct MachineFacts {
  std::string processor_target;  // processor for which the program was compiled: "x86-64-v3"
  bool processor_fits = false;
  // Numeric class of `lightshaft render` on this machine, in hexadecimal: machines of one class render the
  // same bits.
  std::string numeric_class;
  std::uint64_t memory_bytes = 0;
  int cpus = 0;
  double cpu_quota = 0;  // number of CPUs that the control group allows; 0: no limit
  std::uint64_t file_limit = 0;
  // Which restrictions the sandbox can put in place on this machine; nullopt: this could not be tried
  std::optional<worker::child::Sandboxed> sandbox;
  std::filesystem::path vdb_program;
  bool vdb_found = false;
  std::string denoiser, denoiser_trouble;  // name of the denoiser, or why there is none
  std::filesystem::path redis_server;      // path of redis-server; empty: not in PATH
  std::vector<FolderFacts> folders;
};

MachineFacts observe_machine(const std::filesystem::path& cache, const std::filesystem::path& data);

// Entering the sandbox is tried in a separate process, since a process cannot leave it again. That process is
// this program with this flag; its exit code is the result.
inline constexpr const char* kSandboxProbeFlag = "--sandbox-probe";
int run_sandbox_probe();

}  // namespace ls::cli
