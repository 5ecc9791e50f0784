// Translation of pbrt's media, and errors in them.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "formats/pbrt/media_parts.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"

namespace ls {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// pbrt-v4's integral of the CIE observer's y, 106.856895, rounded to three decimal places.
constexpr double kIntegralOfY = 106.857;

// A scene of one medium in a sphere, and the files that the reader made.
struct Read {
  Scene scene;
  KeepingAssets assets;
  std::string said;

  const HeterogeneousMedium& medium() const { return std::get<HeterogeneousMedium>(scene.media.at(0)); }
  const GridVolume& grid(VolumeIndex i) const { return std::get<GridVolume>(scene.volumes.at(i.value)); }
  const Rgb& constant(VolumeIndex i) const { return std::get<ConstVolume>(scene.volumes.at(i.value)).value; }
  // Returns the values in the `.vol` file of a volume.
  std::vector<float> values(VolumeIndex i) const {
    const std::string& bytes = assets.memory.files.at(scene.assets.at(grid(i).file.value).name);
    std::vector<float> all((bytes.size() - 48) / 4);
    std::memcpy(all.data(), bytes.data() + 48, 4 * all.size());
    return all;
  }
};

std::string in_sphere(std::string_view medium, std::string_view around = "") {
  return fmt::format(
      "{} MakeNamedMedium \"m\" \"string type\" {}\nMediumInterface \"m\" \"\" Material \"interface\" Shape "
      "\"sphere\"",
      around, medium);
}

Read medium_of(std::string_view medium, std::string_view around = "", std::string_view film = "") {
  Read r;
  r.assets.memory.files["fire.nvdb"] = "NanoVDB...";
  ReadResult result = read_scene("test.pbrt",
                                 fmt::format("Film \"rgb\" {} Camera \"perspective\"\nWorldBegin\n{}\n", film,
                                             in_sphere(medium, around)),
                                 r.assets);
  EXPECT_TRUE(result.scene) << messages(result);
  r.said = messages(result);
  if (result.scene) r.scene = *result.scene;
  return r;
}

std::string refused(std::string_view medium) { return refusal(in_sphere(medium)); }

TEST(PbrtMedia, ExtinctionByChannelIsATint) {
  const Read r = medium_of(R"("uniformgrid" "float density" [ 3 ] "rgb sigma_a" [ 1 2 3 ]
"rgb sigma_s" [ 3 2 1 ] "float scale" 5)");
  const Read coloured = medium_of(R"("uniformgrid" "float density" [ 3 ] "rgb sigma_a" [ 1 2 3 ]
"rgb sigma_s" [ 3 2 5 ] "float scale" 5)");

  EXPECT_EQ(r.medium().scale, 20);
  EXPECT_EQ(r.medium().tint, (Rgb{1, 1, 1}));
  EXPECT_EQ(r.constant(r.medium().albedo), (Rgb{.75, .5, .25}));
  EXPECT_EQ(coloured.medium().scale, 5);
  EXPECT_EQ(coloured.medium().tint, (Rgb{4, 4, 8}));
  EXPECT_EQ(coloured.values(coloured.medium().sigma_t).size(), 27u);
}

TEST(PbrtMedia, LightOfAUniformGridIsLeTimesItsScales) {
  const Read grey = medium_of(R"("uniformgrid" "integer nx" 2 "float density" [ 1 1 ] "rgb Le" [ 3 3 3 ]
"float Lescale" [ 5 7 ])",
                              "", "\"float iso\" 200");
  const Read coloured = medium_of(R"("uniformgrid" "integer nx" 2 "float density" [ 1 1 ]
"rgb Le" [ 1 2 3 ] "float Lescale" [ 5 7 ])");

