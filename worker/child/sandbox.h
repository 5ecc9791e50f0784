// Sandbox of the render child (seccomp, Landlock): limits what a renderer compromised by a malicious scene
// can do. The kernel enforces it on the process and all its descendants, irrevocably.
#pragma once

#include <filesystem>
#include <vector>

namespace ls::worker::child {

struct Sandboxed {
  // True if the seccomp filter is in effect. It denies opening sockets, tracing other processes, sending them
  // signals or setting their limits, new namespaces, kernel modules, io_uring, and shared memory,
  // semaphores and message queues that outlive the process.
  bool calls = false;
  // True if Landlock is in effect. It denies writing all files except /dev/null, and reading all files except
  // those in the folders passed to enter_sandbox() and those that this program and the system's libraries
  // need.
  bool files = false;
  // True if the process also cannot truncate files that it may read (needs the Landlock of Linux 6.2)
  bool sizes = false;
};

// Restricts this process from now on. The process may read everything in the folders `readable`. Restrictions
// that the kernel does not support are skipped; the result lists those in effect. Call it while the process
// has only one thread: any other existing thread would stay unrestricted.
Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable);

}  // namespace ls::worker::child
