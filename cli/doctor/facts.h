// Facts for `lightshaft doctor`: about this machine, and about a farm, read from the coordinator's HTTP
// interface by GET requests only. Observing them changes nothing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/farm/http_client.h"
#include "util/sandbox/sandbox.h"

namespace ls::cli {

struct FolderFacts {
  std::string name;  // purpose of the folder, such as "cache"
  std::filesystem::path path;
  bool usable = false;  // true if a writable folder exists there or can be created
  std::uint64_t free_bytes = 0;
};

// The Python interpreter and the Python package that run the commands up, join, farm up and compare.
struct PythonFacts {
  // That of LIGHTSHAFT_PYTHON, which a wheel sets, or python3 in PATH; empty: there is none
  std::filesystem::path interpreter;
  std::filesystem::path part;  // the folder lightshaft_command; empty: it is not where this program looks
  bool numpy = false;          // true if the interpreter finds NumPy, as `lightshaft up` starts it
  // True in a checkout, where `lightshaft up` makes the scene of the first picture with NumPy
  bool makes_scene = false;
};
PythonFacts find_python();  // without `numpy` and `makes_scene`

struct MachineFacts {
  std::string processor_target;  // processor for which the program was compiled, such as "x86-64-v3"
  bool processor_fits = false;
  // Numeric class of `lightshaft render` on this machine, in hexadecimal.
  std::string numeric_class;
  std::uint64_t memory_bytes = 0;
  int cpus = 0;
  double cpu_quota = 0;  // number of CPUs that the control group allows; 0: no limit
  std::uint64_t file_limit = 0;
  // Which restrictions the sandbox can put in place on this machine; nullopt: this could not be tried
  std::optional<Sandboxed> sandbox;
  std::filesystem::path vdb_program;
  bool vdb_found = false;
  std::string denoiser, denoiser_trouble;  // the denoiser's name, or why there is no denoiser
  std::filesystem::path redis_server;      // path of redis-server; empty: not in PATH
  PythonFacts python;
  std::vector<FolderFacts> folders;
};

MachineFacts observe_machine(const std::filesystem::path& cache, const std::filesystem::path& data);

// With this flag, the program only enters the sandbox and ends; its exit code has a bit for each restriction
// that took effect. observe_machine() runs it as a child process, since a process cannot leave the sandbox.
inline constexpr const char* kSandboxProbeFlag = "--sandbox-probe";
int run_sandbox_probe();

struct WorkerFacts {
  std::string name, state, version, numeric_class;
  bool fake = false;
};

// A job that has not ended and stands still
struct StuckJob {
  std::string id, why;
};

struct FarmFacts {
  std::string url;  // address without user and password
  bool has_token = false;
  std::string trouble;          // why there was no answer; empty: there was an answer
  std::string proxy;            // the proxy that answers come through; empty: none
  bool is_coordinator = false;  // true if a coordinator answered
  // From the answer to GET /readyz. `not_ready`: why the coordinator cannot take jobs; empty: it can.
  // `remark`: what else it reports; empty: nothing.
  std::string not_ready, remark;
  // In seconds since 1970: this machine's clock before and after the request, and the coordinator's clock,
  // from the header Date of its answer.
  double asked_at = 0, answered_at = 0;
  std::optional<std::int64_t> date;
  int session_status = 0;  // HTTP status of GET /api/v1/session, which returns the token's role
  std::string session_trouble, role, user, version;
  std::optional<std::vector<WorkerFacts>> workers;
  std::optional<std::vector<StuckJob>> stuck_jobs;  // among the first jobs that have not ended
  // The workers' port as the coordinator names it, with the host of `url` if it listens on all of its
  // machine's networks; empty: it does not name one. `workers_trouble`: why no connection was possible.
  std::string workers_address, workers_trouble;
};

// The port of `lightshaft up --lan` at which machines join its farm
struct JoiningFacts {
  std::string address;  // HOST:PORT
  std::string trouble;  // why no connection was possible; empty: one was
};
// `address`: HOST:PORT. invalid_argument: it is something else.
Result<JoiningFacts> observe_joining(const std::string& address);

// Returns one result for each address of `connection`. invalid_argument: an address or the CA file cannot be
// used.
Result<std::vector<FarmFacts>> observe_farm(const HttpClient::Options& connection);

}  // namespace ls::cli
