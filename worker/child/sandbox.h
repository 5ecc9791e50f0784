// Sandbox of the render child (seccomp, Landlock): limits what a renderer compromised by a malicious scene
// can do. The kernel enforces it on the process and all its descendants, irrevocably.
#pragma once

#include <filesystem>
#include <vector>

namespace ls::worker::child {

struct Sandboxed {
  // True if seccomp is in effect. It denies sockets; tracing, signalling and limiting other processes; new
  // namespaces, kernel modules, io_uring, and memory that outlives the process.
  bool calls = false;
  // True if Landlock is in effect. It denies writing files, and reading any but those in the given folders
  // and those that the system's libraries need.
  bool files = false;
  // True if the process also cannot truncate files that it may read (needs the Landlock of Linux 6.2)
  bool sizes = false;
};

// Restricts this process from now on. The process may read everything in the folders `readable`. Restrictions
// that the kernel does not support are skipped; the result lists those in effect. Call it while the process
// has one thread: other existing threads would stay unrestricted.
Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable);

}  // namespace ls::worker::child