  EXPECT_EQ(grey.medium().emission_scale, 6);
  std::vector<float> want(4 * 3 * 3);
  want[4 * 4 + 1] = 5;
  want[4 * 4 + 2] = 7;
  EXPECT_EQ(grey.values(*grey.medium().source_radiance), want);
  EXPECT_TRUE(grey.grid(*grey.medium().source_radiance).border);
  EXPECT_EQ(coloured.medium().emission_scale, 1);
  const auto values = coloured.values(*coloured.medium().source_radiance);
  ASSERT_EQ(values.size(), 3 * want.size());
  EXPECT_THAT(std::vector(values.begin() + 3 * 17, values.begin() + 3 * 19),
              ElementsAre(5, 10, 15, 7, 14, 21));
}

// Without Lescale pbrt scales the emission by a grid of one voxel, which falls off towards the faces of the
// box.
TEST(PbrtMedia, LightWithoutScalesFadesFromTheMiddleOfTheBox) {
  const Read r = medium_of(
      R"("uniformgrid" "integer nx" 2 "float density" [ 1 1 ] "rgb Le" [ 1 1 1 ] "point3 p1" [ 2 1 1 ])");

  const auto& volume = r.grid(*r.medium().source_radiance);
  std::vector<float> want(27);
  want[13] = 1;
  EXPECT_EQ(r.values(*r.medium().source_radiance), want);
  EXPECT_TRUE(volume.border);
  EXPECT_EQ(volume.to_world, (Transform{{2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}));
}

TEST(PbrtMedia, BlackBodiesHaveThePeakOneAndTheIntegralOfY) {
  const Read r = medium_of(R"("uniformgrid" "integer nx" 2 "float density" [ 1 1 ]
"float temperature" [ 10 20 ] "float temperaturescale" 100 "float temperatureoffset" 2 "float Lescale" [ 5 7 ])",
                           "", "\"float iso\" 300");

  const HeterogeneousMedium& m = r.medium();
  EXPECT_TRUE(m.peak_one);
  EXPECT_EQ(m.temperature_scale, 100);
  EXPECT_EQ(m.temperature_offset, -200);
  EXPECT_NEAR(m.emission_scale, 3 * kIntegralOfY, 3 * 5e-4);
  ASSERT_TRUE(m.temperature && m.emission_weight);
  EXPECT_EQ(r.values(*m.temperature)[17], 10);
  EXPECT_EQ(r.values(*m.temperature)[18], 20);
  EXPECT_EQ(r.values(*m.emission_weight)[17], 5);
  EXPECT_EQ(r.values(*m.emission_weight)[18], 7);
  EXPECT_FALSE(m.source_radiance);
}

TEST(PbrtMedia, NamesOfOlderScenesAreRead) {
  const Read r = medium_of(R"("nanovdb" "string filename" "fire.nvdb" "float temperaturecutoff" 3
"float LeScale" 0.5)");
  const Read both = medium_of(
      R"("nanovdb" "string filename" "fire.nvdb" "float temperaturecutoff" 3 "float temperatureoffset" 4)");

  EXPECT_EQ(r.medium().temperature_offset, -3);
  EXPECT_NEAR(r.medium().emission_scale, .5 * kIntegralOfY, .5 * 5e-4);
  EXPECT_EQ(both.medium().temperature_offset, -4);
}

TEST(PbrtMedia, LightOfANanoVdbFileIsItsTemperature) {
  const Read r = medium_of(R"("nanovdb" "string filename" "fire.nvdb" "string temperaturename" "flame"
"float Lescale" 2 "rgb sigma_a" [ 1 2 4 ])",
                           "Translate 1 2 3");

  const HeterogeneousMedium& m = r.medium();
  ASSERT_TRUE(m.temperature);
  EXPECT_EQ(r.grid(m.sigma_t).grid_name, "density");
  EXPECT_EQ(r.grid(*m.temperature).grid_name, "flame");
  EXPECT_EQ(r.grid(*m.temperature).to_world, r.grid(m.sigma_t).to_world);
  EXPECT_EQ(r.grid(m.sigma_t).to_world.m[7], 2);
  EXPECT_EQ(m.tint, (Rgb{2, 3, 5}));
  EXPECT_TRUE(m.peak_one);
  EXPECT_FALSE(m.emission_weight);
  EXPECT_NEAR(m.emission_scale, 2 * kIntegralOfY, 2 * 5e-4);
  EXPECT_THAT(r.said, testing::Not(HasSubstr("temperature")));
}

