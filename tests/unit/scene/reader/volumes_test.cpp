// Volumes without a file, in files of Mitsuba's format.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/analysis/needs.h"
#include "core/scene/json/serialize.h"
#include "core/scene/limits.h"
#include "core/scene/schema/validate.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using testing::HasSubstr;

std::string in_medium(const std::string& parts) {
  return with_sensor("<shape type=\"cube\"><medium name=\"interior\" type=\"heterogeneous\">\n" + parts +
                     "</medium></shape>");
}
std::string density(const std::string& type, const std::string& parameters) {
  return in_medium("<volume name=\"sigma_t\" type=\"" + type + "\">\n" + parameters + "</volume>");
}
Volume density_of(const Scene& s) {
  return s.volumes.at(std::get<HeterogeneousMedium>(s.media.at(0)).sigma_t.value);
}
// The density that the file becomes, which writing and reading again must keep.
Volume must_read_density(const std::string& file) {
  const Scene s = must_read(file);
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(*deserialize_scene(serialize(s)), s);
  EXPECT_EQ(scene::find_inconsistency(s), "");
  return density_of(s);
}

TEST(VolumesWithoutFile, AreReadWithTheirParametersAndDefaults) {
  EXPECT_EQ(must_read_density(density("heightfog", "")), Volume(HeightFogVolume{}));
  HeightFogVolume fog;
  fog.value = .2;
  fog.height = 12;
  fog.ground_point = {1, 2, 3};
  fog.ground_normal = {0, 0, 4};
  EXPECT_EQ(
      must_read_density(density("heightfog",
                                "<float name=\"value\" value=\".2\"/><float name=\"height\" value=\"12\"/>"
                                "<point name=\"ground_point\" x=\"1\" y=\"2\" z=\"3\"/>"
                                "<vector name=\"ground_normal\" x=\"0\" y=\"0\" z=\"4\"/>")),
      Volume(fog));
  EXPECT_EQ(must_read_density(density("noise", "")), Volume(NoiseVolume{}));
  NoiseVolume noise;
  noise.octaves = 7;
  noise.seed = 11;
  noise.low = -1;
  noise.max = {2, 3, 4};
  noise.to_world.m[3] = 5;
  EXPECT_EQ(must_read_density(
                density("noise",
                        "<integer name=\"octaves\" value=\"7\"/><integer name=\"seed\" value=\"11\"/>"
                        "<float name=\"low\" value=\"-1\"/><point name=\"max\" x=\"2\" y=\"3\" z=\"4\"/>"
                        "<transform name=\"to_world\"><translate x=\"5\"/></transform>")),
            Volume(noise));
  EXPECT_EQ(must_read_density(density("cloud", "")), Volume(CloudVolume{}));
}

TEST(VolumesWithoutFile, ContainOthers) {
  const Scene s = must_read(
      in_medium("<volume name=\"sigma_t\" type=\"product\"><volume name=\"first\" type=\"heightfog\"/>"
                "<volume name=\"second\" type=\"remap\"><volume name=\"volume\" type=\"noise\"/>"
                "<string name=\"positions\" value=\"0, .5, 1\"/><string name=\"values\" value=\"0 0 2\"/>"
                "<float name=\"in_low\" value=\".2\"/></volume></volume>"));
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(*deserialize_scene(serialize(s)), s);
  const Volume read_density = density_of(s);
  const auto& product = std::get<ProductVolume>(read_density);
  EXPECT_TRUE(std::holds_alternative<HeightFogVolume>(s.volumes[product.first.value]));
  const auto& remap = std::get<RemapVolume>(s.volumes[product.second.value]);
  EXPECT_TRUE(std::holds_alternative<NoiseVolume>(s.volumes[remap.volume.value]));
  EXPECT_EQ(remap.positions, (std::vector<double>{0, .5, 1}));
  EXPECT_EQ(remap.values, (std::vector<double>{0, 0, 2}));
  EXPECT_EQ(remap.in_low, .2);

  const Scene numbers = must_read(density("product",
                                          "<float name=\"first\" value=\"3\"/>"
                                          "<volume name=\"second\" type=\"cloud\"/>"));
  EXPECT_EQ(must_read(write_xml(numbers)), numbers);
  // A factor that is left out is 1.
  EXPECT_TRUE(read(density("product", "<volume name=\"second\" type=\"cloud\"/>")).scene);
}

