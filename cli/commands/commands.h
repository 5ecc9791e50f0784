// The commands. Each function adds its command to the command line. If the user gives that command, parsing
// sets `action`, which main() then runs; its result is the exit code.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "worker/render/base/build_id.h"

namespace ls::cli {

using Action = std::function<int()>;

void add_render(CLI::App& app, Action& action);
void add_inspect(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);
void add_farm_commands(CLI::App& app,
                       // The commands jobs, show, watch, pause, resume, cancel, extend, fetch, focus,
                       // video, workers
                       Action& action);
void add_farm_up(CLI::App& app, Action& action);  // the command farm up
void add_tokens(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_validate(CLI::App& app, Action& action);
void add_verify(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_doctor(CLI::App& app, Action& action);
void add_completion(CLI::App& app, Action& action);

// returns "lightshaft 0.2.0, build ..."
inline std::string version_text() {
  return fmt::format("lightshaft {}, build {}", LIGHTSHAFT_VERSION, render::kBuildId);
}

}  // namespace ls::cli
