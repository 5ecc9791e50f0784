// Scenes that measure numbers: the sensors that are meters.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/image/frame/meter_blocks.h"
#include "core/scene/schema/validate.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string scene(std::string_view objects) {
  return fmt::format("<scene version=\"3.0.0\">\n{}\n</scene>\n", objects);
}
std::string in_rectangle(std::string_view sensor) {
  return scene(fmt::format("<shape type=\"rectangle\">\n{}\n</shape>", sensor));
}
std::string points(std::string_view type, std::string_view rows) {
  return scene(fmt::format("<sensor type=\"{}\" id=\"hall\"><string name=\"points\" value=\"{}\"/></sensor>",
                           type, rows));
}
std::string from_file(std::string_view type = "irradiancemeter") {
  return scene(fmt::format(
      "<sensor type=\"{}\" id=\"hall\"><string name=\"filename\" value=\"hall.csv\"/></sensor>", type));
}
ReadResult read_with_file(std::string_view text, std::string rows) {
  MemoryAssets assets;
  assets.files["hall.csv"] = std::move(rows);
  return read_scene("test.xml", text, assets, {});
}

TEST(Meters, StandInTheShapeThatTheyMeasure) {
  const Scene s = must_read(in_rectangle(R"(<sensor type="irradiancemeter" id="desk"/>)"));

  ASSERT_EQ(s.meters.size(), 1);
  EXPECT_EQ(s.meters[0].name, "desk");
  EXPECT_EQ(s.meters[0].kind, MeterKind::irradiance);
  EXPECT_TRUE(s.meters[0].points.empty());
  EXPECT_EQ(s.shapes[0].meter, MeterIndex{0});
  EXPECT_EQ(s.sensor.projection, Projection::meters);
  EXPECT_EQ(s.film.size, (FrameSize{kMeterSide, kMeterSide}));
  EXPECT_EQ(s.film.filter, ReconstructionFilter(BoxFilter{}));
}

