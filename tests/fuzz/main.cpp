// The entry point of libFuzzer for the target FUZZ_TARGET (a function of all_targets.h; FUZZ_SEEDS are its
// seeds); and
// `--seeds DIR`, which writes the seeds there.
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/base/digest.h"
#include "common/base/log.h"
#include "tests/fuzz/all_targets.h"

// Before libFuzzer reads its arguments: it knows no --seeds.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  ls::log_level(ls::LogLevel::off);
  if (*argc != 3 || std::strcmp((*argv)[1], "--seeds") != 0) return 0;
  const std::filesystem::path folder = (*argv)[2];
  std::filesystem::create_directories(folder);
  for (const std::string& seed : ls::fuzz::FUZZ_SEEDS())
    std::ofstream(folder / ls::sha256(seed).hex().substr(0, 16), std::ios::binary) << seed;
  std::exit(0);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ls::fuzz::FUZZ_TARGET({data, size});
  return 0;
}
