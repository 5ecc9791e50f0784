#include "util/command_line/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>

namespace ls {
namespace {

// Calls `visit` for the program and for each of its commands, at any depth. `path` is the program's name and
// the names of the commands down to this one, such as "lightshaft token add".
using Visit = std::function<void(const std::string& path, const Command& command)>;
void walk(const std::string& path, const Command& command, const Visit& visit) {
  visit(path, command);
  for (const Command& each : command.commands) walk(path + " " + each.name, each, visit);
}

std::string in_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// Returns the name of the shell function that completes the command with this path.
std::string function_of(const std::string& path) {
  std::string name = "_";
  for (const char c : path) name += c == ' ' || c == '-' ? '_' : c;
  return name;
}

std::string bash_words(const Command& command) {
  std::vector<std::string> words;
  for (const Command& each : command.commands) words.push_back(each.name);
  for (const CommandOption& option : command.options) {
    if (option.names.empty()) words.insert(words.end(), option.choices.begin(), option.choices.end());
    words.insert(words.end(), option.names.begin(), option.names.end());
  }
  return fmt::format("{}", fmt::join(words, " "));
}

bool takes_files(const Command& command) {
  for (const CommandOption& option : command.options)
    if (option.names.empty() && option.takes_file()) return true;
  return false;
}

constexpr const char* kBashEnd = R"(  if ((files)) && [[ $current != -* ]]; then
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  fi
}}
complete -F {0} {1}
)";

constexpr const char* kBashBegin = R"(# bash completion of {1}, written by `{1} completion bash`
{0}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}}
  local place={1} words="" files=0 i
  COMPREPLY=()
  # bash takes the = of --option=value for a word.
  if [[ $current == = ]]; then
    current=""
  elif [[ $previous == = ]]; then
    previous=${{COMP_WORDS[COMP_CWORD-2]}}
  fi
  for ((i = 1; i < COMP_CWORD; i++)); do
    case "$place ${{COMP_WORDS[i]}}" in
)";

}  // namespace

std::string bash_completion(const Command& program) {
  const std::string function = function_of(program.name);
  std::string script = fmt::format(fmt::runtime(kBashBegin), function, program.name);
  std::string values, places;
  walk(program.name, program, [&](const std::string& path, const Command& command) {
    if (&command != &program) script += fmt::format("      \"{0}\") place=\"{0}\" ;;\n", path);
    places += fmt::format("    \"{}\") words=\"{}\" files={} ;;\n", path, bash_words(command),
                          takes_files(command) ? 1 : 0);
    for (const CommandOption& option : command.options) {
      if (option.names.empty() || option.value.empty()) continue;
      std::vector<std::string> patterns;
      for (const auto& name : option.names) patterns.push_back(fmt::format("\"{} {}\"", path, name));
      std::string action = "return";
      if (!option.choices.empty()) {
        action = fmt::format("words=\"{}\"", fmt::join(option.choices, " "));
      } else if (option.takes_file()) {
        action = "files=1";
      }
      values += fmt::format("    {}) {} ;;\n", fmt::join(patterns, "|"), action);
    }
  });
  script += "    esac\n  done\n  case \"$place $previous\" in\n" + values;
  script += "    *) case \"$place\" in\n" + places + "    esac ;;\n  esac\n";
  return script + fmt::format(fmt::runtime(kBashEnd), function, program.name);
}

