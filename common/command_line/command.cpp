#include "common/command_line/command.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace ls {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    parts.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

// CLI11 joins an option's type name and the names of its checks with colons: "TEXT:{read,admin}".
void read_type(const std::string& type, CommandOption& option) {
  const std::size_t colon = type.find(':');
  option.value = type.substr(0, colon);
  const std::size_t open = type.find('{'), close = type.rfind('}');
  if (open != std::string::npos && close != std::string::npos && open < close)
    option.choices = split(type.substr(open + 1, close - open - 1), ',');
  else if (option.value.find('|') != std::string::npos)
    option.choices = split(option.value, '|');
  if (type.find(":SIZE") != std::string::npos)
    option.value = "BYTES";
  else if (option.value == "UINT" || option.value == "INT" || option.value == "FLOAT")
    option.value = "N";
  if (option.value.empty() || (option.value == "TEXT" && !option.choices.empty())) option.value = "WORD";
}

CommandOption describe_option(const CLI::Option& from) {
  CommandOption option;
  for (const auto& name : from.get_snames()) option.names.push_back("-" + name);
  for (const auto& name : from.get_lnames()) option.names.push_back("--" + name);
  option.help = from.get_description();
  option.default_value = from.get_default_str();
  option.required = from.get_required();
  option.repeated = from.get_items_expected_max() > 1;
  if (from.get_items_expected_max() > 0) read_type(from.get_type_name(), option);
  return option;
}

}  // namespace

bool CommandOption::takes_file() const {
  const std::string name = value.substr(0, value.find("..."));
  return name == "FILE" || name == "DIR" || name == "IN" || name == "OUT" || name == "SCENE" ||
         name.find('.') != std::string::npos;
}

Command describe_command(const CLI::App& app) {
  Command command{app.get_name(), app.get_description(), app.get_footer(), {}, {}};
  for (const CLI::Option* option : app.get_options())
    if (!option->get_group().empty()) command.options.push_back(describe_option(*option));
  const auto shown = [](const CLI::App* each) { return !each->get_group().empty(); };
  for (const CLI::App* each : app.get_subcommands(shown)) {
    command.commands.push_back(describe_command(*each));
    // CLI11 copies a command's footer to its subcommands; the copies are removed.
    if (command.commands.back().footer == command.footer) command.commands.back().footer.clear();
  }
  return command;
}

void add_man_page_option(CLI::App& app, const std::string& version) {
  // Ends the program in the same way as --version: the text of this exception is printed.
  const auto print = [&app, version](const std::string& date) {
    throw CLI::CallForVersion(man_page(describe_command(app), version, date), CLI::ExitCodes::Success);
  };
  app.add_option_function<std::string>("--man-page", print)->group("");
}

}  // namespace ls
