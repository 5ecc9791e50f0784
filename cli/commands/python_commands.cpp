// Some commands are written in Python (python/src/lightshaft_command). This program finds them and becomes
// the Python that runs them.
#include <fmt/format.h>
#include <signal.h>

#include <cstdlib>

#include "cli/commands/commands.h"
#include "cli/doctor/facts.h"
#include "cli/output/console.h"
#include "core/base/spawn.h"

namespace ls::cli {
namespace {

Error missing(std::string text) { return {Errc::failed_precondition, std::move(text)}; }

// Adds a command with the options that both up and join have.
CLI::App& add(CLI::App& app, Action& action, const char* name, const char* help) {
  CLI::App* command = app.add_subcommand(name, help);
  pass_option(*command, "--data", "DIR",
              "folder for everything that is stored; default: lightshaft in $XDG_DATA_HOME, or "
              "~/.local/share/lightshaft");
  pass_option(*command, "--threads", "N", "number of units to render at once; default: one for each core");
  command->callback([=, &action] { action = [=] { return run_in_python(name, given_options(*command)); }; });
  return *command;
}

}  // namespace

int run_in_python(const char* command, const std::vector<std::string>& arguments) {
  const PythonFacts python = find_python();
  if (python.interpreter.empty())
    return print_error(missing(
        fmt::format("`lightshaft {}` needs Python 3.11 or later, and there is no python3 in PATH", command)));
  if (python.part.empty())
    return print_error(
        missing(fmt::format("`lightshaft {}` needs lightshaft_command, which is missing beside this program: "
                            "install Lightshaft again",
                            command)));
  ::setenv("LIGHTSHAFT_PROGRAMS", program_beside_us("").c_str(), 1);
  ::signal(SIGPIPE, SIG_DFL);
  // Python starts without the means to answer signals. It unblocks them when it has these (__main__.py).
  sigset_t ends;
  ::sigemptyset(&ends);
  ::sigaddset(&ends, SIGINT);
  ::sigaddset(&ends, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  // The standard library is enough, so PYTHONPATH and the user's packages have no part in this. The Python of
  // a wheel starts as it was set up.
  const char* of_wheel = std::getenv("LIGHTSHAFT_PYTHON");
  std::vector<std::string> words;
  if (!of_wheel || !*of_wheel) words = {"-E", "-s"};
  words.insert(words.end(), {"-B", python.part.string(), command});
  words.insert(words.end(), arguments.begin(), arguments.end());
  return become(python.interpreter, words);
}

void add_python_commands(CLI::App& app, Action& action) {
  CLI::App& up = add(app, action, "up", "run a farm on this machine, with its dashboard, until Ctrl-C");
  up.add_flag("--lan")->description("let other machines join over TLS; prints the command for that");
  pass_options(up, "--name", "HOST",
               "with --lan: another name or address by which others reach this machine; may be repeated");
  pass_option(up, "--port", "N",
              "port of the dashboard and of HTTP; default: 8080, or another one if that is taken");
  up.add_flag("--no-browser")->description("do not open the dashboard");
  pass_option(up, "--first-scene", "FILE",
              "scene of the first picture; default: the one that comes with Lightshaft");
  CLI::App& join = add(app, action, "join", "render for the farm of another machine, until Ctrl-C");
  pass_option(join, "host", "HOST", "the machine on which `lightshaft up --lan` runs")->required();
  pass_option(join, "--code", "CODE",
              "the code that `lightshaft up --lan` printed; without this option `join` asks for it");
}

}  // namespace ls::cli