TEST(VolumesWithoutFile, SceneSaysWhatItNeeds) {
  const auto fog = scene::needs_of(must_read(density("heightfog", "")), true);
  EXPECT_TRUE(fog.height);
  EXPECT_FALSE(fog.grids);
  EXPECT_TRUE(fog.volumes.empty());
  const auto noise = scene::needs_of(must_read(density("noise", "")), true);
  EXPECT_FALSE(noise.height);
  EXPECT_TRUE(noise.grids);
  EXPECT_EQ(noise.volumes.at("noise"), 1u);
  EXPECT_FALSE(noise.density_files);
}

TEST(VolumesWithoutFile, AreRefusedWithTheirPlace) {
  const auto positions = [](const std::string& at, const std::string& values) {
    return density("remap", "<volume name=\"volume\" type=\"noise\"/>\n<string name=\"positions\" value=\"" +
                                at + "\"/>\n<string name=\"values\" value=\"" + values + "\"/>");
  };
  std::string many = "0", ones = "1";
  for (std::size_t i = 1; i <= scene::kMaxRampPoints; ++i) {
    many += fmt::format(" {}", static_cast<double>(i) / 100);
    ones += " 1";
  }
  const struct {
    std::string file, said;
  } rows[] = {
      {density("noise", "<integer name=\"octaves\" value=\"1000000000\"/>"),
       "'octaves' of volume \"noise\" is 1000000000, out of its range 1 <= octaves <= 16"},
      {density("noise", "<integer name=\"octaves\" value=\"0\"/>"), "1 <= octaves"},
      {density("noise", "<float name=\"octaves\" value=\"2.5\"/>"), "wants an <integer>"},
      {density("noise", "<float name=\"scale\" value=\"nan\"/>"), "wants a <float>"},
      {density("noise", "<float name=\"scale\" value=\"0\"/>"), "0 < scale"},
      {density("noise", "<float name=\"lacunarity\" value=\"1e9\"/>"), "1 <= lacunarity <= 8"},
      {density("noise", "<float name=\"gain\" value=\"1.5\"/>"), "0 <= gain <= 1"},
      {density("noise", "<float name=\"octave\" value=\"1\"/>"), "did you mean 'octaves'?"},
      {density("noise", "<point name=\"max\" x=\"1\" y=\"0\" z=\"1\"/>"),
       "'max' of volume \"noise\" is not above 'min' along y"},
      {density("noise", "<transform name=\"to_world\"><scale x=\"0\"/></transform>"), "can't be inverted"},
      {density("heightfog", "<float name=\"height\" value=\"0\"/>"), "0 < height"},
      {density("heightfog", "<float name=\"value\" value=\"-1\"/>"), "0 <= value"},
      {density("heightfog", "<vector name=\"ground_normal\" x=\"0\" y=\"0\" z=\"0\"/>"), "has no direction"},
      {positions("0 .5, , 1", "0 1 2"), "'positions' of volume \"remap\" has a hole: number 3 is missing"},
      {positions("0 .5 1", "0 nan 2"),
       "'values' of volume \"remap\" wants finite numbers, but number 2 is \"nan\""},
      {positions("0 .5 1", "0 1"), "'values' of volume \"remap\" has 2 numbers, and 'positions' 3"},
      {positions("0 .5 .5", "0 1 2"),
       "'positions' of volume \"remap\" must ascend: number 3 is 0.5 after 0.5"},
      {positions("0 .5 2", "0 1 2"), "out of its range 0 <= positions <= 1"},
      {positions("0", "1"), "has 1 numbers; 2 to 64 are wanted"},
      {positions(many, ones), "has 65 numbers; 2 to 64 are wanted"},
      {density("remap", "<volume name=\"volume\" type=\"noise\"/>\n<float name=\"in_high\" value=\"0\"/>"),
       "'in_high' of volume \"remap\" is not above 'in_low': 0 and 0"},
      {density("remap", "<volume name=\"volume\" type=\"noise\"/>\n<float name=\"gamma\" value=\"0\"/>"),
       "0 < gamma"},
      {density("product", "<volume name=\"second\" type=\"noise\"/>\n<rgb name=\"first\" value=\"1 2 3\"/>"),
       "'first' of volume \"product\" is one number, not a colour"},
      {density("remap", ""), "volume \"remap\" needs"},
      {density("product", "<volume name=\"second\" type=\"heightfog\"/>"),
       "'sigma_t' of medium \"heterogeneous\" has no box"},
      {in_medium("<volume name=\"sigma_t\" type=\"heightfog\"/>\n<float name=\"emission\" value=\"1\"/>"),
       "'emission' of medium \"heterogeneous\" has no end in a \"heightfog\""},
      {in_medium("<volume name=\"sigma_t\" type=\"heightfog\"/>\n<volume name=\"albedo\" type=\"noise\"/>"),
       "'albedo' of medium \"heterogeneous\" is the same everywhere in a \"heightfog\""},
      {in_medium("<volume name=\"sigma_t\" type=\"noise\"/>\n<volume name=\"albedo\" type=\"heightfog\"/>"),
       "'albedo' of medium \"heterogeneous\" has no box"},
  };
  for (const auto& row : rows) {
    const ReadResult r = read(row.file);
    EXPECT_FALSE(r.scene) << row.file;
    ASSERT_FALSE(r.diagnostics.empty()) << row.file;
    EXPECT_GT(r.diagnostics[0].place.line, 1) << row.file;
    EXPECT_GT(r.diagnostics[0].place.column, 1) << row.file;
    EXPECT_THAT(messages(r), HasSubstr(row.said)) << row.file;
  }
}

