// `lightshaft token add | list | revoke`: manages the tokens that give access to a farm. Only for its
// administrator.
#include <fmt/format.h>

#include "cli/commands/commands.h"
#include "cli/farm/farm_api.h"
#include "cli/farm/farm_tables.h"
#include "cli/output/console.h"
#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

struct TokenFlags {
  FarmOptions farm;
  std::string role, user, id;
};
using RunToken = int (*)(FarmApi& api, const TokenFlags& flags);

int add_token(FarmApi& api, const TokenFlags& flags) {
  json body{{"role", flags.role}};
  if (!flags.user.empty()) body["user"] = flags.user;
  const auto made = api.post("/api/v1/tokens", body);
  if (!made) return print_rejected(made.error());
  print(flags.farm.json ? dump(*made) : text_field(*made, "token"));
  return kOk;
}

int list_tokens(FarmApi& api, const TokenFlags& flags) {
  const auto answer = api.get("/api/v1/tokens");
  if (!answer) return print_rejected(answer.error());
  print(flags.farm.json ? dump(*answer) : tokens_table(*answer));
  return kOk;
}

int revoke_token(FarmApi& api, const TokenFlags& flags) {
  if (flags.id.find_first_not_of("0123456789abcdef") != std::string::npos)
    return usage_error(fmt::format("'{}' is no token's id: `lightshaft token list` prints them", flags.id));
  const auto done = api.remove("/api/v1/tokens/" + flags.id);
  return done ? kOk : print_rejected(done.error());
}

CLI::App* add(CLI::App& parent, Action& action, const char* name, const char* help, RunToken run,
              const std::shared_ptr<TokenFlags>& flags) {
  CLI::App* command = parent.add_subcommand(name, help);
  flags->farm.add_to(*command);
  command->callback([flags, run, &action] {
    action = [flags, run] {
      auto api = FarmApi::open(flags->farm);
      return api ? run(*api, *flags) : print_error(api.error());
    };
  });
  return command;
}

}  // namespace

void add_tokens(CLI::App& app, Action& action) {
  CLI::App* token = app.add_subcommand("token", "who may use a farm: for its admin");
  token->require_subcommand(1);
  auto adding = std::make_shared<TokenFlags>();
  CLI::App* add_command =
      add(*token, action, "add", "makes a token and prints it; it is kept nowhere else", add_token, adding);
  add_command
      ->add_option("--role", adding->role,
                   "what it may do: submit (own jobs), read, join (a worker's) or admin")
      ->required()
      ->check(CLI::IsMember({"submit", "read", "join", "admin"}));
  add_command->add_option("--user", adding->user, "whose it is: owner of the jobs handed in with it")
      ->type_name("NAME");
  add(*token, action, "list", "the tokens, without their secrets", list_tokens,
      std::make_shared<TokenFlags>());
  auto revoking = std::make_shared<TokenFlags>();
  add(*token, action, "revoke", "makes a token worthless, at once", revoke_token, revoking)
      ->add_option("id", revoking->id, "its id, as `list` prints it")
      ->required()
      ->type_name("ID");
}

}  // namespace ls::cli
