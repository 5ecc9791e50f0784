// Another program in a race, by its adapter. What it hands in is believed as far as it can be checked:
// pictures are read with limits, times compared with those of its process.
#pragma once

#include <memory>

#include "cli/compare/adapter.h"
#include "cli/compare/racer.h"

namespace ls::race {

struct ProgramEntry {
  Adapter adapter;
  std::filesystem::path scene;
  std::uint64_t seed = 0;
  std::string name;  // of files: the lane's, unique in `folder`
  std::filesystem::path folder;
};
std::unique_ptr<Racer> make_program_racer(ProgramEntry entry, const Conditions& conditions,
                                          const Clock& clock);

}  // namespace ls::race
