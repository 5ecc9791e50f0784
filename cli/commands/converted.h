// A scene's canonical XML, with the files that must be copied for it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/local/local_scene.h"

namespace ls::cli {

struct FileCopy {
  std::string name_before;  // the name in the original scene
  std::filesystem::path from, to;
  Digest digest;
  bool renamed = false;
};

struct Converted {
  std::string text;
  Digest digest;                 // of the scene that the text describes
  std::vector<FileCopy> copies;  // files that are not in place yet, and must be copied
};

// Converts a scene for the file `out`. If `out` is in the folder of the original scene, file names are
// unchanged and nothing is copied. If it is in another folder, files keep their names relative to it; files
// whose name is absolute or leads out by ".." are put directly into that folder. The text is read back and
// compared. internal: the text does not give the same scene; already_exists: the folder has another file of a
// name that is needed.
Result<Converted> convert_scene(const LocalScene& scene, const std::filesystem::path& out);

// Copies a file to its place beside the converted scene, completely or not at all; creates missing folders.
Result<void> copy_beside(const FileCopy& copy);

}  // namespace ls::cli
