// `lightshaft validate`: starts lightshaft-validate, which tests the renderer.
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cli/commands/commands.h"
#include "cli/output/console.h"
#include "core/base/spawn.h"
#include "validation/options.h"

namespace ls::cli {

void add_validate(CLI::App& app, Action& action) {
  const auto options = std::make_shared<cases::Options>();
  CLI::App* validate = app.add_subcommand("validate", cases::kHelp);
  cases::add_options(*validate, *options);
  validate->callback([validate, options, &action] {
    action = [validate] {
      return become(program_beside_us("lightshaft-validate"), given_options(*validate));
    };
  });
}

}  // namespace ls::cli