TEST(PbrtMedia, NanoVdbFileEmitsOnlyIfTheSceneRequestsIt) {
  const Read quiet = medium_of(R"("nanovdb" "string filename" "fire.nvdb")");
  const Read dark = medium_of(R"("nanovdb" "string filename" "fire.nvdb" "float Lescale" 0)");
  const Read lit = medium_of(R"("nanovdb" "string filename" "fire.nvdb" "float temperaturescale" 9)");

  EXPECT_FALSE(quiet.medium().temperature);
  EXPECT_THAT(quiet.said, HasSubstr("name it by \"string temperaturename\""));
  EXPECT_FALSE(dark.medium().temperature);
  ASSERT_TRUE(lit.medium().temperature);
  EXPECT_EQ(lit.grid(*lit.medium().temperature).grid_name, "temperature");
}

TEST(PbrtMedia, LightOfAnRgbGridIsNotScaledToTheWhite) {
  const Read r = medium_of(R"("rgbgrid" "rgb sigma_a" [ 1 2 4 ] "rgb sigma_s" [ 1 2 4 ] "rgb Le" [ 3 4 5 ]
"float Lescale" 2)");

  ASSERT_TRUE(r.medium().source_radiance);
  EXPECT_NEAR(r.medium().emission_scale, 2 * kIntegralOfY, 2 * 5e-4);
  const auto values = r.values(*r.medium().source_radiance);
  EXPECT_THAT(std::vector(values.begin() + 39, values.begin() + 42), ElementsAre(3, 4, 5));
  // The albedo is constant, so the medium equals pbrt's and there is no warning.
  EXPECT_EQ(r.constant(r.medium().albedo), (Rgb{.5, .5, .5}));
  EXPECT_THAT(r.said, testing::Not(HasSubstr("interpolated")));
}

TEST(PbrtMedia, VaryingAlbedoIsAGridThatExtendsIntoEmptyVoxels) {
  const Read r = medium_of(R"("rgbgrid" "integer nx" 3 "rgb sigma_a" [ 1 1 1  0 0 0  1 1 1 ]
"rgb sigma_s" [ 1 1 1  0 0 0  3 3 3 ])");

  const auto albedo = r.values(r.medium().albedo);
  ASSERT_EQ(albedo.size(), 3u * 5 * 3 * 3);
  const std::size_t first = 3 * (5 * 4 + 1);
  EXPECT_EQ(albedo[first], .5f);
  EXPECT_EQ(albedo[first + 3], 4 / 6.f);  // mean of .5 and .75 with the weights 2 and 4, the extinctions
  EXPECT_EQ(albedo[first + 6], .75f);
  EXPECT_EQ(albedo[first - 3], .5f);
  EXPECT_THAT(r.said, HasSubstr("extinction and albedo are interpolated"));
}

// In pbrt a missing coefficient is 1 everywhere, also outside the grid of the other.
TEST(PbrtMedia, MissingCoefficientStaysConstant) {
  const Read r = medium_of(R"("rgbgrid" "rgb sigma_a" [ 2 2 2 ])");

  const auto density = r.values(r.medium().sigma_t), albedo = r.values(r.medium().albedo);
  EXPECT_EQ(density[0], 1);
  EXPECT_EQ(density[39], 3);
  EXPECT_EQ(albedo[0], 1);
  EXPECT_EQ(albedo[39], 1 / 3.f);
}

TEST(PbrtMedia, PresetsArePerMillimetre) {
  const Scene s = pbrt(in_sphere(R"("homogeneous" "string preset" "Ketchup" "float scale" 10)"));

  const auto& m = std::get<HomogeneousMedium>(s.media.at(0));
  EXPECT_EQ(m.scale, 10);
  const Rgb absorption{.061, .97, 1.45}, scattering{.18, .07, .03};  // Jensen et al. 2001
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_DOUBLE_EQ(m.sigma_t[c], absorption[c] + scattering[c]);
    EXPECT_DOUBLE_EQ(m.sigma_t[c] * m.albedo[c], scattering[c]);
  }
}

