// `lightshaft completion bash | zsh | fish`: prints the script by which a shell completes this command.
#include <fmt/format.h>

#include "cli/commands/commands.h"
#include "cli/output/console.h"
#include "common/command_line/command.h"

namespace ls::cli {

void add_completion(CLI::App& app, Action& action) {
  auto shell = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("completion", "prints the script by which a shell completes commands and options");
  command->add_option("shell", *shell, "the shell")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->callback([shell, &app, &action] {
    action = [shell, &app] {
      const Command program = describe_command(app);
      fmt::print("{}", *shell == "bash"  ? bash_completion(program)
                       : *shell == "zsh" ? zsh_completion(program)
                                         : fish_completion(program));
      return kOk;
    };
  });
}

}  // namespace ls::cli
