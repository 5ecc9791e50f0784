#include "core/base/light/light_mix.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ls {
namespace {

using testing::HasSubstr;

std::string error(const std::string& text) {
  const auto mix = parse_light_mix(text);
  return mix ? "read as " + to_string(*mix) : mix.error().message;
}

TEST(LightMix, BothNotationsMeanTheSame) {
  for (const auto& [option, json] : std::map<std::string, std::string>{
           {"key=2", R"({"key":2.0})"},
           {"fill=0.5:0.4:0.3,key=0", R"({"fill":[0.5,0.4,0.3],"key":0.0})"},
           {"fog.surface=1,fog.volume=4", R"({"fog":{"surface":1.0,"volume":4.0}})"},
           {"fog.surface=1:2:3,fog.volume=4", R"({"fog":{"surface":[1.0,2.0,3.0],"volume":4.0}})"},
           {"", "{}"}}) {
    const LightMix mix = parse_light_mix(option).value();
    EXPECT_EQ(to_string(mix), option);
    EXPECT_EQ(canonical_json(mix), json);
    EXPECT_EQ(parse_light_mix(json).value(), mix);
  }
  EXPECT_EQ(to_string(parse_light_mix("fog.volume=4").value()), "fog.surface=1,fog.volume=4");
  EXPECT_EQ(to_string(parse_light_mix(R"({"fog":{"volume":4}})").value()), "fog.surface=1,fog.volume=4");
}

TEST(LightMix, WrongTextIsRefusedWithTheGroup) {
  for (const char* text : {"key", "key=", "key=x", "key=1:2", "key=1:2:3:4", "key=1:", "=2x"})
    EXPECT_THAT(error(text), HasSubstr("is no factor of a light group: give GROUP=FACTOR")) << text;
  for (const char* text :
       {"key=-1", "key=1e7", "key=nan", "key=inf", "key.depth=2", R"({"key":-1})", R"({"key":"2"})",
        R"({"key":[1,2]})", R"({"key":null})", R"({"key":{"depth":1}})", R"({"key":{"surface":-1}})"})
    EXPECT_THAT(error(text), HasSubstr("\"key\"")) << text;
  EXPECT_THAT(error("key=1,key=2"), HasSubstr("'key' is given twice"));
  EXPECT_THAT(error("key=1,key.volume=2"), HasSubstr("'key' is given twice"));
  EXPECT_THAT(error("key.volume=1,key.volume=2"), HasSubstr("'key' is given twice"));
  EXPECT_THAT(error("a b=2"), HasSubstr("a light group's name has"));
  EXPECT_THAT(error("{\"a\":1"), HasSubstr("a mix must be a JSON object"));
  EXPECT_THAT(error("[1]"), HasSubstr("is no factor"));
}

TEST(LightMix, ProductHasTheFactorsOfBoth) {
  const auto mix = [](const char* text) { return parse_light_mix(text).value(); };
  EXPECT_EQ(to_string(product(mix("key=2,fill=1:2:3"), mix("fill=2,fog.volume=4"))),
            "fill=2:4:6,fog.surface=1,fog.volume=4,key=2");
  EXPECT_EQ(to_string(product(mix("key=1000000"), mix("key=10"))), "key=1000000") << "stays a possible mix";
}

}  // namespace
}  // namespace ls
