// Files that another program still writes, for which a command waits.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/frame_range.h"

namespace ls::cli {

struct FileState {
  std::uint64_t bytes = 0;
  std::int64_t changed_ns = 0;  // time of the last modification
  bool operator==(const FileState&) const = default;
};

// The size and time of a file; nothing if it is not there or cannot be looked at.
std::optional<FileState> file_state(const std::string& path);

// A file is complete once it has had content, and neither its size nor its time has changed, for
// kQuietSeconds. Times are those of any steady clock, in seconds.
class FilesToCome {
 public:
  static constexpr double kQuietSeconds = 5;

  // `patterns`: paths in which # stands for the frame number, as in numbered(), if there are `frames`.
  // Returns invalid_argument for a folder, and for a pattern without frames whose name has a run of #.
  static Result<FilesToCome> of(const std::vector<std::string>& patterns,
                                const std::optional<FrameRange>& frames);

  // Looks at all files, also at those that were complete before, as they may have grown since. Returns those
  // that are not complete, in order.
  std::vector<std::string> look(double now,
                                const std::function<std::optional<FileState>(const std::string&)>& state);

 private:
  struct Seen {
    FileState state;
    double since;
  };
  std::vector<std::string> files_;
  std::map<std::string, Seen> seen_;
};

// Returns once all these files are complete. Calls `waiting` with the files that are not, in order: whenever
// they change, and every kRepeatSeconds. Its error ends the wait.
inline constexpr double kRepeatSeconds = 20;
Result<void> wait_for_files(const std::vector<std::string>& patterns, const std::optional<FrameRange>& frames,
                            const std::function<Result<void>(const std::vector<std::string>&)>& waiting);
// "waits for a.vdb", or "waits for 3 files, the first is a.vdb".
std::string waits_for(const std::vector<std::string>& files);

}  // namespace ls::cli