TEST(Meters, LookAlongADirectionThatNeedNotBeNormalised) {
  const Scene s = must_read(scene(R"(<sensor type="radiancemeter">
    <point name="origin" x="1" y="2" z="3"/><vector name="direction" x="0" y="3" z="4"/></sensor>)"));

  EXPECT_EQ(s.meters[0].name, "meter1");
  EXPECT_EQ(s.meters[0].points, (std::vector<MeterPoint>{{{{1, 2, 3}}, {{0, .6, .8}}}}));
}

TEST(Meters, LookAlongTheZAxisOfToWorld) {
  const Scene s = must_read(scene(R"(<sensor type="radiancemeter"><transform name="to_world">
    <lookat origin="1, 0, 0" target="5, 0, 0" up="0, 0, 1"/></transform></sensor>)"));

  EXPECT_EQ(s.meters[0].points[0].position, (Vec3{{1, 0, 0}}));
  EXPECT_NEAR(s.meters[0].points[0].direction[0], 1, 1e-15);
}

TEST(Meters, ListsAreReadFromTextAndFromFiles) {
  const Scene listed = must_read(points("irradiancemeter", "0 0 1 0 0 2; 1,2,3, 0,-1,0")),
              filed = *read_with_file(from_file(),
                                      "x,y,z,nx,ny,nz\r\n# a comment\n0 0 1 0 0 2\n\n1,2,3,0,-1,0 # far\n")
                           .scene;

  EXPECT_EQ(listed, filed);
  EXPECT_EQ(listed.meters[0].points,
            (std::vector<MeterPoint>{{{{0, 0, 1}}, {{0, 0, 1}}}, {{{1, 2, 3}}, {{0, -1, 0}}}}));
  EXPECT_EQ(listed.film.size, (FrameSize{kMeterSide, 2 * kMeterSide}));
}

TEST(Meters, FilesMayBeginWithAByteOrderMark) {
  const auto r = read_with_file(from_file("fluencemeter"),
                                "\xef\xbb\xbf"
                                "1 2 3\n");

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_EQ(r.scene->meters[0].points[0].position, (Vec3{{1, 2, 3}}));
}

TEST(Meters, FluenceHasNoDirections) {
  const Scene s = must_read(points("fluencemeter", "0 0 1; 2 0 0"));

  EXPECT_EQ(s.meters[0].points, (std::vector<MeterPoint>{{{{0, 0, 1}}, {}}, {{{2, 0, 0}}, {}}}));
}

TEST(Meters, ABatchHoldsSeveral) {
  const Scene s = must_read(scene(R"(<sensor type="batch">
    <sensor type="irradiancemeter" id="a"><string name="points" value="0 0 0 0 0 1"/></sensor>
    <sensor type="radiancemeter" id="b"><string name="points" value="0 0 0 0 0 1"/></sensor>
    <film type="hdrfilm"><integer name="width" value="2"/><integer name="height" value="1"/></film>
    <sampler type="independent"><integer name="sample_count" value="64"/></sampler></sensor>)"));

  EXPECT_EQ(s.meters.size(), 2);
  EXPECT_EQ(s.sample_count, 64);
}

TEST(Meters, TheLargestNumberOfSamplesCounts) {
  const auto sensor = [](int n) {
    return fmt::format(R"(<sensor type="radiancemeter"><string name="points" value="0 0 0 0 0 1"/>
      <sampler type="independent"><integer name="sample_count" value="{}"/></sampler></sensor>)",
                       n);
  };

  EXPECT_EQ(must_read(scene(sensor(2))).sample_count, 2);
  EXPECT_EQ(must_read(scene(sensor(2) + sensor(8) + sensor(6))).sample_count, 8);
}

TEST(Meters, ScenesWithMetersAreTheSameWhenWrittenAndRead) {
  const Scene s = must_read(scene(R"(
    <medium type="homogeneous" id="haze"/>
    <sensor type="radiancemeter" id="beam"><string name="points" value="0 0 1 1 2 3; 0 1 1 0.3 0.1 0.7"/>
      <ref id="haze"/></sensor>
    <sensor type="fluencemeter" id="air"><string name="points" value="0 0 1"/></sensor>
    <shape type="sphere"><sensor type="fluxmeter" id="ball"/></shape>
    <shape type="rectangle"><sensor type="irradiancemeter" id="desk"/></shape>)"));

  EXPECT_EQ(s.meters[0].name, "ball");  // those on shapes come first, in the order of the shapes
  EXPECT_EQ(s.meters[2].name, "beam");
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(deserialize_scene(serialize(s)), s);
}

TEST(Meters, FramesHaveABlockForEach) {
  for (const std::size_t n : {1u, 2u, 97u, 2048u, 2049u, 100'000u}) {
    const MeterBlocks blocks(n);
    const FrameSize frame = blocks.frame();

    EXPECT_LE(frame.height, kMaxFrameSide);
    EXPECT_LE(frame.pixels(), static_cast<std::size_t>(kMaxFramePixels));
    for (const std::size_t i : {std::size_t{0}, n / 2, n - 1}) {
      const PixelRect r = blocks.rect(i);
      EXPECT_TRUE(lies_in(frame, r)) << n << " " << i;
      EXPECT_EQ(blocks.at(r.x0, r.y0), i);
      EXPECT_EQ(blocks.at(r.x1 - 1, r.y1 - 1), i);
    }
    EXPECT_EQ(blocks.at(frame.width - 1, frame.height - 1), n - 1);
  }
}

struct Refused {
  std::string text;
  std::string_view part;
};

TEST(Meters, WrongOnesAreErrorsThatSayWhatToDo) {
  const std::string desk = R"(<sensor type="irradiancemeter"/>)";
  const Refused cases[] = {
      {with_sensor("<sensor type=\"fluencemeter\"><string name=\"points\" value=\"0 0 0\"/></sensor>"),
       "a camera and a meter (line 2) in one scene"},
      {scene(desk), "needs an origin and a direction, a to_world, or a list of points in 'points'"},
      {scene(R"(<sensor type="fluxmeter"/>)"), "a fluxmeter stands in the shape that it measures"},
      {in_rectangle(desk + desk), "has a second sensor"},
      {in_rectangle(R"(<sensor type="radiancemeter"/>)"),
       "measures at points: place it outside of the shape"},
      {in_rectangle(R"(<sensor type="irradiancemeter"><string name="points" value="0 0 0 0 0 1"/></sensor>)"),
       "measures the shape or points, not both"},
      {in_rectangle(R"(<sensor type="perspective"/>)"), "stands in no shape"},
      {in_rectangle(R"(<sensor type="irradiancemeters"/>)"), "did you mean 'irradiancemeter'?"},
      {scene("<shape type=\"shapegroup\" id=\"g\"><shape type=\"cube\">" + desk +
             "</shape></shape>"
             "<shape type=\"instance\"><ref id=\"g\"/></shape>"),
       "in a shapegroup can't be measured"},
      {points("radiancemeter", "0 0 0 0 0 0"), "row 1: nx, ny, nz have no direction"},
      {points("radiancemeter", "0 0 0 0 0 1; 0 0 nan 0 0 1"), "row 2: a row has 6 finite numbers"},
      {points("radiancemeter", "0 0 0 0 0"), "row 1: a row has 6 numbers, x y z nx ny nz, and this one 5"},
      {points("fluencemeter", "0 0 0 0 0 1"), "row 1: a row has 3 numbers, x y z, and this one 6"},
      {points("radiancemeter", " ; "), "has no points"},
      {points("fluxmeter", "0 0 0 0 0 1"), "a fluxmeter stands in the shape"},
      {scene(R"(<sensor type="radiancemeter"><point name="origin" x="0" y="0" z="0"/>
         <vector name="direction" x="0" y="0" z="0"/></sensor>)"),
       "has a direction of length 0"},
      {scene(R"(<sensor type="radiancemeter"><point name="origin" x="0" y="0" z="0"/></sensor>)"),
       "needs an origin and a direction"},
      {scene(R"(<sensor type="radiancemeter"><transform name="to_world"/>
         <vector name="direction" x="0" y="0" z="1"/></sensor>)"),
       "gives both to_world and origin or direction"},
      {scene(R"(<sensor type="radiancemeter"><string name="points" value="0 0 0 0 0 1"/>
         <string name="filename" value="hall.csv"/></sensor>)"),
       "both points and filename"},
      {scene(R"(<sensor type="batch"><sensor type="perspective"/></sensor>)"),
       "a batch can only hold meters"},
      {scene(R"(<sensor type="batch"/>)"), "this batch has no sensors"},
      {scene(
           R"(<integrator type="aov"><string name="aovs" value="d:depth"/><integrator type="path"/></integrator>
         <sensor type="radiancemeter"><string name="points" value="0 0 0 0 0 1"/></sensor>)"),
       "AOVs belong to an image"},
      {from_file(), "there is no file \"hall.csv\""},
  };
  for (const auto& [text, part] : cases) {
    const auto r = read(text);

    EXPECT_FALSE(r.scene) << text;
    EXPECT_THAT(messages(r), HasSubstr(part)) << text;
    for (const Diagnostic& d : r.diagnostics) EXPECT_GT(d.place.line, 0) << text;
  }
}

TEST(Meters, AWrongRowOfAFileIsAnErrorInItsLine) {
  const std::pair<std::string, std::string> cases[] = {
      {"0 0 0 0 0 1\n# two\n1 2 3\n",
       "hall.csv:3:1: error: a row has 6 numbers, x y z nx ny nz, and this one 3"},
      {"x y z nx ny nz\n0 0 0 0 0 0\n", "hall.csv:2:1: error: nx, ny, nz have no direction"},
      {"nan 0 0 0 0 1\n", "hall.csv:1:1: error: a row has 6 finite numbers"},
      {"0 0 0 0 0 1\n1e999 0 0 0 0 1\n", "hall.csv:2:1: error: a row has 6 finite numbers"},
      {"x y z\nx y z\n", "hall.csv:2:1: error: a row has 6 finite numbers"},
      {"# nothing\n", "\"hall.csv\" has no rows"},
      {"", "\"hall.csv\" has no rows"},
  };
  for (const auto& [rows, message] : cases)
    EXPECT_THAT(messages(read_with_file(from_file(), rows)), HasSubstr(message)) << rows;
}

TEST(Meters, AHundredThousandPointsAreTheMost) {
  std::string rows;
  for (int i = 0; i < kMaxMeters; ++i) rows += "0 0 0 0 0 1\n";

  EXPECT_EQ(read_with_file(from_file(), rows).scene->meters[0].count(), 100'000);
  EXPECT_THAT(messages(read_with_file(from_file(), rows + "0 0 0 0 0 1\n")),
              HasSubstr("hall.csv:100001:1: error: more than 100000 points"));
  EXPECT_THAT(messages(read_with_file(
                  scene(R"(<sensor type="irradiancemeter"><string name="filename" value="hall.csv"/></sensor>
                           <sensor type="fluencemeter"><string name="points" value="0 0 0"/></sensor>)"),
                  rows)),
              HasSubstr("have more than 100000 points"));
}

TEST(Meters, InconsistentOnesAreRefusedInJson) {
  const Scene good = must_read(points("irradiancemeter", "0 0 0 0 0 1"));
  const auto problem = [&](const auto& change) {
    Scene s = good;
    change(s);
    return scene::find_inconsistency(s);
  };

  EXPECT_EQ(scene::find_inconsistency(good), "");
  EXPECT_THAT(problem([](Scene& s) { s.film.size = {16, 17}; }), HasSubstr("scene.film is not that"));
  EXPECT_THAT(problem([](Scene& s) { s.film.filter = TentFilter{}; }), HasSubstr("scene.film is not that"));
  EXPECT_THAT(problem([](Scene& s) { s.sensor = {}; }), HasSubstr("scene.sensor is not that of meters"));
  EXPECT_THAT(problem([](Scene& s) { s.meters.clear(); }), HasSubstr("scene.sensor is not that of meters"));
  EXPECT_THAT(problem([](Scene& s) { s.meters[0].points.clear(); }), HasSubstr("has not either points"));
  EXPECT_THAT(problem([](Scene& s) { s.meters[0].kind = MeterKind::flux; }), HasSubstr("without a shape"));
  EXPECT_THAT(problem([](Scene& s) {
                s.meters[0].points[0].direction = {{0, 0, 2}};
              }),
              HasSubstr("not of unit length"));
  EXPECT_THAT(problem([](Scene& s) { s.meters[0].medium = MediumIndex{7}; }),
              HasSubstr("refers to object 7"));
}

}  // namespace
}  // namespace ls