TEST(PbrtMedia, EverySubstanceIsAMedium) {
  const auto names = scene::pbrt::substance_names();
  EXPECT_EQ(names.size(), 47u);
  for (const std::string& name : names) {
    const scene::pbrt::Substance* s = scene::pbrt::find_substance(name);
    ASSERT_TRUE(s) << name;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_GE(s->absorption[c], 0) << name;
      EXPECT_GE(s->scattering[c], 0) << name;
      EXPECT_GT(s->absorption[c] + s->scattering[c], 0) << name;
    }
    pbrt(in_sphere(fmt::format("\"homogeneous\" \"string preset\" \"{}\"", name)));
  }
}

TEST(PbrtMedia, CloudsAreFormulas) {
  const Read r = medium_of(R"("cloud" "float frequency" 0.5 "float wispiness" -1 "point3 p0" [ -1 0 -1 ]
"point3 p1" [ 1 1 1 ] "rgb sigma_s" [ 3 3 3 ] "float g" 0.5)",
                           "Scale 2 2 2");

  const auto& cloud = std::get<CloudVolume>(r.scene.volumes.at(r.medium().sigma_t.value));
  EXPECT_EQ(cloud.frequency, .5);
  EXPECT_EQ(cloud.wispiness, 0);
  EXPECT_EQ(cloud.density, 1);
  EXPECT_EQ(cloud.min, (Vec3{-1, 0, -1}));
  EXPECT_EQ(cloud.max, (Vec3{1, 1, 1}));
  EXPECT_EQ(cloud.to_world, (Transform{{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1}}));
  EXPECT_EQ(r.medium().scale, 4);
  EXPECT_EQ(r.constant(r.medium().albedo), (Rgb{.75, .75, .75}));
  EXPECT_EQ(std::get<HgPhase>(r.scene.phases.at(r.medium().phase.value)).g, .5);
  EXPECT_TRUE(r.scene.assets.empty());
}

TEST(PbrtMedia, CloudNoiseBeyondMeasureIsRefused) {
  EXPECT_THAT(refused(R"("cloud" "float frequency" -1e30)"), HasSubstr("out of its range"));
}

TEST(PbrtMedia, EachKindIsInsideOutsideAndAroundTheCamera) {
  const std::string media = R"(Translate 5 0 0 CoordinateSystem "there" Identity
CoordSysTransform "there"
MakeNamedMedium "fog" "string type" "homogeneous" "string preset" "Skin1"
MakeNamedMedium "grid" "string type" "uniformgrid" "float density" [ 1 ] "float temperature" [ 3000 ]
MakeNamedMedium "rgb" "string type" "rgbgrid" "rgb sigma_a" [ 1 1 1 ] "rgb Le" [ 1 1 1 ]
MakeNamedMedium "file" "string type" "nanovdb" "string filename" "fire.nvdb" "float Lescale" 1
MakeNamedMedium "cloud" "string type" "cloud" "float frequency" 1 "point3 p1" [ .1 .1 .1 ]
)";
  for (const char* name : {"fog", "grid", "rgb", "file", "cloud"}) {
    SCOPED_TRACE(name);
    KeepingAssets assets;
    assets.memory.files["fire.nvdb"] = "NanoVDB...";
    const ReadResult r = read_scene(
        "t.pbrt",
        pbrt_scene(fmt::format(R"(MediumInterface "{0}" "" Material "interface" Shape "sphere"
MediumInterface "" "{0}" Shape "sphere" "float radius" 2)",
                               name),
                   fmt::format("{}Identity MediumInterface \"\" \"{}\" Camera \"perspective\"", media, name)),
        assets);
    ASSERT_TRUE(r.scene) << messages(r);
    const Scene& s = *r.scene;
    ASSERT_TRUE(s.sensor.medium);
    EXPECT_EQ(s.shapes.at(0).interior, s.sensor.medium);
    EXPECT_FALSE(s.shapes.at(0).exterior);
    EXPECT_EQ(s.shapes.at(1).exterior, s.sensor.medium);
    const auto* m = std::get_if<HeterogeneousMedium>(&s.media.at(s.sensor.medium->value));
    EXPECT_EQ(m == nullptr, std::string_view(name) == "fog");
    // Its grids are placed by the named coordinate system.
    if (m) {
      const Volume& density = s.volumes.at(m->sigma_t.value);
      const auto* cloud = std::get_if<CloudVolume>(&density);
      EXPECT_EQ((cloud ? cloud->to_world : std::get<GridVolume>(density).to_world).m[3], 5);
      const auto& light = m->temperature ? m->temperature : m->source_radiance;
      if (light) {
        EXPECT_EQ(std::get<GridVolume>(s.volumes.at(light->value)).to_world.m[3], 5);
      }
    }
  }
}

