// The options of `lightshaft validate`. The program lightshaft describes them, and starts
// lightshaft-validate, which parses them again.
#pragma once

#include <cstdint>
#include <string>

namespace CLI {
class App;
}

namespace ls::cases {

struct Options {
  std::string file, json, only;
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all
  bool strict = false, quick = false;
};

inline constexpr const char* kHelp =
    "check the renderer against known answers: stiff and extreme cases, or the tests of a Nori file (ttest, "
    "chi2test); exit code 0 if all pass, 1 if not";

void add_options(CLI::App& app, Options& options);

}  // namespace ls::cases
