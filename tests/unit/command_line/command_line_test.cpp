// A program's command line as data, and the escaping of texts with characters that are special to troff or
// shells.
#include <gmock/gmock.h>

#include <CLI/CLI.hpp>

#include "util/command_line/command.h"

namespace ls {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

const CommandOption& option(const Command& command, const std::string& name) {
  static const CommandOption none;
  for (const CommandOption& each : command.options)
    if (each.names.empty() ? each.help == name : each.names.back() == name) return each;
  ADD_FAILURE() << "no option " << name;
  return none;
}

TEST(CommandLine, DescriptionMatchesTheParser) {
  CLI::App app("A program.", "program");
  app.footer("The end.");
  CLI::App* sub = app.add_subcommand("list", "lists");
  app.add_subcommand("secret", "hidden")->group("");
  std::string text;
  std::vector<std::string> files;
  unsigned number = 7;
  bool flag = false;
  sub->add_option("-o,--output", text, "where to")->type_name("OUT.exr")->required();
  sub->add_option("--kind", text, "kind")->check(CLI::IsMember({"one", "two"}));
  sub->add_option("--number", number, "number")->check(CLI::Range(1, 9))->capture_default_str();
  sub->add_option("--hidden", text)->group("");
  sub->add_flag("--flag", flag, "flag");
  sub->add_option("files", files, "files")->type_name("FILE");

  const Command command = describe_command(app);

  ASSERT_EQ(command.commands.size(), 1u);
  const Command& list = command.commands[0];
  EXPECT_EQ(command.footer, "The end.");
  EXPECT_EQ(list.footer, "") << "its parent's is not repeated";
  EXPECT_EQ(list.options.size(), 6u) << "with --help, without --hidden";
  EXPECT_THAT(option(list, "--output").names, ElementsAre("-o", "--output"));
  EXPECT_TRUE(option(list, "--output").takes_file() && option(list, "--output").required);
  EXPECT_THAT(option(list, "--kind").choices, ElementsAre("one", "two"));
  EXPECT_FALSE(option(list, "--kind").takes_file());
  EXPECT_EQ(option(list, "--number").value, "N");
  EXPECT_EQ(option(list, "--number").default_value, "7");
  EXPECT_EQ(option(list, "--flag").value, "");
  EXPECT_TRUE(option(list, "files").repeated && option(list, "files").takes_file());
}

Command with_help(const std::string& help) {
  return {"program", "A program.", "", {{{"--option"}, "N", {}, help, "", false, false}}, {}};
}

TEST(ManPage, EscapesCharactersThatTroffInterprets) {
  const std::string page = man_page(with_help(".sh is a file\n'quoted' C:\\dir --x"), "1.0", "2026-01-31");

  EXPECT_THAT(page, HasSubstr("\n\\&.sh is a file\n\\&'quoted' C:\\edir \\-\\-x\n"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-option\\fR \\fIN\\fR"));
  EXPECT_THAT(page, HasSubstr(".TH \"PROGRAM\" 1 2026-01-31 \"Lightshaft 1.0\" \"Lightshaft\"\n"));
}

TEST(Completion, QuotesHelpForEachShell) {
  const Command command = with_help("the farm's [best]: a\\b $(false)");

  EXPECT_THAT(zsh_completion(command),
              HasSubstr("'--option=[the farm'\\''s \\[best\\]\\: a\\\\b $(false)]:N:'"));
  EXPECT_THAT(fish_completion(command), HasSubstr("-d 'the farm\\'s [best]: a\\\\b $(false)'"));
  EXPECT_THAT(bash_completion(command), Not(HasSubstr("$(false)")));
}

}  // namespace
}  // namespace ls
