// Commands that other programs run.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cli/commands/commands.h"
#include "cli/output/console.h"

namespace ls::cli {

int become(const std::filesystem::path& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> argv;
  for (std::string& word : arguments) argv.push_back(word.data());
  argv.push_back(nullptr);
  ::execv(argv.front(), argv.data());
  complain(fmt::format("cannot start {}: {}", program.string(), std::strerror(errno)));
  return kFailed;
}

CLI::Option* pass_option(CLI::App& app, const char* name, const char* type, const char* help) {
  return app.add_option(name)->description(help)->type_name(type);
}

CLI::Option* pass_options(CLI::App& app, const char* name, const char* type, const char* help) {
  return pass_option(app, name, type, help)
      ->expected(1, CLI::detail::expected_max_vector_size)
      ->allow_extra_args(false);
}

std::vector<std::string> given_options(const CLI::App& app) {
  std::vector<std::string> words, others;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& value : option->results()) {
      bool on = true;  // "--quiet=false" switches nothing on
      if (option->get_items_expected_max() == 0 && CLI::detail::lexical_cast(value, on) && !on) continue;
      if (option->get_positional())
        others.push_back(value);
      else
        words.push_back(fmt::format("--{}={}", option->get_single_name(), value));
    }
  if (others.empty()) return words;
  words.push_back("--");  // names of files may begin with hyphens
  words.insert(words.end(), others.begin(), others.end());
  return words;
}

}  // namespace ls::cli