TEST(VolumesWithoutFile, AreNestedOnlySoDeep) {
  std::string inner = "<volume name=\"sigma_t\" type=\"noise\"/>";
  const auto around = [](const std::string& volume) {
    std::string part = volume;
    part.replace(part.find("sigma_t"), 7, "second");
    return "<volume name=\"sigma_t\" type=\"product\">\n" + part + "</volume>";
  };
  for (int i = 1; i < scene::kMaxVolumeNesting; ++i) inner = around(inner);
  EXPECT_TRUE(read(in_medium(inner)).scene);
  const ReadResult r = read(in_medium(around(inner)));
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(messages(r), HasSubstr("volumes are nested more than 8 deep"));
}

TEST(VolumesWithoutFile, InJsonAreCheckedToo) {
  const auto wrong = [](Scene s) { return scene::find_inconsistency(s); };
  Scene s = must_read(
      density("product", "<volume name=\"first\" type=\"noise\"/><volume name=\"second\" type=\"cloud\"/>"));
  ASSERT_EQ(wrong(s), "");
  auto& medium = std::get<HeterogeneousMedium>(s.media.at(0));
  auto& product = std::get<ProductVolume>(s.volumes.at(medium.sigma_t.value));
  const VolumeIndex second = product.second;
  product.second = medium.sigma_t;
  EXPECT_THAT(wrong(s), HasSubstr("contain each other in a circle"));
  product.second = {99};
  EXPECT_THAT(wrong(s), HasSubstr("refers to object 99"));
  product.second = second;
  s.volumes[second.value] = ConstVolume{{1, 2, 3}, {}};
  EXPECT_THAT(wrong(s), HasSubstr("one number, not a colour"));
  NoiseVolume empty;
  empty.max = {0, 1, 1};
  s.volumes[second.value] = empty;
  EXPECT_THAT(wrong(s), HasSubstr("'max' is not above 'min'"));
  s.volumes[second.value] = HeightFogVolume{};
  EXPECT_EQ(wrong(s), "");
  medium.sigma_t = second;
  medium.emission = second;
  EXPECT_THAT(wrong(s), HasSubstr("scene.media[0]: 'emission' has no end"));
}

// A medium "homogeneous" may have an albedo that varies, of any volume with a box.
TEST(VolumesWithoutFile, VaryTheAlbedoOfHomogeneousMedia) {
  const Scene s =
      must_read(with_sensor("<shape type=\"cube\"><medium name=\"interior\" type=\"homogeneous\">"
                            "<volume name=\"albedo\" type=\"noise\"/></medium></shape>"));
  const auto& m = std::get<HeterogeneousMedium>(s.media.at(0));
  EXPECT_TRUE(std::holds_alternative<NoiseVolume>(s.volumes.at(m.albedo.value)));
}

}  // namespace
}  // namespace ls
