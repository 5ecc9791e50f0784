// An external program in a race, called through its adapter. Its results are validated as far as possible:
// images are read with limits, claimed times compared with those of its process.
#pragma once

#include <memory>

#include "compare/adapter.h"
#include "compare/racer.h"

namespace ls::race {

struct ProgramEntry {
  Adapter adapter;
  std::filesystem::path scene;
  std::uint64_t seed = 0;
  std::string name;  // for file names: the lane's name, unique in `folder`
  std::filesystem::path folder;
};
std::unique_ptr<Racer> make_program_racer(ProgramEntry entry, const Conditions& conditions,
                                          const Clock& clock);

}  // namespace ls::race
