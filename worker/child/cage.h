// A renderer reads scenes of strangers: should one take it over, this is what it still can do. The kernel
// holds the process, and all it starts, to it for good.
#pragma once

#include <filesystem>
#include <vector>

namespace ls::worker::child {

struct Caged {
  // No socket is opened; no other process is traced, signalled or given limits; no namespace, module, ring or
  // memory that outlives the process is made (seccomp).
  bool calls = false;
  // Nothing is written; read is what is said below, and the system's libraries (Landlock).
  bool files = false;
  bool sizes = false;  // nor is a file cut short that may be read (Landlock of Linux 6.2)
};

// `readable`: folders of which all may be read. What the kernel cannot do is left out, and said in the
// result. Single-threaded callers only: threads that exist already stay free.
Caged shut_in(const std::vector<std::filesystem::path>& readable);

}  // namespace ls::worker::child
