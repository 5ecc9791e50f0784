// Reads scene text. Returns a Scene, or up to kMaxDiagnostics diagnostics, each with its place in the text.
#pragma once

#include <string_view>

#include "core/scene/reading.h"

namespace ls {

ReadResult read_scene(std::string_view file_name, std::string_view text, AssetSource& assets,
                      const ReadOptions& options = {});

// Returns a reader that reads in this process.
SceneReader scenes_in_this_process();

}  // namespace ls
