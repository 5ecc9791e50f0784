// Sandbox of the render child (seccomp, Landlock): limits what a renderer compromised by a malicious scene
// can do. The kernel enforces it on the process and all its descendants, irrevocably.
#pragma once

#include <filesystem>
#include <vector>

namespace ls::worker::child {

struct Sandboxed {
  // True if the process can use no sockets; no tracing, signals or limits of other processes; no new
  // namespaces, kernel modules, io_uring, or memory that outlives the process (seccomp).
  bool calls = false;
  // True if the process can write no files, and read only the given folders and the system's libraries
  // (Landlock).
  bool files = false;
  // True if the process also cannot truncate files that it may read (needs the Landlock of Linux 6.2)
  bool sizes = false;
};

// Restricts this process from now on. `readable` lists the folders in which it may read everything.
// Restrictions that the kernel does not support are skipped; the result says which ones are in effect. Call
// it while the process has one thread: other existing threads would stay unrestricted.
Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable);

}  // namespace ls::worker::child
