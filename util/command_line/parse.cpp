#include "util/command_line/parse.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string_view>
#include <vector>

#include "core/base/text/suggest.h"
#include "util/command_line/command.h"

namespace ls {
namespace {

constexpr int kUsage = 2;

CommandOption described(const CLI::Option& option, const CLI::App* app) {
  // describe_command() describes all options of a command in their order.
  std::size_t at = 0;
  for (const CLI::Option* each : app->get_options()) {
    if (each->get_group().empty()) continue;
    if (each == &option) return describe_command(*app).options.at(at);
    ++at;
  }
  return {};
}

class PlainHelp : public CLI::Formatter {
 public:
  // CLI11 asks for the parts of an option one by one, without its command: make_help() notes the command.
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    app_ = app;
    return CLI::Formatter::make_help(app, std::move(name), mode);
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    const CommandOption plain = described(*option, app_);
    return plain.value.empty() || plain.names.empty() ? "" : " " + plain.value;
  }
  std::string make_option_name(const CLI::Option* option, bool positional) const override {
    return positional ? described(*option, app_).value : CLI::Formatter::make_option_name(option, false);
  }
  std::string make_option_usage(const CLI::Option* option) const override {
    std::string usage = CLI::Formatter::make_option_usage(option);
    // CLI11 adds dots to the name of a value that may be repeated, and the name may have them already.
    if (const std::size_t dots = usage.find("......"); dots != usage.npos) usage.erase(dots, 3);
    return usage;
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    return sentence_of(described(*option, app_));
  }

 private:
  mutable const CLI::App* app_ = nullptr;
};

const CLI::App& innermost(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().back();
  return *command;
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CommandOption& option : describe_command(command).options)
    std::ranges::copy_if(option.names, std::back_inserter(names),
                         [](const std::string& name) { return name.starts_with("--"); });
  return names;
}

std::vector<std::string> command_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const Command& each : describe_command(command).commands) names.push_back(each.name);
  return names;
}

// The nearest name by its letters, or the only one that begins with what was given
std::string hint(const std::string& given, const std::vector<std::string>& known) {
  if (const auto near = nearest_name(given, known)) return fmt::format("; did you mean '{}'?", *near);
  std::vector<std::string> longer;
  std::ranges::copy_if(known, std::back_inserter(longer),
                       [&](const std::string& name) { return name.starts_with(given); });
  return longer.size() == 1 ? fmt::format("; did you mean '{}'?", longer.front()) : "";
}

std::string path_of(const CLI::App& command) {
  const std::string above = command.get_parent() ? path_of(*command.get_parent()) + " " : "";
  return above + command.get_name();
}

constexpr std::string_view kEmptyValue = "the value is empty; leave the option out for the default";

}  // namespace

void use_plain_help(CLI::App& app) { app.formatter(std::make_shared<PlainHelp>()); }

std::string unknown_argument(const CLI::App& app, const CLI::ParseError& error) {
  const int code = error.get_exit_code();
  if (code != static_cast<int>(CLI::ExitCodes::RequiredError) &&
      code != static_cast<int>(CLI::ExitCodes::ExtrasError))
    return "";
  const std::vector<std::string> left = app.remaining(true);
  if (left.empty()) return "";
  const CLI::App& command = innermost(app);
  const std::string path = path_of(command);
  const auto option = std::ranges::find_if(left, [](const std::string& one) { return one.starts_with('-'); });
  if (option != left.end()) {
    const std::string name = option->substr(0, option->find('='));
    return fmt::format("{} has no option {}{}", path, name, hint(name, option_names(command)));
  }
  const std::vector<std::string> commands = command_names(command);
  if (commands.empty()) return fmt::format("{} takes no argument '{}'", path, left.front());
  return fmt::format("{} has no command '{}'{}", path, left.front(), hint(left.front(), commands));
}

void refuse_empty_values(CLI::App& app) {
  const CLI::Validator not_empty(
      [](const std::string& value) { return value.empty() ? std::string(kEmptyValue) : std::string(); }, "");
  for (CLI::Option* option : app.get_options())
    if (option->nonpositional() && option->get_items_expected_max() > 0) option->check(not_empty);
  for (CLI::App* command : app.get_subcommands({})) refuse_empty_values(*command);
}

std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv) {
  // CLI11 gives an option that ends with "=" the next argument as its value.
  const auto empty = std::find_if(argv + 1, argv + argc, [](const std::string_view argument) {
    return argument.starts_with("--") && argument.find('=') == argument.size() - 1;
  });
  if (argc > 1 && empty != argv + argc) {
    fmt::print(stderr, "{}: error: {}: {}\n", app.get_name(),
               std::string_view(*empty).substr(0, std::string_view(*empty).size() - 1), kEmptyValue);
    return kUsage;
  }
  refuse_empty_values(app);
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    const std::string unknown = unknown_argument(app, error);
    if (unknown.empty()) return app.exit(error) == 0 ? 0 : kUsage;
    fmt::print(stderr, "{}: error: {}\nSee {} --help.\n", app.get_name(), unknown, path_of(innermost(app)));
    return kUsage;
  }
}

}  // namespace ls
