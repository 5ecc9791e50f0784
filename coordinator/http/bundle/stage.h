// Stages of USD as scenes of jobs. The Python package lightshaft turns a stage into a scene of this program
// with its files. It runs in a process in the sandbox of lightshaft-scene: stages come from strangers, and
// USD's libraries may have bugs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/http/bundle/bundle.h"
#include "core/base/frame_range.h"
#include "core/base/spawn.h"
#include "core/image/frame/frame.h"

namespace ls::http {

// The length of a file's beginning that is_stage() needs.
inline constexpr std::size_t kStageMagic = 8;

// True if a file is a stage: it begins as .usda and .usdc files do, or has the name of a stage and does not
// begin as XML does.
bool is_stage(std::string_view file_name, std::span<const std::byte> begin);
// True if the name ends as those of stages do.
bool is_stage_name(std::string_view file_name);

// The files of a stage, and the settings with which it is read.
struct Stage {
  std::string name;  // of the stage's file
  Digest main;
  std::map<std::string, Digest> files;  // the other files, by their paths from the stage's folder
  std::optional<FrameRange> frames;     // time codes that are read; none: its start
  std::optional<FrameSize> size;        // of the image, in pixels
};

// The scene that a stage has become: as an uploaded bundle. Stored in the blob store.
struct StageScene {
  Bundle bundle;
  std::vector<std::string> warnings;  // of the stage, each one line
};

// Thread-safe.
class StageReader {
 public:
  struct Options {
    std::filesystem::path python;  // an interpreter that has the package lightshaft with its extra usd
    std::filesystem::path folder;  // for the files of stages while they are read; nothing else may be in it
    std::filesystem::path sandbox = program_beside_us("lightshaft-scene");
    unsigned seconds = 300;                                // for one stage
    std::uint64_t memory_bytes = std::uint64_t{4} << 30;   // of the process
    std::uint64_t output_bytes = std::uint64_t{16} << 30;  // of the scene and the files that are made
  };
  // Starts the interpreter, to learn where its packages are and to try them in the sandbox, and empties the
  // folder. failed_precondition: it cannot be started or lacks a package; the message says which; or what it
  // must read contains the folder.
  static Result<std::unique_ptr<StageReader>> open(Options options);

  // Makes a scene of the stage. unavailable: a stage of this caller, or kAtOnce of others, are being read; it
  // does not wait, since it is called on a thread that serves other requests, too. invalid_argument: what is
  // wrong with the stage, in one line or several; or a file's name leads out of the stage's files.
  // resource_exhausted: there is no room on the disk. Other errors: those of the store.
  Result<StageScene> read(const Stage& stage, const std::string& caller, const BundleLimits& limits,
                          coordinator::BlobStore& blobs, const std::stop_token& stop);
  static constexpr std::size_t kAtOnce = 2;

 private:
  struct Reading;
  StageReader(Options options, std::vector<std::string> readable)
      : options_(std::move(options)), readable_(std::move(readable)) {}
  // Runs the interpreter in the sandbox, with `folder` to read, and `output` as kHelperFd to write.
  Result<HelperEnd> run(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                        int output, const std::stop_token& stop) const;

  const Options options_;
  const std::vector<std::string> readable_;  // folders of the interpreter and its packages
  std::mutex mutex_;
  std::set<std::string> callers_;  // whose stages are being read
};

}  // namespace ls::http
