#include "util/command_line/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>

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

// Sets an option's value name and choices from CLI11's type text, in which CLI11 joins the type name and the
// names of the checks by colons: "TEXT:{read,admin}".
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

std::string sentence_of(const CommandOption& option) {
  std::string text = option.help;
  if (!option.choices.empty()) text += fmt::format(" ({})", fmt::join(option.choices, ", "));
  if (!option.default_value.empty()) text += fmt::format(" (default: {})", option.default_value);
  return text.empty() ? option.value : text;
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

namespace {

// Escapes text for troff. In troff a backslash begins an escape, a plain hyphen prints as a dash, which
// cannot be copied into a shell, and a line that begins with a dot or an apostrophe is a request.
std::string escaped(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool first = i == 0 || text[i - 1] == '\n';
    if (first && (text[i] == '.' || text[i] == '\'')) out += "\\&";
    if (text[i] == '\\') {
      out += "\\e";
    } else if (text[i] == '-') {
      out += "\\-";
    } else {
      out += text[i];
    }
  }
  return out;
}

// Quotes text as one argument of a troff macro.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : escaped(text)) out += c == '"' ? std::string("\\(dq") : std::string(1, c);
  return out + "\"";
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

void add_options(std::string& page, const Command& command) {
  for (const CommandOption& option : command.options) {
    std::string names;
    for (const auto& name : option.names)
      names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", escaped(name));
    page += fmt::format(".TP\n{}{}{}\n{}\n", names, names.empty() || option.value.empty() ? "" : " ",
                        option.value.empty() ? "" : "\\fI" + escaped(option.value) + "\\fR",
                        escaped(sentence_of(option)));
  }
}

// Returns the usage line, such as "lightshaft show [OPTIONS] ID".
std::string usage(const std::string& path, const Command& command) {
  std::string text = path + " [OPTIONS]";
  for (const CommandOption& option : command.options)
    if (option.names.empty()) text += option.required ? " " + option.value : " [" + option.value + "]";
  return command.commands.empty() ? text : text + " COMMAND";
}

void add_commands(std::string& page, const std::string& path, const Command& parent) {
  for (const Command& command : parent.commands) {
    const std::string full = path + " " + command.name;
    page += fmt::format(".SS {}\n{}\n", quoted(usage(full, command)), escaped(command.help));
    if (!command.footer.empty()) page += fmt::format(".PP\n{}\n", escaped(command.footer));
    add_options(page, command);
    add_commands(page, full, command);
  }
}

}  // namespace

std::string man_page(const Command& program, const std::string& version, const std::string& date) {
  std::string page = fmt::format(".TH {} 1 {} {} {}\n", quoted(upper(program.name)), date,
                                 quoted("Lightshaft " + version), quoted("Lightshaft"));
  std::string summary = program.help;
  if (summary.ends_with('.')) summary.pop_back();
  page += fmt::format(".SH NAME\n{} \\- {}\n", escaped(program.name), escaped(summary));
  page += fmt::format(".SH SYNOPSIS\n{}\n", escaped(usage(program.name, program)));
  page += fmt::format(".SH DESCRIPTION\n{}\n", escaped(program.help));
  if (!program.footer.empty()) page += fmt::format(".PP\n{}\n", escaped(program.footer));
  page += ".SH OPTIONS\n";
  add_options(page, program);
  if (!program.commands.empty()) page += ".SH COMMANDS\n";
  add_commands(page, program.name, program);
  page += ".SH EXIT STATUS\n0 success, 1 failure, 2 bad usage or bad input";
  return page;
}

}  // namespace ls
