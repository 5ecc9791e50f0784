// Nori files whose root is a <test>.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/reader/nori_test.h"
#include "tests/unit/scene/nori_testing.h"

namespace ls {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

NoriTestResult read_test(const std::string& text) {
  MemoryAssets assets;
  return read_nori_test("test.xml", text, assets);
}
std::string told(const std::string& text) { return format_diagnostics(read_test(text).diagnostics); }

TEST(NoriTest, SceneTestContainsScenesAndReferences) {
  const std::string text = fmt::format(R"(<?xml version="1.0"?>
<test type="ttest"><string name="references" value="2,
    5"/><float name="significanceLevel" value="0.05"/><integer name="sampleCount" value="1000"/>
  <scene><mesh type="sphere"/>{0}</scene><scene><shape type="obj"><string name="filename" value="mesh.obj"/></shape>{0}</scene></test>)",
                                       kNoriCamera);

  const auto r = read_test(text);

  ASSERT_TRUE(r.test) << format_diagnostics(r.diagnostics);
  EXPECT_EQ(r.test->kind, NoriTestKind::t_test);
  EXPECT_THAT(r.test->references, ElementsAre(2, 5));
  EXPECT_EQ(r.test->significance_level, .05);
  EXPECT_EQ(r.test->sample_count, 1000u);
  ASSERT_EQ(r.test->scenes.size(), 2u);
  EXPECT_EQ(r.test->scenes[0], must_read(nori_scene("<mesh type=\"sphere\"/>")));
  EXPECT_EQ(r.test->scenes[1].assets.size(), 1u);
}

TEST(NoriTest, BsdfTestPutsEachOnAShape) {
  const auto r = read_test(
      R"(<test type="ttest"><string name="angles" value="0 30 80"/><string name="references" value=".5 .5 .5 1 1 1"/>
    <bsdf type="diffuse"/><bsdf type="mirror"/></test>)");
  ASSERT_TRUE(r.test) << format_diagnostics(r.diagnostics);
  EXPECT_EQ(r.test->sample_count, 100000u);
  EXPECT_EQ(r.test->significance_level, .01);
  ASSERT_EQ(r.test->bsdfs.size(), 2u);
  const Scene& s = r.test->bsdfs[1];
  EXPECT_TRUE(std::holds_alternative<ConductorBsdf>(s.bsdfs[s.shapes[0].bsdf.value]));
}

TEST(NoriTest, DistributionTestHasItsOwnSettings) {
  const auto r = read_test(
      R"(<test type="chi2test"><integer name="resolution" value="20"/><integer name="testCount" value="7"/>
    <float name="minExpFrequency" value="4"/><bsdf type="microfacet"/></test>)");
  ASSERT_TRUE(r.test) << format_diagnostics(r.diagnostics);
  EXPECT_EQ(r.test->kind, NoriTestKind::chi2_test);
  EXPECT_EQ(r.test->resolution, 20);
  EXPECT_EQ(r.test->test_count, 7);
  EXPECT_EQ(r.test->min_expected, 4);
  EXPECT_EQ(r.test->sample_count, 0u);
}

TEST(NoriTest, ErrorsNameTheProblem) {
  EXPECT_THAT(told(R"(<test type="tttest"/>)"),
              HasSubstr("1:13: error: Nori has no test \"tttest\"; did you mean 'ttest'?"));
  EXPECT_THAT(told(R"(<test type="ttest"/>)"), HasSubstr("nothing stands in this test"));
  EXPECT_THAT(told(fmt::format(
                  R"(<test type="ttest"><string name="references" value="1 2"/><scene>{}</scene></test>)",
                  kNoriCamera)),
              HasSubstr("2 references are given for 1 scenes"));
  EXPECT_THAT(told(R"(<test type="ttest"><bsdf type="diffuse"/></test>)"), HasSubstr("no angles are given"));
  EXPECT_THAT(told(R"(<test type="ttest"><string name="references" value="1 x"/></test>)"),
              HasSubstr("wants up to 1000 numbers"));
  EXPECT_THAT(told(R"(<test type="chi2test"><scene/></test>)"), HasSubstr("has no use for a <scene>"));
  EXPECT_THAT(told(R"(<test type="ttest"><float name="significanceLevel" value="1"/></test>)"),
              HasSubstr("out of its range"));
  EXPECT_THAT(told(nori_scene("")), HasSubstr("this is no test"));
  EXPECT_FALSE(read_test("no xml").test);
}

}  // namespace
}  // namespace ls
