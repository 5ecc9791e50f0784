// A scene on this machine's disk: read, checked, with every file that it names.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/scene/read.h"
#include "coordinator/service.h"

namespace ls::cli {

struct LocalFile {
  std::filesystem::path path;
  Digest digest;
  std::uint64_t bytes = 0;
};

struct LocalScene {
  std::string name;  // as the user gave it; in every diagnostic
  std::string text;
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::map<std::string, LocalFile> files;  // by the name in the scene: assets and included scene files
};

// File names are relative to the scene's folder. `strict`: warnings are errors.
tl::expected<LocalScene, coordinator::Rejected> read_local_scene(
    const std::string& path, const std::map<std::string, std::string>& defines, bool strict);

coordinator::SubmitRequest submit_request(const LocalScene& scene, const JobSpec& spec);

}  // namespace ls::cli
