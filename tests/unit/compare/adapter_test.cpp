// Adapters: what they may say, and what of a program's claims is believed.
#include "compare/adapter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ls::race {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kWhole =
    R"({"name": "Other", "command": ["other", "{scene}", "-n", "{spp}", "-o={image}"], "first_spp": 8, "scenes": ["fog"]})";

std::string trouble(const std::string& json) {
  const auto adapter = parse_adapter(json, "folder/a.json");
  return adapter ? "it was taken" : adapter.error().message;
}

TEST(Adapters, AreReadAndFilled) {
  const auto adapter = parse_adapter(kWhole, "folder/a.json");

  ASSERT_TRUE(adapter) << adapter.error().message;
  EXPECT_EQ(adapter->name, "Other");
  EXPECT_FALSE(adapter->lists);
  EXPECT_EQ(adapter->first_spp, 8u);
  EXPECT_TRUE(adapter->scenes.contains("fog"));
  EXPECT_THAT(filled(*adapter, {{"scene", "a b.xml"}, {"spp", "16"}, {"image", "o.exr"}}),
              ElementsAre("other", "a b.xml", "-n", "16", "-o=o.exr"));
}

TEST(Adapters, WhatIsFilledInIsNotFilledAgain) {
  const auto adapter = parse_adapter(kWhole, "a.json");

  EXPECT_THAT(filled(*adapter, {{"scene", "{spp}"}, {"spp", "16"}, {"image", "o"}}),
              ElementsAre("other", "{spp}", "-n", "16", "-o=o"));
}

TEST(Adapters, ThoseThatListPicturesNeedAFolder) {
  EXPECT_TRUE(
      parse_adapter(R"({"name": "a", "command": ["x", "{scene}", "{time}", "{folder}"]})", "a")->lists);
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["x", "{scene}", "{time}"]})"), HasSubstr("{folder}"));
}

TEST(Adapters, SayWhichFileAndKeyIsWrong) {
  EXPECT_THAT(trouble("[]"), HasSubstr("folder/a.json: an adapter is a JSON object"));
  EXPECT_THAT(trouble(R"({"name": "a", "comand": []})"), HasSubstr("unknown key 'comand'"));
  EXPECT_THAT(trouble(R"({"command": ["x"]})"), HasSubstr("'name'"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": "x {scene}"})"), HasSubstr("'command' must be an array"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": []})"), HasSubstr("'command' must be an array"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["x", "{scene}", "{image}", "{sp}"]})"),
              HasSubstr("has {sp}"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["x", "{scene"]})"),
              HasSubstr("a brace that is not closed"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["x", "{spp}", "{image}"]})"), HasSubstr("needs {scene}"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["x", "{scene}"]})"), HasSubstr("either {spp}"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["{scene}", "{spp}", "{time}"]})"),
              HasSubstr("either {spp}"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["{scene}", "{spp}", "{image}"], "most_seconds": -1})"),
              HasSubstr("'most_seconds'"));
  EXPECT_THAT(trouble(R"({"name": "a", "command": ["{scene}", "{spp}", "{image}"], "first_spp": 1.5})"),
              HasSubstr("'first_spp'"));
}

std::string list_trouble(const std::string& lines) {
  const auto list = parse_pictures(lines);
  return list ? "it was taken" : list.error().message;
}

TEST(MadePictures, AreReadLineByLine) {
  const auto list = parse_pictures(
      "{\"image\": \"0.exr\", \"spp\": 4, \"seconds\": 0.5}\n\n"
      "{\"image\": \"1.exr\", \"spp\": 16, \"seconds\": 2, \"cpu_seconds\": 3.5}\n");

  ASSERT_TRUE(list) << list.error().message;
  ASSERT_EQ(list->size(), 2u);
  EXPECT_EQ((*list)[0].spp, 4);
  EXPECT_FALSE((*list)[0].cpu_seconds);
  EXPECT_EQ((*list)[1].image, "1.exr");
  EXPECT_EQ((*list)[1].cpu_seconds, 3.5);
}

TEST(MadePictures, AreRefusedWithTheirLine) {
  const std::string good = "{\"image\": \"0.exr\", \"spp\": 4, \"seconds\": 0.5}\n";
  EXPECT_THAT(list_trouble(""), HasSubstr("names no picture"));
  EXPECT_THAT(list_trouble(good + "nonsense\n"), HasSubstr("line 2: this is no JSON object"));
  EXPECT_THAT(list_trouble(good + good), HasSubstr("line 2: 'spp' must rise"));
  EXPECT_THAT(list_trouble("{\"image\": \"0.exr\", \"spp\": 4, \"seconds\": -1}"), HasSubstr("'seconds'"));
  EXPECT_THAT(list_trouble("{\"image\": \"0.exr\", \"spp\": \"4\", \"seconds\": 1}"), HasSubstr("'spp'"));
  for (const char* path : {"../0.exr", "/etc/passwd", "..", "", "a/b.exr"})
    EXPECT_THAT(list_trouble(std::string("{\"spp\": 4, \"seconds\": 1, \"image\": \"") + path + "\"}"),
                HasSubstr("without a folder"))
        << path;
  std::string many;
  for (std::size_t i = 1; i <= kMostPictures + 1; ++i)
    many += "{\"image\": \"0.exr\", \"seconds\": 1, \"spp\": " + std::to_string(i) + "}\n";
  EXPECT_THAT(list_trouble(many), HasSubstr("more than"));
}

TEST(Claims, OfMoreTimeThanTheProcessHadAreNotBelieved) {
  const Cost process{10, 18};

  EXPECT_EQ(plausible_cost({"", 4, 9, 17}, process, RaceClock::cpu)->cpu, 17);
  EXPECT_THAT(plausible_cost({"", 4, 11, 17}, process, RaceClock::wall).error().message,
              HasSubstr("ran for 10 s"));
  EXPECT_THAT(plausible_cost({"", 4, 9, 25}, process, RaceClock::wall).error().message,
              HasSubstr("CPU seconds"));
}

TEST(Claims, WithoutCpuSecondsServeWallClocksOnly) {
  EXPECT_TRUE(plausible_cost({"", 4, 9, {}}, {10, 18}, RaceClock::wall));
  EXPECT_THAT(plausible_cost({"", 4, 9, {}}, {10, 18}, RaceClock::cpu).error().message,
              HasSubstr("--clock cpu"));
}

}  // namespace
}  // namespace ls::race
