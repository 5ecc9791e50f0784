// A program's command line as plain data: its commands and options with their help. Completion scripts and
// manual pages are written from it, so that they list exactly what the program accepts.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace ls {

struct CommandOption {
  // all its names, such as "-o", "--output"; empty: a positional argument without a name
  std::vector<std::string> names;
  // Name of its value in the help, such as "FILE" or "N"; empty: the option takes no value
  std::string value;
  std::vector<std::string> choices;  // the allowed values; empty: any value is allowed
  std::string help;
  std::string default_value;  // empty: there is no default, or the help contains it
  bool required = false, repeated = false;

  bool takes_file() const;  // true if the value is the name of a file or a folder
};

struct Command {
  std::string name, help, footer;
  std::vector<CommandOption> options;
  std::vector<Command> commands;
};

// Returns the help of an option with its choices and its default.
std::string sentence_of(const CommandOption& option);

// Describes a program without its hidden commands and options.
Command describe_command(const CLI::App& app);

// Adds the hidden option --man-page DATE, with which the program prints its manual page and ends. Call it
// after all other options were added.
void add_man_page_option(CLI::App& app, const std::string& version);

// Each returns a script by which the shell completes the program's commands, options, values and file names.
std::string bash_completion(const Command& program);
std::string zsh_completion(const Command& program);
std::string fish_completion(const Command& program);

// Returns a manual page in troff with the macros of man(7): the page of section 1 for a program with all of
// its commands. `date` is the date that the page shows, as YYYY-MM-DD.
std::string man_page(const Command& program, const std::string& version, const std::string& date);

}  // namespace ls
