// A worker that derives other needs of a scene (features and files) than the coordinator refuses to render
// it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/analysis/needs.h"
#include "core/scene/json/serialize.h"
#include "tests/support/render_check.h"
#include "worker/inprocess.h"

namespace ls::worker {
namespace {

using ::testing::HasSubstr;

LocalJob job_of(const test::SceneBuilder& builder, const test::ScratchFolder& folder) {
  LocalJob job;
  const std::string text = serialize(builder.scene);
  job.scene = folder.path() / "scene.json";
  std::ofstream(job.scene, std::ios::binary) << text;
  job.brief.job = JobId{"j-1"};
  job.brief.scene = sha256(text);
  job.brief.settings = test::settings_of(builder.scene);
  job.brief.settings_digest = digest_of(job.brief.settings);
  return job;
}
test::SceneBuilder ball() {
  test::SceneBuilder builder;
  builder.shape(SphereShape{}, Transform{}, builder.diffuse(.5));
  builder.environment();
  return builder;
}

TEST(InProcess, RendersASceneWhoseNeedsMatchTheCoordinators) {
  const test::ScratchFolder folder;
  LocalJob job = job_of(ball(), folder);
  job.brief.needs = canonical_json(scene::needs_of(ball().scene, true));
  EXPECT_TRUE(make_inprocess_backend(1)->prepare(job, std::atomic<bool>{}));
}

TEST(InProcess, RefusesASceneWhoseNeedsDifferAndNamesTheDifference) {
  const test::ScratchFolder folder;
  LocalJob job = job_of(ball(), folder);
  test::SceneBuilder other = ball();
  other.scene.emitters.push_back(PointEmitter{});
  job.brief.needs = canonical_json(scene::needs_of(other.scene, true));

  const auto refused = make_inprocess_backend(1)->prepare(job, std::atomic<bool>{});

  ASSERT_FALSE(refused);
  EXPECT_FALSE(refused.error().scene_at_fault);  // another worker may be of the right version
  EXPECT_THAT(refused.error().reason, HasSubstr("do not agree on what the scene needs"));
  EXPECT_THAT(refused.error().reason, HasSubstr("\"point\":1"));
}

TEST(InProcess, AcceptsAJobWithoutNeeds) {
  const test::ScratchFolder folder;
  EXPECT_TRUE(make_inprocess_backend(1)->prepare(job_of(ball(), folder), std::atomic<bool>{}));
}

}  // namespace
}  // namespace ls::worker
