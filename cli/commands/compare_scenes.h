// Options of `lightshaft compare`, and the races that it runs.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/adapter.h"
#include "compare/race.h"
#include "coordinator/service/coordinator.h"

namespace ls::cli {

struct CompareOptions {
  std::vector<std::string> scenes;
  std::vector<std::string> integrators;  // empty: the scene's
  std::vector<race::Adapter> programs;
  race::Conditions conditions;    // except the size
  std::optional<FrameSize> size;  // empty: the scene's
  std::size_t seeds = 5;
  std::uint64_t first_seed = 0;
  std::vector<std::filesystem::path> reference;  // one or two images, for a single scene
  std::filesystem::path references;  // a folder with reference images for several scenes; may be empty
  std::map<std::string, std::string> defines;
  std::filesystem::path report;
  bool strict = false, quiet = false;
};

// Names of scenes for tables and files: the file's name, or its folder's if the file's says nothing.
std::vector<std::string> scene_names(const std::vector<std::string>& files);

// The reference images in a folder for a scene of this name: NAME.0.exr and NAME.1.exr, or NAME.exr; empty:
// none.
std::vector<std::filesystem::path> references_in(const std::filesystem::path& folder,
                                                 const std::string& name);

tl::expected<race::Race, coordinator::Rejected> race_scene(const CompareOptions& options,
                                                           const std::string& file, const std::string& name,
                                                           const std::atomic<bool>& stop);

}  // namespace ls::cli
