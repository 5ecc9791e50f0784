// Parses a program's arguments, and says what is wrong with them.
#pragma once

#include <optional>
#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace ls {

// Makes the help show the values of options as manual pages do: "--kind WORD" with its choices in words. Call
// it before commands are added.
void use_plain_help(CLI::App& app);

// Returns a message on arguments that the program does not know, with the nearest known name: "render has no
// option --sp; did you mean '--spp'?". Empty: the error has another reason.
std::string unknown_argument(const CLI::App& app, const CLI::ParseError& error);

// Makes an option with an empty value an error, in the program and all its commands. In a script "--spp $SPP"
// has one if the variable is not set, and must not render with the default.
void refuse_empty_values(CLI::App& app);

// Parses the arguments, which have no empty values of options. If the program is to end now, returns its exit
// code: 0 after --help or --version, 2 after wrong usage, of which a message was printed.
std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv);

}  // namespace ls
