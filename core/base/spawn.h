// Starts other programs. The caller lists the files and the environment variables that they inherit. The
// programs have no terminal: they do not receive its signals, such as Ctrl-C, and cannot type into it.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls {

inline constexpr int kDevNull = -1;

struct Program {
  std::string path;                    // looked up in PATH if it has no slash
  std::vector<std::string> arguments;  // all of argv, beginning with the program's name
  // files[i] becomes the program's descriptor i; the value kDevNull stands for /dev/null. No other descriptor
  // is inherited.
  std::vector<int> files;
  // Returns true if the program inherits the environment variable, given as NAME=VALUE.
  std::function<bool(std::string_view)> inherits;
  // True: the program gets a session and a process group of its own, with its process id. False: it shares
  // those of this process, which must lead a session without a terminal.
  bool own_session = true;
};

// Starts the program with no signal blocked or ignored, and returns its process id. Errors: not_found if
// there is no such program, else internal; the text names the program and the system's reason. A terminal
// among `files` is an error (internal): the program could type into it.
Result<pid_t> spawn(Program program);

// Waits until the process ends, and returns its wait status as waitpid() gives it.
int wait_for_end(pid_t pid);

// Like wait_for_end(), but returns at once: nullopt if the process still runs.
std::optional<int> poll_end(pid_t pid);

// Helper programs are installed beside this one. They read OpenVDB files or denoise images, with third-party
// libraries that may crash, hang or take too much memory. A helper shares memory with this program through
// one file, which it inherits as this descriptor.
inline constexpr int kHelperFd = 3;

// Returns the path of a program in the folder of the running executable.
std::filesystem::path program_beside_us(std::string_view name);

// An open file descriptor, closed by the destructor.
class Descriptor {
 public:
  explicit Descriptor(int opened) : fd(opened) {}
  ~Descriptor();
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  const int fd;
};

struct HelperEnd {
  int status = 0;         // as waitpid() gives it
  std::string last_line;  // the last line that the helper wrote, safe to show; empty: it wrote none
};

// Runs a helper program and waits for its end. The helper inherits one file, `shared` as kHelperFd; what it
// writes to standard output and standard error goes to our log (program_output.h). Of the environment it
// inherits only the variables that the loader, the allocator and the sanitizers read, so that it gets no
// secrets. If `stop` becomes true, the helper is killed. internal: the program could not be started.
Result<HelperEnd> run_helper(const std::filesystem::path& program, std::vector<std::string> arguments,
                             int shared, const std::atomic<bool>* stop = nullptr);

}  // namespace ls
