// The arguments and results of readers of scene files. Programs that read scenes through another process
// (util/reading/scene_process.h) use these types without the readers (formats/read.h).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/scene/diagnostic.h"
#include "core/scene/scene.h"

namespace ls {

// Provides the files that a scene names. Implementations: a folder on disk (the command line), and the assets
// of an upload (the coordinator, which never opens a path written in a scene).
class AssetSource {
 public:
  virtual ~AssetSource() = default;
  // Returns digest and size of the file that the scene calls `name`.
  virtual Result<Asset> find(std::string_view name) = 0;
  // Returns the text of a scene file that another scene file includes. The size of the text is limited.
  virtual Result<std::string> text(std::string_view name) = 0;
  // Stores a mesh or grid file that read_scene() itself has made from numbers in the scene's text. From then
  // on find() finds it under this name. A source that does not store such files relies on the program that
  // uploads the scene to upload them under the same names.
  virtual Result<Asset> keep(std::string_view name, const std::string& bytes);
  // True if keep() stores files. If false, read_scene() need not make such files, since the program that
  // uploads the scene makes and uploads them.
  virtual bool keeps() const { return false; }
};

struct ReadOptions {
  std::map<std::string, std::string> defines;  // values of parameters $name; unused ones cause warnings
  bool strict = false;                         // true: warnings are errors
  // The frame number, for sequences (jobs with several frames): it replaces each run of # in file names and
  // is the value of $frame.
  std::optional<std::uint32_t> frame = std::nullopt;
  bool labels = false;  // true: fill Scene::shape_labels and instance_labels
};

struct ReadResult {
  std::optional<Scene> scene;  // nullopt if there are errors
  std::vector<Diagnostic> diagnostics;
};

// Reads the scene text `text` of the file `file_name`. The error says why no reader could be run; what is
// wrong with the scene is among the result's diagnostics.
using SceneReader = std::function<Result<ReadResult>(std::string_view file_name, std::string_view text,
                                                     AssetSource& assets, const ReadOptions& options)>;
// Returns a reader for the scenes of one submission.
using OpenReader = std::function<SceneReader()>;

}  // namespace ls
