// Scenes in Nori's format are accepted like any others.
#include <gtest/gtest.h>

#include "coordinator/admission/admission.h"
#include "core/scene/schema/integrators.h"
#include "core/scene/schema/nori_integrators.h"
#include "formats/read.h"
#include "tests/unit/service/fake_farm.h"

namespace ls::coordinator {
namespace {

const std::string kNori = R"(<scene>
  <integrator type="vol_path_mis"/>
  <sampler type="independent"><integer name="sampleCount" value="16"/></sampler>
  <camera type="perspective">
    <integer name="width" value="40"/><integer name="height" value="24"/>
    <transform name="toWorld"><scale value="-1,1,1"/></transform>
  </camera>
  <mesh type="sphere"/>
  <emitter type="constant"/>
</scene>)";
const std::string kMitsuba = R"(<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective">
    <float name="fov" value="30"/><float name="near_clip" value="0.0001"/><float name="far_clip" value="10000"/>
    <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="24"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
  </sensor>
  <shape type="sphere"/>
  <emitter type="constant"/>
</scene>)";

TEST(Service, NoriSceneEqualsTheSameMitsubaScene) {
  auto coordinator = open_at({});
  const auto nori = admit({"a.xml", kNori, {}, {}}, coordinator->blobs(), scenes_in_this_process());
  const auto mitsuba = admit({"b.xml", kMitsuba, {}, {}}, coordinator->blobs(), scenes_in_this_process());

  ASSERT_TRUE(nori) << format_diagnostics(nori.error().diagnostics);
  ASSERT_TRUE(mitsuba);
  EXPECT_EQ(nori->job.scene, mitsuba->job.scene);
  EXPECT_EQ(nori->job.spp, 16u);
  EXPECT_TRUE(nori->job.warnings.empty());
}

TEST(Service, AcceptsNorisIntegratorNames) {
  auto coordinator = open_at({});
  for (const auto& row : scene::nori::integrators()) {
    if (scene::integrator_row(row.name)) continue;  // a name of both formats has Mitsuba's meaning
    JobSpec spec;
    spec.integrator = std::string(row.name);
    const auto taken = admit({"t.xml", kMitsuba, {}, spec}, coordinator->blobs(), scenes_in_this_process());
    ASSERT_TRUE(taken) << row.name << ": " << taken.error().error.message;
    EXPECT_EQ(taken->job.settings.integrator, row.ours) << row.name;
    EXPECT_EQ(taken->job.settings.max_depth, row.max_depth.value_or(-1)) << row.name;
  }
}

TEST(Service, RefusesAWrongSceneOfNoriWithItsPlace) {
  auto coordinator = open_at({});
  std::string text = kNori;
  text.replace(text.find("sphere"), 6, "spheer");

  const auto refused = coordinator->submit({"a.xml", text, {}, {}});

  ASSERT_FALSE(refused);
  ASSERT_EQ(refused.error().diagnostics.size(), 1u);
  EXPECT_EQ(refused.error().diagnostics[0].place.line, 8);
  EXPECT_EQ(refused.error().diagnostics[0].text, "Nori has no mesh \"spheer\"; did you mean 'sphere'?");
}

}  // namespace
}  // namespace ls::coordinator
