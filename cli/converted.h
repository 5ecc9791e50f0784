// A scene's canonical XML, and what has to be copied so that it finds its files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/local_scene.h"

namespace ls::cli {

struct FileCopy {
  std::string name_before;  // in the scene that was read
  std::filesystem::path from, to;
  Digest digest;
  bool renamed = false;
};

struct Converted {
  std::string text;
  Digest digest;                 // of the scene that the text gives
  std::vector<FileCopy> copies;  // of files that are not there yet
};

// For a file `out`. In the folder of the original every name stays as it is and nothing is copied. In another
// folder files keep their names relative to it; those whose name is absolute or leads out by ".." come into
// the folder itself. The text has been read back and compared: `internal` if it is not the same scene.
// already_exists: in the folder is another file of such a name.
Result<Converted> convert_scene(const LocalScene& scene, const std::filesystem::path& out);

// Whole or not at all; makes folders that are missing.
Result<void> copy_beside(const FileCopy& copy);

}  // namespace ls::cli
