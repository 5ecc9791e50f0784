// A scene on this machine's disk: read and checked, with every file that it names.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "coordinator/service/coordinator.h"
#include "formats/folder_assets.h"
#include "formats/read.h"

namespace ls::cli {

struct LocalFile {
  std::filesystem::path path;
  Digest digest;
  std::uint64_t bytes = 0;
  bool is_text = false;  // true for an included scene file
  // True for a temporary file (a mesh, grid or image) that was made from data in the scene's text when the
  // scene was read. The file exists as long as LocalScene::made.
  bool is_made = false;
};

struct LocalScene {
  std::string name;  // as given by the user; used in every diagnostic
  std::string text;
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::map<std::string, LocalFile> files;  // assets and included scene files, by their names in the scene
  std::optional<std::uint32_t> frame;      // the frame for which the scene was read
  // The assets that a job uses: needed[0] with an integrator that ignores media, needed[1] with any other.
  // Assets that are not needed are not uploaded.
  std::array<std::set<Digest>, 2> needed = {};
  std::shared_ptr<const KeptFolder> made = {};
  std::string title = {};  // what lists call a job of it; empty: the name of its file
};

// True if the job uses this file of the scene.
bool is_needed(const LocalScene& scene, const JobSpec& spec, const LocalFile& file);

// Reads the scene at `path`, and the files that it names, relative to the scene's folder. `strict`: warnings
// are errors. `frame` is the frame number, for a sequence (a job that renders several frames). `labels`:
// include the names of shapes and materials, which are part of the scene if the job has Cryptomatte layers.
tl::expected<LocalScene, coordinator::Rejected> read_local_scene(
    const std::string& path, const std::map<std::string, std::string>& defines, bool strict,
    std::optional<std::uint32_t> frame = {}, bool labels = false);

// Reads a scene once per frame. The files that it names are hashed only once.
class SceneReader {
 public:
  static tl::expected<SceneReader, coordinator::Rejected> open(const std::string& path,
                                                               std::map<std::string, std::string> defines,
                                                               bool strict);
  SceneReader(SceneReader&&) noexcept;
  ~SceneReader();

  tl::expected<LocalScene, coordinator::Rejected> read(std::optional<std::uint32_t> frame,
                                                       bool labels = false);
  // Reads the scene for all frames. Returns the scene of the first frame, the files of all frames, and each
  // warning once. If a frame has errors, returns the errors of all frames (up to 20), so that, for example,
  // all missing files are reported.
  tl::expected<LocalScene, coordinator::Rejected> read_all(const FrameRange& frames);

 private:
  struct Impl;
  explicit SceneReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// Returns an error that the scene caused, with the message `text`, as a diagnostic of the scene as a whole:
// its place is the scene's name without a line.
coordinator::Rejected scene_fault(const std::string& scene, const std::string& text);

coordinator::SubmitRequest submit_request(const LocalScene& scene, const JobSpec& spec);

}  // namespace ls::cli
