// The commands. Each function adds its command to the command line, and sets `action` if the user gives that
// command; main() runs the action and returns its exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace ls::cli {

using Action = std::function<int()>;

void add_render(CLI::App& app, Action& action);
void add_inspect(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);
void add_farm_commands(CLI::App& app,
                       Action& action);  // jobs, show, watch, pause, resume, cancel, extend, fetch, workers
void add_tokens(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_validate(CLI::App& app, Action& action);
void add_verify(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);

// "lightshaft 0.2.0, build ..."
std::string version_text();

}  // namespace ls::cli
