#include "core/scene/json/serialize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  const std::size_t at = text.find(what);
  if (at == std::string::npos) throw std::runtime_error("not there: " + std::string(what));
  return text.replace(at, what.size(), by);
}

TEST(SceneJson, ReadsBackToTheSameScene) {
  const Scene s = must_read(kExample);
  const auto again = deserialize_scene(serialize(s));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(*again, s);
  EXPECT_EQ(serialize(*again), serialize(s));
}

TEST(SceneJson, KeepsEveryBitOfEveryNumber) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> mantissa(.5, 1);
  for (int i = 0; i < 1000; ++i) {
    Scene s = must_read(kExample);
    s.shapes[0].to_world.m[3] = std::ldexp(mantissa(random), static_cast<int>(random() % 600) - 300);
    s.shapes[0].to_world.m[7] = std::numeric_limits<double>::denorm_min();
    EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
  }
}

TEST(SceneJson, IsEqualForEqualScenes) {
  Scene a = must_read(kExample), b = a;
  a.shapes[0].to_world.m[3] = 0.0;
  b.shapes[0].to_world.m[3] = -0.0;
  ASSERT_EQ(a, b);
  EXPECT_EQ(digest_of(a), digest_of(b));
}

TEST(SceneJson, HasSortedKeysAndNoBlanks) {
  const std::string json = serialize(must_read(with_sensor("")));
  EXPECT_THAT(json,
              HasSubstr("\"film\":{\"crop_height\":0,\"crop_offset_x\":0,\"crop_offset_y\":0,\"crop_width\":"
                        "0,\"filter\":{\"stddev\":0.5,\"type\":\"gaussian\"},\"height\":8,\"width\":8}"));
  EXPECT_EQ(json.find(' '), std::string::npos);
}

TEST(SceneJson, EveryChangeChangesTheDigest) {
  const Scene s = must_read(kExample);
  std::vector<Scene> others(8, s);
  others[0].sample_count += 1;
  others[1].sensor.fov = 41;
  others[2].assets[0].digest.bytes[31] ^= 1;
  others[3].shapes[2].is_medium_transition = false;
  others[4].film.filter = BoxFilter{1.5};
  others[5].shapes.pop_back();
  others[6].integrator.name = "path";
  others[7].emitters[0] = ConstantEmitter{{.1, .1, .2}};
  for (const Scene& other : others) EXPECT_NE(digest_of(other), digest_of(s));
}

TEST(SceneJson, WrongInputIsRefusedByName) {
  const std::string good = serialize(must_read(kExample));
  const auto error = [](const std::string& json) {
    const auto r = deserialize_scene(json);
    return r ? "accepted" : r.error().message;
  };
  const std::string shape_bsdf = fmt::format("\"bsdf\":{}", must_read(kExample).shapes.at(0).bsdf.value);
  EXPECT_THAT(error("{"), HasSubstr("malformed"));
  EXPECT_THAT(error("[]"), HasSubstr("not an object"));
  EXPECT_THAT(error("{}"), HasSubstr("scene.assets is missing"));
  EXPECT_THAT(error(std::string(100000, '[')), HasSubstr("nested too deep"));
  EXPECT_THAT(error(replaced(good, "\"sample_count\":16", "\"sample_count\":0")),
              HasSubstr("scene.sample_count is out of range"));
  EXPECT_THAT(error(replaced(good, "\"sample_count\":16", "\"sample_count\":-1")),
              HasSubstr("scene.sample_count"));
  EXPECT_THAT(error(replaced(good, "\"sample_count\":16", "\"sample_count\":16,\"extra\":1")),
              HasSubstr("scene.extra is unknown"));
  EXPECT_THAT(error(replaced(good, "\"width\":32", "\"width\":1e999")),
              ::testing::AnyOf(HasSubstr("width"), HasSubstr("malformed")));
  EXPECT_THAT(error(replaced(good, "\"type\":\"tent\"", "\"type\":\"tant\"")),
              HasSubstr("scene.film.filter.type is unknown"));
  EXPECT_THAT(error(replaced(good, shape_bsdf, "\"bsdf\":999")), HasSubstr("refers to object 999"));
  EXPECT_THAT(error(replaced(good, "\"g\":0.5", "\"g\":1")), HasSubstr(".g is out of range"));
  EXPECT_THAT(error(replaced(good, "\"sha256\":\"", "\"sha256\":\"x")), HasSubstr("not a digest"));
}

TEST(SceneJson, CyclesAreRefused) {
  Scene s;
  s.textures = {CheckerboardTexture{{1}, {1}, {}}, CheckerboardTexture{{0}, {0}, {}}};
  EXPECT_THAT(deserialize_scene(serialize(s)).error().message, HasSubstr("circle"));
  Scene t;
  t.bsdfs = {TwoSidedBsdf{{0}, {0}}};
  EXPECT_THAT(deserialize_scene(serialize(t)).error().message, HasSubstr("twosided"));
}

TEST(SceneJson, RandomDamageNeverCrashes) {
  const std::string good = serialize(must_read(kExample));
  std::mt19937 random(11);
  for (int n = 0; n < 3000; ++n) {
    std::string json = good;
    for (int edits = 0; edits < 2; ++edits) {
      const std::size_t at = random() % json.size();
      if (random() % 2)
        json[at] = "0123456789-e.,:[]{}\"x"[random() % 21];
      else
        json.erase(at, 1 + random() % 8);
    }
    const auto r = deserialize_scene(json);
    if (r)
      EXPECT_EQ(deserialize_scene(serialize(*r)).value(), *r);
    else
      EXPECT_FALSE(r.error().message.empty());
  }
}

}  // namespace
}  // namespace ls
