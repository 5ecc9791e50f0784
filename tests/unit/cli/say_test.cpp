#include "cli/output/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <new>

#include "cli/output/progress.h"
#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

// Returns what `run` prints to stderr.
template <class Run>
std::string said(Run run) {
  testing::internal::CaptureStderr();
  run();
  return testing::internal::GetCapturedStderr();
}

TEST(ExitCode, IsTheUsersFaultOnlyIfTheInputIsWrong) {
  const auto code = [](Errc errc) {
    int code = 0;
    said([&] { code = print_rejected({{errc, "no"}, {}}); });
    return code;
  };

  EXPECT_EQ(code(Errc::invalid_argument), kUsage);
  for (const Errc errc : {Errc::resource_exhausted, Errc::not_found, Errc::unavailable, Errc::internal})
    EXPECT_EQ(code(errc), kFailed) << to_string(errc);
}

TEST(RunGuarded, ReportsExceptionsInsteadOfAborting) {
  int code = 0;
  const std::string memory =
      said([&] { code = run_guarded("merge", []() -> int { throw std::bad_alloc(); }); });
  EXPECT_EQ(code, kFailed);
  EXPECT_THAT(memory, AllOf(HasSubstr("out of memory"), HasSubstr("merge")));

  const std::string file = said([&] {
    code = run_guarded("merge", []() -> int {
      throw std::filesystem::filesystem_error("reading", "gone", std::make_error_code(std::errc::io_error));
    });
  });
  EXPECT_EQ(code, kFailed);
  EXPECT_THAT(file, HasSubstr("gone"));

  EXPECT_EQ(run_guarded("merge", [] { return 2; }), 2);
}

TEST(PlainText, KeepsLettersOfAllLanguages) {
  const std::string text = "Größe 霧 🌫 a~b";

  EXPECT_EQ(plain_text(text), text);
}

TEST(PlainText, RemovesTerminalControls) {
  EXPECT_EQ(plain_text("a\x1b[2Jb\nc\rd\x7f"), "a [2Jb c d ");
  EXPECT_EQ(plain_text("a\xc2\x9b"
                       "2Jb"),
            "a 2Jb");  // CSI as the C1 character
  EXPECT_EQ(plain_text("a\x9b"
                       "2Jb"),
            "a 2Jb");  // and as a single byte
  EXPECT_EQ(plain_text("a\xe2\x80\xae"
                       "b\xe2\x81\xa6"
                       "c"),
            "a b c");                          // right-to-left override, isolate
  EXPECT_EQ(plain_text("\xe2\x80"), "\xe2 ");  // cut off
}

TEST(Say, ShowsForeignTextPlainly) {
  const std::string evil =
      "fog\x1b]0;title\x07\n\xc2\x9b"
      "2J.xml";
  Diagnostic d;
  d.place = {evil, 3, 1};
  d.text = "no plugin '" + evil + "'";
  d.source_line = evil;

  for (const std::string& shown :
       {said([&] {
          print_error({Errc::internal, evil});
        }),
        said([&] { print_diagnostics({d}); }), progress_line({.state = evil, .trouble = evil}, 200)}) {
    EXPECT_THAT(shown, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\x07")), Not(HasSubstr("\xc2\x9b"))));
    EXPECT_THAT(shown, Not(HasSubstr("\n  2J.xml")));
    EXPECT_THAT(shown, HasSubstr("fog ]0;title   2J.xml"));
  }
}

}  // namespace
}  // namespace ls::cli
