// What `lightshaft compare` is asked for, and the races that come of it.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/compare/adapter.h"
#include "cli/compare/race.h"
#include "coordinator/service.h"

namespace ls::cli {

struct CompareOptions {
  std::vector<std::string> scenes;
  std::vector<std::string> integrators;  // empty: the scene's
  std::vector<race::Adapter> programs;
  race::Conditions conditions;    // but for the size
  std::optional<FrameSize> size;  // empty: the scene's
  std::size_t seeds = 5;
  std::uint64_t first_seed = 0;
  std::vector<std::filesystem::path> reference;  // one or two, of a single scene
  std::filesystem::path references;              // a folder with those of many; may be empty
  std::map<std::string, std::string> defines;
  std::filesystem::path report;
  bool strict = false, quiet = false;
};

// What a scene is called in tables and names of files: its file's name, or its folder's if that says nothing.
std::vector<std::string> scene_names(const std::vector<std::string>& files);

// The pictures for a scene of this name in a folder: NAME.0.exr and NAME.1.exr, or NAME.exr; empty: none.
std::vector<std::filesystem::path> references_in(const std::filesystem::path& folder,
                                                 const std::string& name);

tl::expected<race::Race, coordinator::Rejected> race_scene(const CompareOptions& options,
                                                           const std::string& file, const std::string& name,
                                                           const std::atomic<bool>& stop);

}  // namespace ls::cli
