// A command that is copied into a shell must give the program exactly the words that were quoted.
#include "core/job/health_notes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "core/base/safe_text.h"

namespace ls {
namespace {

// Returns the arguments that bash reads from the text, each followed by a 0.
std::string words_of(const std::string& text) {
  FILE* script = std::tmpfile();
  std::fprintf(script, "printf '%%s\\0' %s", text.c_str());
  std::fflush(script);
  const std::string command =
      "bash /proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(fileno(script));
  FILE* shell = popen(command.c_str(), "r");
  std::string out;
  std::array<char, 256> part{};
  while (const std::size_t n = std::fread(part.data(), 1, part.size(), shell)) out.append(part.data(), n);
  EXPECT_EQ(pclose(shell), 0) << text;
  std::fclose(script);
  return out;
}
std::string joined(std::initializer_list<std::string> words) {
  std::string all;
  for (const std::string& w : words) all += w + '\0';
  return all;
}

TEST(ShellWord, RoundTripsThroughAShell) {
  for (const std::string& text :
       {std::string("plain.xml"), std::string("a b"), std::string("it's"), std::string("$HOME `id` $(id) !x"),
        std::string(""), std::string("x\ny\t\033[31m"), std::string("\\'\n\\"),
        std::string("d\xc3\xa9j\xc3\xa0 vu"), std::string("\xff\n"), std::string("a;b|c&d>e*f?[g]{h}~#")})
    EXPECT_EQ(words_of(shell_word(text)), joined({text})) << shell_word(text);
}

TEST(ShellWord, HasNoTerminalControls) {
  const std::string word = shell_word("a\nb\033[31m\x7f");
  EXPECT_EQ(plain_text(word), word);
  EXPECT_EQ(shell_word("scenes/bath.xml"), "scenes/bath.xml");
}

TEST(ReplayCommand, ContainsEverySettingThatDecidesASample) {
  JobSpec spec;
  spec.spp = 64;
  spec.priority = 3;
  spec.seed = 7;
  spec.size = FrameSize{64, 32};
  spec.integrator = "path";
  spec.techniques = parse_technique_choice("-path_reuse");
  spec.defines = {{"-odd", "1"}, {"colour", "1, 2 3"}, {"n", "$(id)"}};

  EXPECT_EQ(words_of(replay_command(replay_command("-my scene.xml", spec, 12), 3, 4, 5)),
            joined({"lightshaft",   "render",   "./-my scene.xml",
                    "--seed",       "7",        "--frames",
                    "12",           "--size",   "64x32",
                    "--integrator", "path",     "--techniques=-path_reuse",
                    "-D-odd=1",     "-D",       "colour=1, 2 3",
                    "-D",           "n=$(id)",  "--pixel",
                    "3,4",          "--sample", "5"}));
  EXPECT_EQ(replay_command("fog.xml", {}), "lightshaft render fog.xml");
}

TEST(HealthNotes, NameTheFirstPlaceOfEachCauseAndItsCommand) {
  Health h;
  h.add(HealthCause::infinite, 1, {9, 9, 9});
  h.add(HealthCause::infinite, 1, {3, 4, 5});
  h.add(HealthCause::negative_texel, 2);

  const auto notes = health_notes(h, "lightshaft render x.xml");

  ASSERT_EQ(notes.size(), 2u);
  EXPECT_EQ(notes[0].count, 2u);
  EXPECT_EQ(notes[0].replay, "lightshaft render x.xml --pixel 3,4 --sample 5");
  EXPECT_EQ(notes[1].replay, "");
  EXPECT_EQ(
      health_json(h, notes),
      R"({"causes":[{"cause":"infinite","count":2,"effect":"rejected","first":[{"pixel":[3,4],"sample":5},)"
      R"({"pixel":[9,9],"sample":9}],"frame":null,"replay":"lightshaft render x.xml --pixel 3,4 --sample 5",)"
      R"("text":"2 samples were infinite; they count as zero"},)"
      R"({"cause":"negative_texel","count":2,"effect":"input","first":[],"frame":null,"replay":null,)"
      R"("text":"2 negative texels of the scene were made 0"}],)"
      R"("clean":false,"majorant_violations":0,"negative":0,"nonfinite":2})");
  EXPECT_THAT(health_json({}, {}), testing::HasSubstr(R"("clean":true)"));
}

TEST(HealthNotes, SequenceCountsAllFramesAndPointsToTheFirst) {
  Health h;
  h.add(HealthCause::infinite, 2, {3, 4, 5});
  std::vector<HealthNote> notes;
  add_notes(notes, health_notes(h, "c --frames 3"), 3);
  add_notes(notes, health_notes(h, "c --frames 4"), 4);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0].count, 4u);
  EXPECT_EQ(notes[0].frame, 3u);
  EXPECT_EQ(notes[0].replay, "c --frames 3 --pixel 3,4 --sample 5");
}

}  // namespace
}  // namespace ls
