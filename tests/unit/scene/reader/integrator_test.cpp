// Reading and writing of the integrator's parameters.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string integrator(const std::string& type, const std::string& inside) {
  return with_sensor("<integrator type=\"" + type + "\">" + inside + "</integrator>");
}

TEST(Integrator, DistantMisKeepsItsSettingsInARoundTrip) {
  const IntegratorSettings plain = must_read(integrator("volpath_distant_mis", "")).integrator;
  EXPECT_EQ(plain.distance, DistanceSampling::mis);
  EXPECT_EQ(plain.heuristic, MisHeuristic::power);
  const Scene s = must_read(
      integrator("volpath_distant_mis",
                 "<string name=\"distance\" value=\"equiangular\"/>"
                 "<string name=\"heuristic\" value=\"balance\"/><integer name=\"max_depth\" value=\"3\"/>"));
  EXPECT_EQ(s.integrator.distance, DistanceSampling::equiangular);
  EXPECT_EQ(s.integrator.heuristic, MisHeuristic::balance);
  EXPECT_EQ(s.integrator.max_depth, 3);
  EXPECT_EQ(serialize(must_read(write_xml(s))), serialize(s));
  EXPECT_NE(
      digest_of(s),
      digest_of(must_read(integrator("volpath_distant_mis", "<integer name=\"max_depth\" value=\"3\"/>"))));
}

TEST(Integrator, OtherIntegratorsRefuseParametersTheyWouldIgnore) {
  for (const char* type : {"volpath", "path", "volpathmis"}) {
    for (const char* name : {"distance", "heuristic"}) {
      const auto r = read(integrator(type, std::string("<string name=\"") + name + "\" value=\"mis\"/>"));
      EXPECT_FALSE(r.scene);
      ASSERT_FALSE(r.diagnostics.empty());
      EXPECT_EQ(r.diagnostics[0].place.line, 2);
      EXPECT_THAT(r.diagnostics[0].text,
                  HasSubstr("a parameter of the integrator \"volpath_distant_mis\" alone"));
    }
    EXPECT_THAT(write_xml(must_read(integrator(type, ""))), ::testing::Not(HasSubstr("\"distance\"")));
  }
}

TEST(Integrator, VolpathKeepsItsSettingsInARoundTrip) {
  const Scene plain = must_read(integrator("volpath", ""));
  EXPECT_EQ(plain.integrator.camera_points, 0);
  EXPECT_FALSE(plain.integrator.phase_only);
  // Scenes that do not use these parameters must keep the digests that they had without them.
  EXPECT_THAT(serialize(plain), ::testing::Not(HasSubstr("camera_points")));
  const Scene s = must_read(integrator(
      "volpath",
      "<integer name=\"camera_points\" value=\"-1\"/><boolean name=\"phase_only\" value=\"true\"/>"));
  EXPECT_EQ(s.integrator.camera_points, -1);
  EXPECT_TRUE(s.integrator.phase_only);
  EXPECT_EQ(serialize(must_read(write_xml(s))), serialize(s));
  EXPECT_NE(digest_of(s), digest_of(plain));
  for (const char* value : {"-2", "65"})
    EXPECT_FALSE(
        read(integrator("volpath", std::string("<integer name=\"camera_points\" value=\"") + value + "\"/>"))
            .scene);
}

TEST(Integrator, OtherIntegratorsRefuseVolpathsParameters) {
  for (const char* type : {"volpath_distant_mis", "path"})
    for (const char* parameter :
         {"<integer name=\"camera_points\" value=\"3\"/>", "<boolean name=\"phase_only\" value=\"true\"/>"}) {
      const auto r = read(integrator(type, parameter));
      EXPECT_FALSE(r.scene);
      ASSERT_FALSE(r.diagnostics.empty());
      EXPECT_EQ(r.diagnostics[0].place.line, 2);
      EXPECT_THAT(r.diagnostics[0].text, HasSubstr("a parameter of the integrator \"volpath\" alone"));
    }
  const char* reuse = "<integer name=\"path_reuse\" value=\"8\"/>";
  EXPECT_THAT(messages(read(integrator("whitted", reuse))),
              HasSubstr("'path_reuse' is a parameter of the integrators \"volpath\" and \"path\" alone"));
  const Scene path = must_read(integrator("path", reuse));
  EXPECT_EQ(path.integrator.path_reuse, 8);
  EXPECT_EQ(serialize(must_read(write_xml(path))), serialize(path));
}

TEST(Integrator, ErrorListsTheKnownSettings) {
  const auto r = read(integrator("volpath_distant_mis", "<string name=\"distance\" value=\"equi\"/>"));
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("equiangular"));
}

}  // namespace
}  // namespace ls
