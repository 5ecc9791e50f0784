// Scene text -> Scene, or up to kMaxDiagnostics diagnostics, each with a place.
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

// How the reader reaches the files a scene names. Two real ones: a folder on disk (the command line), and the
// assets of an upload (the coordinator, which never opens a path that a scene wrote).
class AssetSource {
 public:
  virtual ~AssetSource() = default;
  // Digest and size of the file that the scene calls `name`.
  virtual Result<Asset> find(std::string_view name) = 0;
  // Text of an included scene file; bounded in size.
  virtual Result<std::string> text(std::string_view name) = 0;
};

struct ReadOptions {
  std::map<std::string, std::string> defines;  // $name -> value; one that nothing asks for is warned about
  bool strict = false;                         // warnings become errors
  // Of a sequence: a run of # in the name of a file stands for this number, and $frame is defined to be it.
  std::optional<std::uint32_t> frame = std::nullopt;
  bool labels = false;  // fill Scene::shape_labels and instance_labels
};

struct ReadResult {
  std::optional<Scene> scene;  // absent if there is any error
  std::vector<Diagnostic> diagnostics;
};

ReadResult read_scene(std::string_view file_name, std::string_view text, AssetSource& assets,
                      const ReadOptions& options = {});

}  // namespace ls
