// Ranges of frames, frame numbers in file names, and diagnostics of scenes with many frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/frame_range.h"
#include "core/job/frame_diagnostics.h"
#include "core/job/settings.h"

namespace ls {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string refusal(std::string_view text) {
  const auto range = parse_frames(text);
  return range ? "" : range.error().message;
}

TEST(FrameRange, RoundTripsInOneForm) {
  EXPECT_EQ(parse_frames("1-10").value(), (FrameRange{1, 10, 1}));
  EXPECT_EQ(parse_frames("7").value(), (FrameRange{7, 7, 1}));
  EXPECT_THAT(parse_frames("1-10x4").value().frames(), ElementsAre(1, 5, 9));
  for (const char* text : {"0-0", "1-10", "3-11x2", "7"}) {
    const auto range = parse_frames(text);
    ASSERT_TRUE(range) << text;
    EXPECT_EQ(parse_frames(to_string(*range)).value(), *range) << text;
  }
  EXPECT_TRUE((FrameRange{1, 10, 4}).contains(9));
  EXPECT_FALSE((FrameRange{1, 10, 4}).contains(10));
}

TEST(FrameRange, RefusesMalformedAndTooLongRanges) {
  for (const char* text : {"", "-", "1-", "-3", "a", "1-3-5", "1..3", "1-3x", " 1-3", "1-3 ", "+1", "1-3x-1"})
    EXPECT_THAT(refusal(text), HasSubstr("FIRST-LAST")) << text;
  EXPECT_THAT(refusal("5-3"), HasSubstr("comes before"));
  EXPECT_THAT(refusal("1-3x0"), HasSubstr("step"));
  EXPECT_THAT(refusal("1-1000000000"), HasSubstr("9999999"));
  EXPECT_THAT(refusal("1-99999999999999999999"), HasSubstr("FIRST-LAST"));
  EXPECT_THAT(refusal("1-9999999"), HasSubstr("one job may have 10000"));
  EXPECT_EQ(refusal("1-10000"), "");
  EXPECT_NE(refusal("0-10000"), "");
  EXPECT_EQ(refusal("0-9999999x1000"), "");
}

TEST(FrameRange, PutsTheNumberWhereTheHashesAre) {
  EXPECT_EQ(numbered("fog.####.vdb", 7), "fog.0007.vdb");
  EXPECT_EQ(numbered("fog.#.vdb", 12), "fog.12.vdb");
  EXPECT_EQ(numbered("##a-###.vdb", 123), "123a-123.vdb");
  EXPECT_EQ(numbered("fog.vdb", 7), "fog.vdb");
  EXPECT_EQ(numbered("", 7), "");
  EXPECT_EQ(numbered("C#/shot ##/a-##.vdb", 7), "C#/shot ##/a-07.vdb")
      << "a # in the name of a folder is only a #";
  EXPECT_EQ(numbered("#/parts_##/", 7), "#/parts_07/");
  EXPECT_EQ(numbered("/", 7), "/");
  EXPECT_EQ(numbered("C#/frame_####/a.vdb", 7), "C#/frame_0007/a.vdb")
      << "two and more in a folder's name, if the file's name has none";
  EXPECT_TRUE(has_frame_number("C#/frame_####/a.vdb"));
  EXPECT_FALSE(has_frame_number("C#/a.vdb"));
  EXPECT_TRUE(has_frame_number("C#/a#.vdb"));
}

TEST(FrameRange, IsPartOfAJobsSpec) {
  const auto spec = parse_job_spec(R"({"frames": "1-10x2", "spp": 4})");
  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->frames, (FrameRange{1, 10, 2}));
  EXPECT_EQ(parse_job_spec(canonical_json(*spec)).value(), *spec);
  EXPECT_EQ(parse_job_spec(R"({"frames": 7})").value().frames, (FrameRange{7, 7, 1}));
  EXPECT_EQ(canonical_json(JobSpec{}).find("frames"), std::string::npos)
      << "the text of other jobs stays as it was";
  for (const char* text : {R"({"frames": "1-1000000000"})", R"({"frames": [1, 10]})", R"({"frames": -3})",
                           R"({"frames": "1-3", "defines": {"frame": "2"}})"})
    EXPECT_FALSE(parse_job_spec(text)) << text;
}

Diagnostic complaint(std::string text, int line = 3) {
  Diagnostic d;
  d.place = {"fog.xml", line, 1};
  d.text = std::move(text);
  return d;
}

std::vector<std::string> texts(const FrameDiagnostics& found) {
  std::vector<std::string> out;
  for (const Diagnostic& d : found.take()) out.push_back(d.text);
  return out;
}

TEST(FrameDiagnostics, NameTheFrameUnlessAllFramesHaveIt) {
  FrameDiagnostics found;
  found.add(1, {complaint("a typing error")});
  found.add(2, {complaint("a typing error"), complaint("no file fog.2")});
  found.add(3, {complaint("a typing error"), complaint("odd")});
  found.add(5, {complaint("a typing error"), complaint("odd")});

  EXPECT_THAT(texts(found),
              ElementsAre("a typing error", "frame 2: no file fog.2", "frame 3 and 1 more: odd"));
}

TEST(FrameDiagnostics, KeepAtMostTwenty) {
  FrameDiagnostics found;
  for (std::uint32_t frame = 1; frame <= 50; ++frame) {
    EXPECT_EQ(found.full(), frame > 20);
    found.add(frame, {complaint("no file fog." + std::to_string(frame))});
  }
  EXPECT_EQ(found.take().size(), 20u);
}

}  // namespace
}  // namespace ls
