// Every seed, what becomes of seeds that are cut or have a bit turned, every input that was ever a finding
// (tests/fuzz/corpus/TARGET/*), and what coverage-guided fuzzing kept (tests/fuzz/corpus/TARGET.pack),
// through its target; each must come back.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "core/base/log.h"
#include "tests/fuzz/fuzz.h"

namespace ls::fuzz {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Replay : public testing::TestWithParam<Target> {
 protected:
  void SetUp() override { log_level(LogLevel::off); }
};

TEST_P(Replay, SeedsRunWithoutCrash) {
  const auto seeds = GetParam().seeds();
  ASSERT_FALSE(seeds.empty());
  for (const std::string& seed : seeds) GetParam().run(input_of(seed));
  GetParam().run({});
}

TEST_P(Replay, DamagedSeedsRunWithoutCrash) {
  constexpr int kTurns = 12;  // of each seed; a fuzzer makes many more
  std::mt19937 random(1);
  for (const std::string& seed : GetParam().seeds())
    for (int turn = 0; turn < kTurns && !seed.empty(); ++turn) {
      std::string damaged = seed;
      if (turn % 3 == 0) damaged.resize(random() % seed.size());
      for (int i = 0; i < turn % 4 && !damaged.empty(); ++i)
        damaged[random() % damaged.size()] ^= static_cast<char>(1u << random() % 8);
      GetParam().run(input_of(damaged));
    }
}

TEST_P(Replay, PastFindingsRunWithoutCrash) {
  const std::filesystem::path folder = std::filesystem::path(FUZZ_CORPUS) / GetParam().name;
  std::vector<std::filesystem::path> files;
  std::error_code none;  // of a target without findings
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& path : files) {
    SCOPED_TRACE(path);
    const std::string input = content(path);
    ASSERT_FALSE(input.empty());
    GetParam().run(input_of(input));
  }
}

TEST_P(Replay, CorpusRunsWithoutCrash) {
  const auto pack = std::filesystem::path(FUZZ_CORPUS) / (std::string(GetParam().name) + ".pack");
  const auto inputs = unpacked(content(pack));
  ASSERT_FALSE(inputs.empty()) << pack;
  for (const std::string& input : inputs) GetParam().run(input_of(input));
}

TEST(Pack, RoundTripsAndRefusesTruncatedData) {
  const std::vector<std::string> inputs{"", "a", std::string(70000, 'b')};
  const std::string pack = packed(inputs);

  EXPECT_EQ(unpacked(pack), inputs);
  EXPECT_TRUE(unpacked(pack.substr(0, pack.size() - 1)).empty());
  EXPECT_TRUE(unpacked("abc").empty());
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Replay, testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace ls::fuzz