namespace {

std::string with_backslashes(const std::string& text, std::string_view before) {
  std::string out;
  for (const char c : text) {
    if (before.find(c) != before.npos) out += '\\';
    out += c;
  }
  return out;
}

// Escapes the characters that separate the parts of a specification for zsh's _arguments: brackets, colons
// and the backslash.
std::string zsh_text(const std::string& text) { return with_backslashes(text, "[]:\\"); }

std::string zsh_value(const CommandOption& option) {
  const std::string action = !option.choices.empty() ? fmt::format("({})", fmt::join(option.choices, " "))
                             : option.takes_file()   ? "_files"
                                                     : "";
  return fmt::format(":{}:{}", zsh_text(option.value), action);
}

std::string zsh_options(const Command& command) {
  std::string lines;
  int position = 0;
  for (const CommandOption& option : command.options) {
    if (option.names.empty())
      lines += " \\\n    " + in_quotes((option.repeated ? "*" : fmt::format("{}", ++position)) +
                                       (option.required ? "" : ":") + zsh_value(option));
    for (const auto& name : option.names) {
      const char* joint = option.value.empty() ? "" : name.starts_with("--") ? "=" : "+";
      lines += " \\\n    " + in_quotes(fmt::format("{}{}[{}]{}", name, joint, zsh_text(option.help),
                                                   option.value.empty() ? "" : zsh_value(option)));
    }
  }
  return lines;
}

std::string zsh_function(const std::string& path, const Command& command) {
  const std::string function = function_of(path), options = zsh_options(command);
  if (command.commands.empty()) return fmt::format("{}() {{\n  _arguments -s{}\n}}\n", function, options);
  std::string names, calls;
  for (const Command& each : command.commands) {
    names += "\n    " + in_quotes(each.name + ":" + each.help);
    calls += fmt::format("      {}) {} ;;\n", each.name, function_of(path + " " + each.name));
  }
  return fmt::format(
      "{0}_commands() {{\n  local -a all=({2})\n  _describe command all\n}}\n"
      "{0}() {{\n  local context state state_descr line\n  typeset -A opt_args\n"
      "  _arguments -C{1} \\\n    '1:command:{0}_commands' '*::argument:->argument'\n"
      "  if [[ $state == argument ]]; then\n    case $words[1] in\n{3}    esac\n  fi\n}}\n",
      function, options, names, calls);
}

}  // namespace

std::string zsh_completion(const Command& program) {
  std::string script = fmt::format("#compdef {0}\n# written by `{0} completion zsh`\n", program.name);
  walk(program.name, program,
       [&](const std::string& path, const Command& command) { script += zsh_function(path, command); });
  // There are two ways in which zsh reads this file. If zsh autoloads it, the whole file is the body of the
  // function, so it must call the function that it has just defined. If it is sourced, it registers the
  // function for completion.
  return script +
         fmt::format("if [[ $funcstack[1] == {0} ]]; then\n  {0} \"$@\"\nelse\n  compdef {0} {1}\nfi\n",
                     function_of(program.name), program.name);
}

namespace {

// Returns the condition under which fish offers the options of a command.
std::string fish_condition(const std::string& path, const Command& command) {
  std::vector<std::string> seen, unseen;
  for (std::size_t at = path.find(' '); at != std::string::npos;) {
    const std::size_t end = path.find(' ', at + 1);
    seen.push_back("__fish_seen_subcommand_from " + path.substr(at + 1, end - at - 1));
    at = end;
  }
  if (seen.empty()) return "__fish_use_subcommand";
  for (const Command& each : command.commands) unseen.push_back(each.name);
  if (!unseen.empty())
    seen.push_back(fmt::format("not __fish_seen_subcommand_from {}", fmt::join(unseen, " ")));
  return fmt::format("{}", fmt::join(seen, "; and "));
}

std::string fish_text(const std::string& text) { return "'" + with_backslashes(text, "'\\") + "'"; }

}  // namespace

std::string fish_completion(const Command& program) {
  std::string script = fmt::format("# written by `{0} completion fish`\ncomplete -c {0} -f\n", program.name);
  walk(program.name, program, [&](const std::string& path, const Command& command) {
    const std::string start =
        fmt::format("complete -c {} -n {}", program.name, fish_text(fish_condition(path, command)));
    for (const Command& each : command.commands)
      script += fmt::format("{} -a {} -d {}\n", start, each.name, fish_text(each.help));
    for (const CommandOption& option : command.options) {
      std::string line = start;
      for (const auto& name : option.names)
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      if (!option.choices.empty())
        line += fmt::format(" -a {}", fish_text(fmt::format("{}", fmt::join(option.choices, " "))));
      if (option.takes_file()) line += " -F";
      if (!option.names.empty() && !option.value.empty()) line += option.takes_file() ? " -r" : " -x";
      const bool nothing = option.names.empty() && option.choices.empty() && !option.takes_file();
      if (!nothing) script += line + (option.names.empty() ? "" : " -d " + fish_text(option.help)) + "\n";
    }
  });
  return script;
}

}  // namespace ls
