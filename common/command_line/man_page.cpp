#include "common/command_line/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

namespace ls {
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

// Quotes text as one argument of a macro.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : escaped(text)) out += c == '"' ? std::string("\\(dq") : std::string(1, c);
  return out + "\"";
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

std::string sentence_of(const CommandOption& option) {
  std::string text = option.help;
  if (!option.choices.empty()) text += fmt::format(" ({})", fmt::join(option.choices, ", "));
  if (!option.default_value.empty()) text += fmt::format(" (default: {})", option.default_value);
  return text.empty() ? option.value : text;
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