TEST(PbrtMedia, ErrorsAreReportedWithTheirPlace) {
  const struct {
    const char *medium, *said;
  } rows[] = {
      {R"("homogeneous" "string preset" "Skin3")", "did you mean 'Skin1'?"},
      {R"("homogeneous" "string preset" "Skin1" "rgb sigma_a" [ 1 1 1 ])", "has no effect beside the others"},
      {R"("homogeneous" "string preset" "Gold")", "has a preset \"Gold\" that is not known"},
      {R"("uniformgrid" "float density" [ 1 ] "rgb Le" [ 1 1 1 ] "float temperature" [ 1 ])",
       "gives Le and temperature"},
      {R"("uniformgrid" "float density" [ 1 ] "float temperature" [ 1 2 ])",
       "'temperature' has 2 numbers, but nx * ny * nz is 1"},
      {R"("uniformgrid" "float density" [ 1 ] "rgb Le" [ 1 1 1 ] "float Lescale" [ 1 2 ])",
       "'Lescale' has 2 numbers"},
      {R"("uniformgrid" "float density" [ 1 ] "float temperature" [ 1 ] "float temperaturescale" -1)",
       "temperaturescale is negative"},
      {R"("uniformgrid" "float density" [ 1 ] "float temperature" [ 1 ] "float temperatureoffset" 1e7)",
       "beyond 1000000 K"},
      {R"("uniformgrid" "float density" [ 1 ] "float temperature" [ ])", "'temperature'"},
      {R"("rgbgrid" "rgb sigma_s" [ 1 1 1 ] "rgb Le" [ 1 1 1 ])", "needs 'sigma_a'"},
      {R"("rgbgrid" "rgb sigma_a" [ 1 1 1 ] "rgb Le" [ 1 1 1 2 2 2 ])", "3 * nx * ny * nz is 3"},
      {R"("rgbgrid" "rgb sigma_a" [ 1 1 1 ] "float temperature" [ 1 ])", "has no parameter 'temperature'"},
      {R"("nanovdb" "string filename" "mesh.ply" "float Lescale" -1)", "Lescale is negative"},
      {R"("cloud" "float frequency" 0.1 "float scale" 2)", "has no parameter 'scale'"},
      {R"("cloud" "point3 p1" [ 0 0 0 ])", "p0 is not below p1"},
  };
  for (const auto& row : rows) {
    const ReadResult r = read_pbrt(pbrt_scene(in_sphere(row.medium)));
    EXPECT_FALSE(r.scene) << row.medium;
    ASSERT_FALSE(r.diagnostics.empty()) << row.medium;
    EXPECT_EQ(r.diagnostics[0].place.line, 3) << row.medium;
    EXPECT_GT(r.diagnostics[0].place.column, 1) << row.medium;
    EXPECT_THAT(messages(r), HasSubstr(row.said)) << row.medium;
  }
}

}  // namespace
}  // namespace ls
