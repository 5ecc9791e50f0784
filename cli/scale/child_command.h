// Runs other programs, such as sbatch and ssh. Arguments are passed directly, without a shell. The programs
// inherit the environment except our own variables (LIGHTSHAFT_...), which may contain tokens.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::cli {

using Words = std::vector<std::string>;

struct CommandOutput {
  int code = 0;  // exit code, or 128 + number of the signal that ended the program
  std::string out, err;
};

// Runs a program to its end. unavailable: it did not end within `most_seconds`, and was killed;
// resource_exhausted: it printed more than 64 MiB, and was killed; not_found: there is no such program.
Result<CommandOutput> run_command(const Words& words, const std::string& input, double most_seconds);

// Returns the parts of a command's output between the characters `separator`: its lines, or a line's fields.
std::vector<std::string> split(const std::string& text, char separator);

// A program that runs in the background. Its output goes to a file.
class LongCommand {
 public:
  // Starts the program and writes `input` to its standard input, which stays open until close_input() or the
  // destructor. `log` is the file for its output.
  static Result<LongCommand> start(const Words& words, const std::string& input, const std::string& log);
  LongCommand(LongCommand&& other) noexcept;
  LongCommand& operator=(LongCommand&&) = delete;
  ~LongCommand();  // kills the program

  bool ended();  // true once the program has ended
  void close_input();
  void kill();

 private:
  LongCommand(pid_t pid, int input) : pid_(pid), input_(input) {}
  pid_t pid_;
  int input_;
};

}  // namespace ls::cli
