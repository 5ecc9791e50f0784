// The sandbox of a process that reads input from strangers (seccomp, Landlock, no capabilities): limits what
// it can do once a malicious scene or image has taken it over. The kernel enforces it on the process and all
// its descendants, irrevocably.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace ls {

struct Sandboxed {
  // True if the filter of system calls (call_filter.h) is in effect and the process has no capability (right
  // of root).
  bool calls = false;
  // True if Landlock is in effect. It denies writing all files except /dev/null, and reading all files except
  // those that were passed to enter_sandbox() and those that this program and the system's libraries need.
  bool files = false;
};

// Restricts this process from now on. The process may read the files `readable`, and everything in those of
// them that are folders, as far as its user may without capabilities. Restrictions that the kernel does not
// support are skipped; the result lists those in effect. Call it while the process has only one thread: any
// other existing thread would stay unrestricted. Builds with sanitizers have no sandbox.
//
// `program`: it may also run this program, besides those of the system.
Sandboxed enter_sandbox(const std::vector<std::filesystem::path>& readable,
                        const std::filesystem::path& program = {});

// Shuts in a helper program that reads the input of a stranger and ends. Besides entering the sandbox, with
// no file to read, it ends with the thread that has started it, leaves no core file, may take `memory_bytes`
// of memory (builds with sanitizers: any), and can start no thread, process or program. Writes to standard
// error which restriction the kernel does not support.
void shut_in_helper(std::uint64_t memory_bytes);

struct ShutInProgram {
  std::vector<std::string> arguments;           // all of argv; the first is the program's absolute path
  std::vector<std::filesystem::path> readable;  // folders that it may read
  unsigned seconds = 0;                         // it is killed after this time
  std::uint64_t memory_bytes = 0;
  std::uint64_t file_bytes = 0;  // largest size of a file that it writes, which it must have inherited
};
// Shuts in this process as shut_in_helper() does, and then turns it into another program, which may start
// threads. Inherited descriptors stay open. Returns only if the program cannot be started: the reason, from
// errno.
int become_shut_in(ShutInProgram program);

}  // namespace ls
