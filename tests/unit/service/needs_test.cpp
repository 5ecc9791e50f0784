// A job stores only the part of the scene that it needs, with the reasons, and the digests of only those
// files.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/admission/admission.h"
#include "core/scene/analysis/needs.h"
#include "core/scene/json/serialize.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"

namespace ls::coordinator {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

std::string blend(const char* weight) {
  return fmt::format(R"(<scene version="3.0.0">
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="24"/></film></sensor>
  <shape type="sphere">
    <bsdf type="blendbsdf">
      <float name="weight" value="{}"/>
      <bsdf type="diffuse"/>
      <bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="wood.png"/></texture></bsdf>
    </bsdf>
  </shape>
  <emitter type="constant"/>
</scene>)",
                     weight);
}
const Digest kWoodDigest = sha256("wood");

SubmitRequest request(const char* weight) {
  return {"a.xml", blend(weight), {{"wood.png", kWoodDigest}}, {}};
}

TEST(Needs, UnneededFileNeedNotBeUploaded) {
  auto coordinator = open_at({});

  const auto taken = admit(request("0"), coordinator->blobs(), scenes_in_this_process());

  ASSERT_TRUE(taken) << taken.error().error.message;
  EXPECT_TRUE(taken->job.assets.empty());
  EXPECT_THAT(taken->job.analysis, HasSubstr("branch of a blend"));
  EXPECT_THAT(taken->scene_json, Not(HasSubstr("wood.png")));
}

TEST(Needs, MissingNeededFileIsReportedWithItsPlace) {
  auto coordinator = open_at({});

  const auto refused = admit(request("0.5"), coordinator->blobs(), scenes_in_this_process());

  ASSERT_FALSE(refused);
  ASSERT_FALSE(refused.error().diagnostics.empty());
  EXPECT_EQ(refused.error().diagnostics[0].place.line, 7);
  EXPECT_THAT(refused.error().diagnostics[0].text, HasSubstr("wood.png"));

  ASSERT_TRUE(coordinator->blobs().put(kWoodDigest, std::as_bytes(std::span(std::string_view("wood")))));
  const auto taken = admit(request("0.5"), coordinator->blobs(), scenes_in_this_process());
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->job.assets.size(), 1u);
  EXPECT_EQ(taken->job.assets[0].bytes, 4u);
}

TEST(Needs, AreKeptWithTheJobAndSentWithIt) {
  auto coordinator = open_at({});
  const auto taken = admit(request("0"), coordinator->blobs(), scenes_in_this_process());
  ASSERT_TRUE(taken);

  const auto scene = deserialize_scene(taken->scene_json);
  ASSERT_TRUE(scene);
  EXPECT_EQ(taken->job.needs, canonical_json(scene::needs_of(*scene, true)));
  EXPECT_EQ(plan_of(taken->job).brief.needs, taken->job.needs);
  const auto back = parse_stored_job(to_json(taken->job));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, taken->job);
  EXPECT_THAT(taken->job.features_used, Contains("surfaces"));
  EXPECT_THAT(taken->job.features_left_out, Contains("volume grids"));
}

}  // namespace
}  // namespace ls::coordinator
