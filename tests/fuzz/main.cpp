// The entry point of libFuzzer for the target FUZZ_TARGET (a function of all_targets.h; FUZZ_SEEDS are its
// seeds); and two errands of run.sh: `--seeds DIR [PACK]` writes the seeds, and the inputs packed in a file,
// into a folder; `--pack DIR PACK` packs a folder's inputs.
#include <sys/time.h>

#include <unistd.h>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "core/base/digest.h"
#include "core/base/log.h"
#include "tests/fuzz/all_targets.h"

namespace {

namespace fs = std::filesystem;

// One input may cost this much of the processor, with sanitizers; more is a finding. libFuzzer's own limit
// counts the time of the wall, which says nothing on a machine with other work.
constexpr std::time_t kMostCpuSeconds = 5;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_seeds(const fs::path& folder, const char* pack) {
  fs::create_directories(folder);
  auto seeds = ls::fuzz::FUZZ_SEEDS();
  if (pack && fs::exists(pack))
    for (auto& input : ls::fuzz::unpacked(content(pack))) seeds.push_back(std::move(input));
  for (const std::string& seed : seeds)
    std::ofstream(folder / ls::sha256(seed).hex().substr(0, 16), std::ios::binary) << seed;
}

void write_pack(const fs::path& folder, const fs::path& pack) {
  std::vector<std::string> inputs;
  for (const auto& entry : fs::directory_iterator(folder)) inputs.push_back(content(entry.path()));
  std::sort(inputs.begin(), inputs.end());
  std::ofstream(pack, std::ios::binary) << ls::fuzz::packed(inputs);
}

extern "C" void too_slow(int) {
  constexpr std::string_view kText = "broken promise: an input costs no more than 5 s of the processor\n";
  (void)!::write(STDERR_FILENO, kText.data(), kText.size());
  __builtin_trap();
}

void bound_cpu(std::time_t seconds) {
  const itimerval timer{{0, 0}, {seconds, 0}};
  ::setitimer(ITIMER_PROF, &timer, nullptr);
}

}  // namespace

// Before libFuzzer reads its arguments: it knows no --seeds.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  ls::log_level(ls::LogLevel::off);
  const std::vector<const char*> arguments(*argv + 1, *argv + *argc);
  const std::string_view errand = arguments.empty() ? "" : arguments[0];
  if (errand == "--seeds" && arguments.size() >= 2) {
    write_seeds(arguments[1], arguments.size() > 2 ? arguments[2] : nullptr);
    std::exit(0);
  }
  if (errand == "--pack" && arguments.size() == 3) {
    write_pack(arguments[1], arguments[2]);
    std::exit(0);
  }
  std::signal(SIGPROF, too_slow);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bound_cpu(kMostCpuSeconds);
  ls::fuzz::FUZZ_TARGET({data, size});
  bound_cpu(0);
  return 0;
}
