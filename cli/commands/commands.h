// The commands. Each function adds its command to the command line. If the user gives that command, parsing
// the command line sets `action`. main() then runs `action` and exits with the exit code that it returns.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "worker/render/base/build_id.h"

namespace ls::cli {

using Action = std::function<int()>;

// Adds the command `name`. Its action calls `run` with a Flags object. Returns the command and the Flags
// object; both live as long as `app`. The caller adds the command's options, which store their values in the
// object.
template <class Flags>
std::pair<CLI::App*, Flags*> add_command(CLI::App& app, Action& action, const std::string& name,
                                         const std::string& help, int (*run)(const Flags& flags)) {
  auto flags = std::make_shared<Flags>();
  CLI::App* command = app.add_subcommand(name, help);
  command->callback([flags, run, &action] { action = [flags, run] { return run(*flags); }; });
  return {command, flags.get()};
}

void add_render(CLI::App& app, Action& action);
void add_inspect(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);
// Adds the commands for jobs, and `workers`.
void add_farm_commands(CLI::App& app, Action& action);
void add_farm_up(CLI::App& app, Action& action);
void add_tokens(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_validate(CLI::App& app, Action& action);
void add_verify(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
// Adds the commands race-lane and race-tool, which `compare` starts.
void add_race(CLI::App& app, Action& action);
void add_doctor(CLI::App& app, Action& action);
// Adds the commands up and join.
void add_python_commands(CLI::App& app, Action& action);
// Becomes another program with these arguments. Returns an exit code if that fails, of which a message was
// printed.
int become(const std::filesystem::path& program, std::vector<std::string> arguments);
// Becomes the Python that runs this command with these arguments; returns as become() does.
int run_in_python(const char* command, const std::vector<std::string>& arguments);
// Adds an option of which only the Python of the command reads the value, see given_options().
CLI::Option* pass_option(CLI::App& app, const char* name, const char* type, const char* help);
// The same for an option that may be given several times.
CLI::Option* pass_options(CLI::App& app, const char* name, const char* type, const char* help);
// Returns the options of a command that the user gave, each as "--name=value", and its other arguments.
std::vector<std::string> given_options(const CLI::App& app);

// Returns the version and the build, such as "lightshaft 0.2.0, build ...".
inline std::string version_text() {
  return fmt::format("lightshaft {}, build {}", LIGHTSHAFT_VERSION, render::kBuildId);
}

}  // namespace ls::cli
