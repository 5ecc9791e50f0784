// A scene on this machine's disk: read, checked, with every file that it names.
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

#include "common/scene/nori_test.h"
#include "common/scene/read.h"
#include "coordinator/service.h"

namespace ls::cli {

struct LocalFile {
  std::filesystem::path path;
  Digest digest;
  std::uint64_t bytes = 0;
  bool is_text = false;  // an included scene file
};

struct LocalScene {
  std::string name;  // as the user gave it; in every diagnostic
  std::string text;
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::map<std::string, LocalFile> files;  // by the name in the scene: assets and included scene files
  std::optional<std::uint32_t> frame;      // that it was read as
  // Assets that a job makes use of, with an integrator that sees no media and with one that does: the others
  // need not travel.
  std::array<std::set<Digest>, 2> needed = {};
};

// Whether the job makes use of this file of the scene.
bool is_needed(const LocalScene& scene, const JobSpec& spec, const LocalFile& file);

// File names are relative to the scene's folder. `strict`: warnings are errors. `frame`: of a sequence.
// `labels`: with the names of things, which belong to the scene of a job that has mattes.
tl::expected<LocalScene, coordinator::Rejected> read_local_scene(
    const std::string& path, const std::map<std::string, std::string>& defines, bool strict,
    std::optional<std::uint32_t> frame = {}, bool labels = false);

// A scene that is read once per frame; its files are looked at once.
class SceneReader {
 public:
  static tl::expected<SceneReader, coordinator::Rejected> open(const std::string& path,
                                                               std::map<std::string, std::string> defines,
                                                               bool strict);
  SceneReader(SceneReader&&) noexcept;
  ~SceneReader();

  tl::expected<LocalScene, coordinator::Rejected> read(std::optional<std::uint32_t> frame,
                                                       bool labels = false);
  // All frames, or what is wrong with them: every file that is missing, up to 20. The scene is the first
  // frame's, the files are those of all frames, warnings are told once.
  tl::expected<LocalScene, coordinator::Rejected> read_all(const FrameRange& frames);

 private:
  struct Impl;
  explicit SceneReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// A file of tests, with every file that its scenes name.
struct LocalTest {
  NoriTest test;
  std::vector<Diagnostic> warnings;
  std::map<std::string, LocalFile> files;
};
tl::expected<LocalTest, coordinator::Rejected> read_local_test(const std::string& path, bool strict);

coordinator::SubmitRequest submit_request(const LocalScene& scene, const JobSpec& spec);

}  // namespace ls::cli
