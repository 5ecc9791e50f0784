// Compares the table of Mitsuba's plugins with the result of reading each plugin.
#include "common/scene/schema/mitsuba_plugins.h"

#include <gtest/gtest.h>

#include <set>

#include "common/scene/schema/describe_fields.h"
#include "common/scene/schema/integrators.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls::scene {
namespace {

// Returns a scene with the plugin in an element that may contain it.
std::string scene_with(const PluginRow& row) {
  const std::string object = fmt::format("<{} type=\"{}\"/>", row.tag, row.name);
  const auto sensor = [](std::string_view inside) {
    return fmt::format("<scene version=\"3.0.0\"><sensor type=\"perspective\">{}</sensor></scene>", inside);
  };
  if (row.tag == "sensor") return fmt::format("<scene version=\"3.0.0\">{}</scene>", object);
  if (row.tag == "film" || row.tag == "sampler") return sensor(object);
  if (row.tag == "rfilter") return sensor(fmt::format("<film type=\"hdrfilm\">{}</film>", object));
  if (row.tag == "emitter" && row.name.ends_with("area"))
    return with_sensor(fmt::format("<shape type=\"sphere\">{}</shape>", object));
  return with_sensor(object);
}

TEST(MitsubaPlugins, AreReadOrRefusedForTheirReason) {
  for (const PluginRow& row : mitsuba_plugins()) {
    const ReadResult r = read(scene_with(row));

    const std::string said = messages(r);
    const std::string refusal =
        fmt::format("the {} \"{}\" is not supported: {}", row.tag, row.name, row.note);
    if (row.standing == Standing::refused) {
      EXPECT_NE(said.find(refusal), std::string::npos) << said;
      EXPECT_FALSE(r.scene) << row.name;
    } else {
      EXPECT_EQ(said.find("is not supported"), std::string::npos) << said;
      EXPECT_EQ(said.find("there is no "), std::string::npos) << said;
    }
  }
}

TEST(MitsubaPlugins, SayWhatIsLeftOutAndWhatToUseInstead) {
  std::set<std::pair<std::string_view, std::string_view>> seen;
  for (const PluginRow& row : mitsuba_plugins()) {
    EXPECT_TRUE(row.standing == Standing::read || !row.note.empty()) << row.name;
    EXPECT_TRUE(seen.emplace(row.tag, row.name).second) << row.tag << " " << row.name << " stands twice";
  }
}

template <class Variant>
void expect_all_read(std::string_view tag, std::set<std::string_view> internal = {}) {
  for (const std::string_view name : kKindsOf<Variant>)
    EXPECT_NE(internal.contains(name), is_read_plugin(tag, name)) << tag << " " << name;
}

TEST(MitsubaPlugins, ListAllThatTheReaderKnows) {
  expect_all_read<Bsdf>("bsdf");
  expect_all_read<Texture>("texture", {"constant"});  // in files it is a colour
  expect_all_read<Emitter>("emitter");
  expect_all_read<Medium>("medium");
  expect_all_read<Phase>("phase");
  expect_all_read<Volume>("volume");
  expect_all_read<Geometry>("shape", {"mesh"});  // in files it is named by its format
  expect_all_read<ReconstructionFilter>("rfilter");
  for (const IntegratorRow& row : integrators())
    EXPECT_TRUE(is_read_plugin("integrator", row.name)) << row.name;
  for (const WrapperRow& row : integrator_wrappers())
    EXPECT_TRUE(is_read_plugin("integrator", row.name)) << row.name;
}

// The default max_depth of Mitsuba 3's differentiable integrators is 6.
TEST(MitsubaPlugins, HaveMitsubasDefaultDepth) {
  const auto depth = [](const std::string& integrator) {
    return must_read(with_sensor(integrator)).integrator.max_depth;
  };
  for (const char* type : {"prb", "prb_basic", "prb_projective", "prbvolpath"}) {
    EXPECT_EQ(depth(fmt::format("<integrator type=\"{}\"/>", type)), 6);
    EXPECT_EQ(depth(fmt::format(
                  "<integrator type=\"{}\"><integer name=\"max_depth\" value=\"-1\"/></integrator>", type)),
              -1);
  }
  EXPECT_EQ(depth("<integrator type=\"path\"/>"), -1);
  EXPECT_EQ(depth("<integrator type=\"direct_projective\"/>"), 2);
}

}  // namespace
}  // namespace ls::scene
