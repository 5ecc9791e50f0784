// The program `lightshaft`: renders, inspects and merges on this machine, and is a client of a farm's
// coordinator. Exit codes: 0 success, 1 failure, 2 bad usage or bad scene.
#include <fmt/format.h>
#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "cli/commands/commands.h"
#include "cli/doctor/facts.h"
#include "cli/local/local_farm.h"
#include "cli/output/console.h"
#include "core/base/log.h"
#include "util/command_line/command.h"
#include "util/command_line/parse.h"

namespace {

using namespace ls::cli;

// Sets the log level of the coordinator and the worker in this process from the environment variable
// LIGHTSHAFT_LOG. Without the variable they log nothing, since commands report everything relevant
// themselves.
void set_log_level() {
  const char* level = std::getenv("LIGHTSHAFT_LOG");
  const std::string_view wanted = level ? level : "off";
  ls::log_level(wanted == "debug"  ? ls::LogLevel::debug
                : wanted == "info" ? ls::LogLevel::info
                : wanted == "warn" ? ls::LogLevel::warn
                                   : ls::LogLevel::off);
}

// `lightshaft completion bash | zsh | fish`: prints the script by which a shell completes this command.
void add_completion(CLI::App& app, Action& action) {
  auto shell = std::make_shared<std::string>();
  app.add_subcommand("completion", "print a script that lets a shell complete commands and options")
      ->callback([shell, &app, &action] {
        action = [shell, &app] {
          const ls::Command program = ls::describe_command(app);
          fmt::print("{}", *shell == "bash"  ? ls::bash_completion(program)
                           : *shell == "zsh" ? ls::zsh_completion(program)
                                             : ls::fish_completion(program));
          return kOk;
        };
      })
      ->add_option("shell", *shell, "the shell")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string_view(argv[1]) == kRenderChildFlag) return run_render_child(argv[2]);
  if (argc == 2 && std::string_view(argv[1]) == kSandboxProbeFlag) return run_sandbox_probe();
  ::signal(SIGPIPE, SIG_IGN);
  set_log_level();
  CLI::App app("Renders light in smoke, steam, clouds and fire, on this machine or on a farm.", "lightshaft");
  app.set_version_flag("--version", version_text());
  app.require_subcommand(1);
  ls::use_plain_help(app);
  app.option_defaults()->always_capture_default(false);
  Action action;
  add_python_commands(app, action);
  add_render(app, action);
  add_inspect(app, action);
  add_convert(app, action);
  add_submit(app, action);
  add_farm_commands(app, action);
  add_farm_up(app, action);
  add_tokens(app, action);
  add_merge(app, action);
  add_validate(app, action);
  add_verify(app, action);
  add_compare(app, action);
  add_race(app, action);
  add_doctor(app, action);
  add_completion(app, action);
  ls::add_man_page_option(app, LIGHTSHAFT_VERSION);
  if (argc == 1) {
    fmt::print("{}", app.help());
    return kUsage;
  }
  if (const auto code = ls::parse_arguments(app, argc, argv)) return *code;
  return run_guarded(app.get_subcommands().front()->get_name(), action);
}
