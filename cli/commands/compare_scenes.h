// Options of `lightshaft compare`, and the races that it runs. A race renders one scene with several
// integrators at equal cost, with several seeds, and compares the errors.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/race.h"
#include "coordinator/service/coordinator.h"

namespace ls::cli {

struct CompareOptions {
  std::vector<std::string> scenes;
  std::vector<std::string> integrators;  // their names; empty: only the one that the scene names
  race::Conditions conditions;           // time limit and its clock, samples, threads; the size is set later
  std::optional<FrameSize> size;         // size of the image; nullopt: the size in the scene
  std::size_t seeds = 5;
  std::uint64_t first_seed = 0;
  std::vector<std::filesystem::path> reference;  // one or two reference images, for a single scene
  std::filesystem::path references;  // a folder with reference images for several scenes; empty: none
  std::map<std::string, std::string> defines;
  std::filesystem::path report;
  bool strict = false, quiet = false;
};

// Returns the names of the scenes in tables and files: the name of the scene file without extension, or its
// folder's name if the file is called "scene". If a name occurs again, a number is appended to it.
std::vector<std::string> scene_names(const std::vector<std::string>& files);

// Returns the reference images in `folder` for the scene called `name`: NAME.0.exr and NAME.1.exr, or
// NAME.exr. Empty if there are none.
std::vector<std::filesystem::path> references_in(const std::filesystem::path& folder,
                                                 const std::string& name);

tl::expected<race::Race, coordinator::Rejected> race_scene(const CompareOptions& options,
                                                           const std::string& file, const std::string& name,
                                                           const std::atomic<bool>& stop);

}  // namespace ls::cli
