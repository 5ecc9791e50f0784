// Sandbox of the render child (seccomp, Landlock): limits what a renderer compromised by a malicious scene
// can do. The kernel enforces it on the process and all its descendants, irrevocably.
#pragma once

#include <filesystem>
#include <vector>

namespace ls::worker::child {

struct Sandboxed {
  // No sockets; no tracing, signals or limits for other processes; no new namespaces, kernel modules,
  // io_uring, or memory that outlives the process (seccomp).
  bool calls = false;
  // No writing; reading only the folders given and the system's libraries (Landlock).
  bool files = false;
  bool sizes = false;  // and no truncating of files that may be read (needs the Landlock of Linux 6.2)
};

// Restricts this process from now on. `readable` lists the folders in which it may read everything.
// Restrictions that the kernel does not support are skipped; the result says which ones hold. Call it while
// the process has one thread, because other threads that exist already would stay unrestricted.
Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable);

}  // namespace ls::worker::child
