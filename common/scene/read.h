// Reads scene text: returns a Scene, or up to kMaxDiagnostics diagnostics, each with a place.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"
#include "common/scene/diagnostic.h"
#include "common/scene/scene.h"

namespace ls {

// Gives the reader access to the files that a scene names. Two implementations: a folder on disk (the command
// line), and the assets of an upload (the coordinator, which never opens a path written in a scene).
class AssetSource {
 public:
  virtual ~AssetSource() = default;
  // Returns digest and size of the file that the scene calls `name`.
  virtual Result<Asset> find(std::string_view name) = 0;
  // Returns the text of an included scene file, of limited size.
  virtual Result<std::string> text(std::string_view name) = 0;
};

struct ReadOptions {
  std::map<std::string, std::string> defines;  // $name -> value; unused ones cause a warning
  bool strict = false;                         // true: warnings are errors
  // The frame number, for sequences (jobs with several frames): it replaces each run of # in file names and
  // is the value of $frame.
  std::optional<std::uint32_t> frame = std::nullopt;
  bool labels = false;  // fill Scene::shape_labels and instance_labels
};

struct ReadResult {
  std::optional<Scene> scene;  // nullopt if there is any error
  std::vector<Diagnostic> diagnostics;
};

ReadResult read_scene(std::string_view file_name, std::string_view text, AssetSource& assets,
                      const ReadOptions& options = {});

}  // namespace ls
