#include "core/base/log.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace ls {
namespace {

// Parses a logged line. log_line() omits the opening brace, which the log's pattern adds.
nlohmann::json json_line(std::string_view keys, std::string_view text) {
  return nlohmann::json::parse("{" + log_line(LogFormat::json, keys, text));
}

TEST(Log, WritesKeysAndTextOnOneLine) {
  EXPECT_EQ(log_line(LogFormat::text, "job=j-1 tile=4", "unit accepted"), "job=j-1 tile=4 unit accepted");
  EXPECT_EQ(log_line(LogFormat::text, "", "stopping"), "stopping");
}

TEST(Log, WritesKeysAsMembersOfJson) {
  const auto line = json_line("job=j-1 tile=4 why=a \"quoted\" reason", "unit\naccepted");

  EXPECT_EQ(line,
            (nlohmann::json{
                {"job", "j-1"}, {"tile", "4"}, {"why", "a \"quoted\" reason"}, {"text", "unit\naccepted"}}));
}

TEST(Log, ForeignTextCannotBeginALineOrAKey) {
  const std::string name = "evil\n2026-01-01 error job=j-2 stolen";

  EXPECT_EQ(log_line(LogFormat::text, "worker=" + log_value(name), name).find('\n'), std::string::npos);
  const auto line = json_line("worker=w-1 name=" + log_value(name), "joined");
  EXPECT_FALSE(line.contains("job"));
  EXPECT_EQ(line["worker"], "w-1");
}

// U+009B controls a terminal as ESC [ does; U+202E turns the letters after it around.
TEST(Log, RemovesTerminalControlsAndDirectionMarksFromForeignText) {
  const std::string name =
      "a\xc2\x9b"
      "2Jb\xe2\x80\xae"
      "c\xe2\x81\xa6"
      "d\xe2\x80\x8f"
      "e\xe2\x80\xa8"
      "f\x1b[0m";

  EXPECT_EQ(log_line(LogFormat::text, "name=" + log_value(name), name),
            "name=a_2Jb_c_d_e_f_[0m a 2Jb c d e f [0m");
  const auto line = json_line("name=" + name, name + "\nsecond line");
  EXPECT_EQ(line["text"], "a 2Jb c d e f [0m\nsecond line");
  EXPECT_EQ(line["name"], "a 2Jb c d e f [0m");
  EXPECT_EQ(log_value("Größe"), "Größe");
}

TEST(Log, IsValidJsonForPathsOfAnyBytes) {
  EXPECT_NO_THROW(json_line("file=\xff\xfe", "cannot read '\xc3'"));
}

TEST(Log, KeepsTheFirstOfTwoEqualKeys) { EXPECT_EQ(json_line("job=a job=b", "")["job"], "a"); }

TEST(Log, KnowsItsFormatsByName) {
  EXPECT_EQ(log_format_of("json"), LogFormat::json);
  EXPECT_EQ(log_format_of("text"), LogFormat::text);
  EXPECT_FALSE(log_format_of("xml"));
}

}  // namespace
}  // namespace ls
