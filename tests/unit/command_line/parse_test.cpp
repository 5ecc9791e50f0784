// Messages on wrong usage, and the help.
#include "util/command_line/parse.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>

namespace ls {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Usage : public ::testing::Test {
 protected:
  Usage() {
    use_plain_help(app_);
    app_.require_subcommand(1);
    CLI::App* render = app_.add_subcommand("render", "renders");
    render->add_option("--spp", text_, "samples")->type_name("N");
    render->add_option("--target-error", text_, "error")->type_name("E");
    render->add_option("scene", text_, "the scene")->type_name("SCENE")->required();
    render->add_option("--kind", text_, "kind")->check(CLI::IsMember({"one", "two"}));
    render->add_option("--number", number_, "number")->check(CLI::Range(1, 9))->capture_default_str();
    CLI::App* token = app_.add_subcommand("token", "tokens");
    token->require_subcommand(1);
    token->add_subcommand("revoke", "revokes");
  }
  std::string message(const std::vector<std::string>& arguments) {
    return parse(arguments, [&](const CLI::ParseError& error) { return unknown_argument(app_, error); });
  }
  std::string problem(const std::vector<std::string>& arguments) {
    return parse(arguments, [](const CLI::ParseError& error) { return error.what(); });
  }

  template <class F>
  std::string parse(std::vector<std::string> arguments, F message_of) {
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    try {
      app_.parse(arguments);
    } catch (const CLI::ParseError& error) {
      return message_of(error);
    }
    return "";
  }

  CLI::App app_{"A program.", "program"};
  std::string text_;
  unsigned number_ = 7;
};

TEST_F(Usage, ShowsTheDotsOfARepeatedValueOnce) {
  std::vector<std::string> files, names;
  CLI::App* merge = app_.add_subcommand("merge", "merges");
  merge->add_option("files", files, "files")->type_name("FILE...")->required();
  merge->add_option("names", names, "names")->type_name("NAME");

  EXPECT_THAT(merge->help(), HasSubstr("FILE... [NAME...]\n"));
}

TEST_F(Usage, SuggestsTheMeantCommand) {
  EXPECT_EQ(message({"rendr", "scene.xml"}), "program has no command 'rendr'; did you mean 'render'?");
}
TEST_F(Usage, SuggestsSubcommands) {
  EXPECT_EQ(message({"token", "revok"}), "program token has no command 'revok'; did you mean 'revoke'?");
}
TEST_F(Usage, SuggestsTheMeantOption) {
  EXPECT_EQ(message({"render", "scene.xml", "--sp", "4"}),
            "program render has no option --sp; did you mean '--spp'?");
}
TEST_F(Usage, SuggestsTheOptionOfAValueWithEqualsSign) {
  EXPECT_EQ(message({"render", "scene.xml", "--spo=4"}),
            "program render has no option --spo; did you mean '--spp'?");
}
TEST_F(Usage, SuggestsTheOnlyOptionWithThisPrefix) {
  EXPECT_EQ(message({"render", "scene.xml", "--target", ".1"}),
            "program render has no option --target; did you mean '--target-error'?");
}
TEST_F(Usage, SuggestsNothingForUnrelatedWords) {
  EXPECT_EQ(message({"render", "scene.xml", "--wavelength"}), "program render has no option --wavelength");
}
TEST_F(Usage, NamesAnExtraArgument) {
  EXPECT_EQ(message({"render", "scene.xml", "other.xml"}), "program render takes no argument 'other.xml'");
}
TEST_F(Usage, LeavesOtherErrorsToTheParser) {
  EXPECT_EQ(message({"render"}), "") << "the scene is missing";
  EXPECT_EQ(message({"render", "scene.xml", "--number", "10"}), "");
}

TEST_F(Usage, EmptyValueOfAnOptionIsAnError) {
  const std::string help = app_.get_subcommand("render")->help();
  refuse_empty_values(app_);

  EXPECT_EQ(problem({"render", "scene.xml", "--spp", ""}),
            "--spp: the value is empty; leave the option out for the default");
  EXPECT_EQ(problem({"render", "scene.xml", "--spp", "4"}), "");
  EXPECT_EQ(app_.get_subcommand("render")->help(), help);
}

// CLI11 would take "scene.xml" for the value.
TEST_F(Usage, EmptyValueAfterAnEqualsSignDoesNotTakeTheNextArgument) {
  const char* const empty[] = {"program", "render", "--spp=", "scene.xml"};
  EXPECT_EQ(parse_arguments(app_, 4, empty), 2);
  const char* const given[] = {"program", "render", "--kind=one", "scene.xml"};
  EXPECT_EQ(parse_arguments(app_, 4, given), std::nullopt);
}

TEST_F(Usage, TheHelpShowsValuesInWords) {
  const std::string help = app_.get_subcommand("render")->help();

  EXPECT_THAT(help, HasSubstr("--spp N"));
  EXPECT_THAT(help, HasSubstr("kind (one, two)"));
  EXPECT_THAT(help, HasSubstr("number (default: 7)"));
  EXPECT_THAT(help, HasSubstr("SCENE"));
  for (const char* type : {"TEXT", "UINT", "{one,two}", "REQUIRED"}) EXPECT_THAT(help, Not(HasSubstr(type)));
}

}  // namespace
}  // namespace ls
