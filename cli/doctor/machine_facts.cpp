#include "cli/doctor/machine_facts.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "common/base/spawn.h"
#include "common/denoise/denoiser.h"
#include "worker/machine.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;

enum ProbeBits : int { kProbed = 64, kCalls = 1, kFiles = 2, kSizes = 4 };

std::optional<worker::child::Sandboxed> probe_sandbox() {
  const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
  if (nothing.fd < 0) return std::nullopt;
  const auto status = run_helper("/proc/self/exe", {kSandboxProbeFlag}, nothing.fd);
  if (!status || !WIFEXITED(*status) || !(WEXITSTATUS(*status) & kProbed)) return std::nullopt;
  const int bits = WEXITSTATUS(*status);
  return worker::child::Sandboxed{(bits & kCalls) != 0, (bits & kFiles) != 0, (bits & kSizes) != 0};
}

bool processor_fits([[maybe_unused]] const std::string& target) {
  // The program runs, so the processor supports every target that is not tested here.
#ifdef __x86_64__
  if (target == "x86-64-v3") return __builtin_cpu_supports("x86-64-v3") != 0;
#endif
  return true;
}

double cpu_quota() {
  double quota = 0, period = 0;
  std::ifstream group("/sys/fs/cgroup/cpu.max");
  return group >> quota >> period && period > 0 ? quota / period : 0;  // "max 100000" means no limit
}

bool may_run(const fs::path& program) { return ::access(program.c_str(), X_OK) == 0; }

fs::path in_path(const std::string& program) {
  const char* variable = std::getenv("PATH");
  const std::string folders = variable ? variable : "";
  for (std::size_t at = 0; at < folders.size();) {
    const std::size_t end = std::min(folders.find(':', at), folders.size());
    const fs::path candidate = fs::path(folders.substr(at, end - at)) / program;
    if (may_run(candidate)) return candidate;
    at = end + 1;
  }
  return {};
}

// Observes a folder. A folder that does not exist is judged by the nearest existing one above it, where it
// would be created.
FolderFacts observe_folder(const std::string& name, const fs::path& path) {
  FolderFacts facts{name, path, false, 0};
  std::error_code error;
  fs::path existing = fs::absolute(path, error);
  while (!existing.empty() && existing != existing.root_path() && !fs::exists(existing, error))
    existing = existing.parent_path();
  facts.usable = fs::is_directory(existing, error) && ::access(existing.c_str(), W_OK | X_OK) == 0;
  const auto space = fs::space(existing, error);
  if (!error) facts.free_bytes = space.available;
  return facts;
}

}  // namespace

int run_sandbox_probe() {
  const auto held = worker::child::enter_sandbox({});
  return kProbed | (held.calls ? kCalls : 0) | (held.files ? kFiles : 0) | (held.sizes ? kSizes : 0);
}

MachineFacts observe_machine(const fs::path& cache, const fs::path& data) {
  MachineFacts facts;
  facts.processor_target = LIGHTSHAFT_ARCH;
  facts.processor_fits = processor_fits(facts.processor_target);
  facts.numeric_class = render::numeric_class().hex();
  facts.memory_bytes = worker::usable_memory_bytes();
  facts.cpus = worker::usable_cpus();
  facts.cpu_quota = cpu_quota();
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) facts.file_limit = files.rlim_max;
  facts.sandbox = probe_sandbox();
  facts.vdb_program = program_beside_us("lightshaft-vdb");
  facts.vdb_found = may_run(facts.vdb_program);
  const auto denoiser = Denoiser::find(1);
  if (denoiser) facts.denoiser = denoiser->name();
  if (!denoiser) facts.denoiser_trouble = denoiser.error().message;
  facts.redis_server = in_path("redis-server");
  facts.folders.push_back(observe_folder("cache", cache.empty() ? worker::default_cache() : cache));
  if (!data.empty()) facts.folders.push_back(observe_folder("data", data));
  return facts;
}

}  // namespace ls::cli
