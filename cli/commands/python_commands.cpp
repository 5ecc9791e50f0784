// `lightshaft up` and `lightshaft join` are written in Python (python/src/lightshaft_command). This program
// finds them and becomes the Python that runs them.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "cli/commands/commands.h"
#include "cli/doctor/facts.h"
#include "cli/output/console.h"
#include "common/base/spawn.h"

namespace ls::cli {
namespace {

Error missing(std::string text) { return {Errc::failed_precondition, std::move(text)}; }

int run_in_python(const char* command, const std::vector<std::string>& arguments) {
  const PythonFacts python = find_python();
  if (python.interpreter.empty())
    return print_error(missing(
        fmt::format("`lightshaft {}` needs Python 3.11 or later, and there is no python3 in PATH", command)));
  if (python.part.empty())
    return print_error(missing(
        fmt::format("`lightshaft {}` is written in Python, and its part of this program is missing: there is "
                    "no lightshaft_command beside it; install Lightshaft again",
                    command)));
  std::vector<std::string> words = {python.interpreter.string(), "-B", python.part.string(), command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  ::setenv("LIGHTSHAFT_PROGRAMS", program_beside_us("").c_str(), 1);
  ::signal(SIGPIPE, SIG_DFL);
  ::execv(argv.front(), argv.data());
  return print_error(missing(fmt::format("cannot start {}: {}", argv.front(), std::strerror(errno))));
}

void add(CLI::App& app, Action& action, const char* name, const char* help) {
  CLI::App* command = app.add_subcommand(name, help);
  command->set_help_flag();  // Python knows the options
  command->prefix_command();
  command->callback([=, &action] {
    action = [name, arguments = command->remaining()] { return run_in_python(name, arguments); };
  });
}

}  // namespace

void add_python_commands(CLI::App& app, Action& action) {
  add(app, action, "up", "a farm on this machine, with its dashboard, until Ctrl-C");
  add(app, action, "join", "renders for the farm of another machine's `lightshaft up --lan`, until Ctrl-C");
}

}  // namespace ls::cli
