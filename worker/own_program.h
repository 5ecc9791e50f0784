// Starts the program of this process again, in the same process: with the same arguments, environment and
// working directory. The process id stays, so that a supervisor (systemd, Docker, Kubernetes) sees no end.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace ls::worker {

class OwnProgram {
 public:
  // Call it at the start of main(), while argv is as the system gave it.
  OwnProgram(int argc, char** argv);

  // Runs the program with --version and waits for its end. failed_precondition: it is gone, cannot be
  // executed, or fails; the text says which, and what to do.
  Result<void> check() const;
  // Replaces this process by a new run of the program and closes all files but standard input, output and
  // error. Signals that are blocked stay blocked, and those that wait go to the new run. Returns only if it
  // fails.
  Error restart() const;

  const std::filesystem::path& path() const { return path_; }

 private:
  // The path by which the program was started, if it can be found, so that restart() follows a symbolic link
  // to its new target; otherwise the file that runs
  std::filesystem::path path_;
  std::vector<std::string> arguments_;
};

}  // namespace ls::worker
