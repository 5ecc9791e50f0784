// Reading the emission of media.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

std::string medium(const std::string& type, const std::string& inside) {
  return with_sensor(
      "<medium type=\"" + type + "\" id=\"m\">" + inside +
      "</medium><shape type=\"cube\"><bsdf type=\"null\"/><ref name=\"interior\" id=\"m\"/></shape>");
}
std::string number(const char* name, const char* value) {
  return std::string("<float name=\"") + name + "\" value=\"" + value + "\"/>";
}

TEST(Emission, HomogeneousMediumEmitsByLengthAndAbsorption) {
  const Scene s = must_read(
      medium("homogeneous", "<rgb name=\"emission\" value=\"1 2 3\"/>" + number("source_radiance", "4")));
  const auto& m = std::get<HomogeneousMedium>(s.media.at(0));
  EXPECT_EQ(m.emission, (Rgb{1, 2, 3}));
  EXPECT_EQ(m.source_radiance, (Rgb{4, 4, 4}));
  EXPECT_EQ(must_read(write_xml(s)), s);
}

TEST(Emission, HeterogeneousMediumHasAnEmissionVolume) {
  const Scene s = must_read(medium("heterogeneous",
                                   "<volume type=\"gridvolume\" name=\"temperature\"><string "
                                   "name=\"filename\" value=\"cloud.vol\"/></volume>" +
                                       number("temperature_scale", "1000") +
                                       number("temperature_offset", "-20") + number("emission_scale", "7")));
  const auto& m = std::get<HeterogeneousMedium>(s.media.at(0));
  ASSERT_TRUE(m.temperature);
  EXPECT_TRUE(std::holds_alternative<GridVolume>(s.volumes.at(m.temperature->value)));
  EXPECT_EQ(m.temperature_scale, 1000);
  EXPECT_EQ(m.temperature_offset, -20);
  EXPECT_EQ(m.emission_scale, 7);
  EXPECT_FALSE(m.emission || m.source_radiance);
  EXPECT_EQ(must_read(write_xml(s)), s);
}

TEST(Emission, ContradictoryParametersAreRefused) {
  const struct {
    std::string type, inside, said;
  } rows[] = {
      {"heterogeneous", number("emission", "1") + number("temperature", "1"),
       "gives more than one of emission, source_radiance and temperature"},
      {"heterogeneous", number("emission", "1") + number("temperature_scale", "1"),
       "gives temperature_scale or temperature_offset, but no temperature"},
      {"heterogeneous", number("emission_scale", "2"), "gives emission_scale, but none of"},
      {"heterogeneous", "<rgb name=\"temperature\" value=\"1 2 3\"/>", "is one number, not a colour"},
      {"heterogeneous", number("emission", "-1"), "emission"},
      {"homogeneous", number("emission", "-1"), "emission"},
      {"homogeneous", number("temperature", "1000"), "has no parameter 'temperature'"},
      {"homogeneous",
       "<volume type=\"gridvolume\" name=\"emission\"><string name=\"filename\" "
       "value=\"cloud.vol\"/></volume>",
       "only a constvolume will do"},
  };
  for (const auto& row : rows) {
    const auto r = read(medium(row.type, row.inside));
    EXPECT_FALSE(r.scene) << row.inside;
    ASSERT_FALSE(r.diagnostics.empty()) << row.inside;
    EXPECT_EQ(r.diagnostics[0].place.line, 2) << row.inside;
    EXPECT_THAT(r.diagnostics[0].text, HasSubstr(row.said));
  }
}

TEST(Emission, ConstantDensityOfVersion0CannotEmit) {
  const auto r = read(
      "<scene version=\"0.5.0\"><medium type=\"heterogeneous\"><volume type=\"constvolume\" name=\"density\">"
      "<float name=\"value\" value=\"2\"/></volume><volume type=\"constvolume\" name=\"albedo\"><spectrum "
      "name=\"value\" value=\".5\"/></volume><float name=\"emission\" value=\"1\"/></medium>" +
      kSensor + "</scene>");
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("write it as a medium \"homogeneous\" to give it an emission"));
}

TEST(RawGrid, OnlyRawGridsHaveAnOrder) {
  MemoryAssets assets;
  assets.files.emplace("smoke.bin", "s");
  const auto volume = [&](const std::string& file, const std::string& inside) {
    return read_scene("test.xml",
                      with_sensor("<medium type=\"heterogeneous\" id=\"m\"><volume type=\"gridvolume\" "
                                  "name=\"sigma_t\"><string name=\"filename\" value=\"" +
                                  file + "\"/>" + inside +
                                  "</volume></medium><shape type=\"cube\"><bsdf type=\"null\"/><ref "
                                  "name=\"interior\" id=\"m\"/></shape>"),
                      assets, {});
  };
  const std::string order = "<string name=\"order\" value=\"z_fastest\"/>";
  const auto raw = volume("smoke.bin", order);
  ASSERT_TRUE(raw.scene) << messages(raw);
  const auto& m = std::get<HeterogeneousMedium>(raw.scene->media.at(0));
  EXPECT_EQ(std::get<GridVolume>(raw.scene->volumes.at(m.sigma_t.value)).order, GridOrder::z_fastest);
  EXPECT_THAT(write_xml(*raw.scene), HasSubstr(order));
  EXPECT_THAT(messages(volume("cloud.vol", order)), HasSubstr("'order' is of .bin files"));
  EXPECT_THAT(messages(volume("smoke.bin", "<string name=\"wrap_mode\" value=\"repeat\"/>")),
              HasSubstr("'wrap_mode' can only be clamp"));
}

TEST(ConstVolume, IsMovedByItsTransform) {
  const std::string text = R"(<medium type="heterogeneous" id="m"><volume type="constvolume" name="sigma_t">
    <float name="value" value="3"/><transform name="to_world"><translate x="-0.5"/></transform></volume></medium>
    <shape type="cube"><bsdf type="null"/><ref name="interior" id="m"/></shape>)";
  const auto r = read(with_sensor(text));
  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_TRUE(quiet(r)) << messages(r);
  const auto& m = std::get<HeterogeneousMedium>(r.scene->media.at(0));
  const auto& v = std::get<ConstVolume>(r.scene->volumes.at(m.sigma_t.value));
  EXPECT_EQ(v.to_world.m[3], -.5);
  EXPECT_EQ(must_read(write_xml(*r.scene)), *r.scene);
}

TEST(ConstVolume, FlattenedVolumeIsRefused) {
  const auto r = read(with_sensor(
      R"(<volume type="constvolume" id="v"><transform name="to_world"><scale x="0"/></transform></volume>)"));
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("to_world flattens this volume"));
}

}  // namespace
}  // namespace ls
