// Written XML reads back to an equal scene.
#include "formats/reader/xml_write.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/scene/schema/describe_fields.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using scene::describe;
using ::testing::HasSubstr;

// Writes `s` and checks that the text reads back to an equal scene. Returns the text.
std::string proven(const Scene& s) {
  const std::string text = write_xml(s);
  const ReadResult again = read(text);
  EXPECT_TRUE(quiet(again)) << messages(again);
  EXPECT_TRUE(again.scene) << text;
  if (!again.scene) return text;
  EXPECT_EQ(serialize(*again.scene), serialize(s)) << text;
  EXPECT_EQ(write_xml(*again.scene), text);
  return text;
}

TEST(XmlWrite, ReadsBackToTheSameScene) {
  proven(must_read(kExample));
  proven(must_read(with_sensor("")));
  proven(
      must_read("<scene version=\"0.5.0\"><sensor type=\"perspective\"/><shape type=\"sphere\"/></scene>"));
}

TEST(XmlWrite, KeepsSharedAndMerelyEqualObjects) {
  const std::string shared = proven(must_read(with_sensor(R"(
    <texture type="uniform" id="grey"><float name="value" value="0.3"/></texture>
    <bsdf type="diffuse" id="wall"><ref name="reflectance" id="grey"/></bsdf>
    <bsdf type="roughconductor" id="metal"><float name="alpha" value="0.2"/></bsdf>
    <phase type="hg" id="p"/>
    <medium type="homogeneous" id="fog"><ref id="p"/></medium>
    <medium type="heterogeneous" id="smoke"><ref id="p"/><float name="sigma_t" value="2"/></medium>
    <shape type="disk"><ref id="wall"/></shape>
    <shape type="disk"><ref id="wall"/><emitter type="area"><ref name="radiance" id="grey"/></emitter></shape>
    <shape type="cube"><ref id="metal"/><ref name="interior" id="fog"/><ref name="exterior" id="smoke"/></shape>)")));
  EXPECT_THAT(shared, HasSubstr("<texture type=\"uniform\" id=\"texture0\">"));
  EXPECT_THAT(shared, HasSubstr("<ref id=\"bsdf0\"/>"));
  EXPECT_THAT(shared, HasSubstr("<ref name=\"interior\" id=\"medium0\"/>"));
  const std::string alike = proven(must_read(with_sensor(
      R"(<shape type="disk"/><shape type="disk"/><shape type="disk"><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>)")));
  EXPECT_THAT(alike, HasSubstr("<float name=\"reflectance\" value=\"0.5\"/>"));
  EXPECT_THAT(alike, HasSubstr("id=\"bsdf3\""));
}

TEST(XmlWrite, EscapesSpecialCharactersInFileNames) {
  Scene s = must_read(kExample);
  MemoryAssets assets;
  for (Asset& a : s.assets) {
    const std::string bytes = assets.files.at(a.name);
    a.name = "a & b <$spp> \"x\\$y'" + a.name;
    assets.files[a.name] = bytes;
  }
  const ReadResult again = read_scene("test.xml", write_xml(s), assets);
  ASSERT_TRUE(again.scene) << messages(again);
  EXPECT_EQ(*again.scene, s);
}

TEST(XmlWrite, KeepsAFileWithTwoNames) {
  const Scene s = must_read(with_sensor(
      R"(<shape type="obj"><string name="filename" value="mesh.obj"/></shape>
         <shape type="obj"><string name="filename" value="./mesh.obj"/></shape>
         <shape type="obj"><string name="filename" value="mesh.obj"/></shape>)"));
  proven(s);
}

// Sets every number, colour, boolean and enumeration to a random value in its range.
class Shaker {
 public:
  explicit Shaker(unsigned seed) : random_(seed) {}
  template <class T>
  void field(const scene::Field& f, T& value) {
    if (!f.derived || !f.given_as.empty()) shake(f, value);
  }

 private:
  double any(const scene::Range& range) {
    const double low = std::max(range.min, -1e9), high = std::min(range.max, 1e9);
    std::uniform_real_distribution<double> uniform(0, 1);
    // In a wide range all magnitudes are equally likely. The ends, which may be excluded, never occur.
    const double u = .01 + .98 * uniform(random_);
    if (high - low < 1e6) return low + (high - low) * u;
    return std::max(low, 0.0) + std::pow(10, 30 * uniform(random_) - 24);
  }
  void shake(const scene::Field& f, double& x) { x = any(f.range); }
  void shake(const scene::Field& f, Rgb& x) {
    for (double& c : x) c = any(f.range);
  }
  void shake(const scene::Field&, Vec3& x) {
    for (double& c : x) c = any({});
  }
  void shake(const scene::Field&, bool& x) { x = random_() % 2; }
  template <class E>
  requires std::is_enum_v<E>
  void shake(const scene::Field&, E& x) {
    x = scene::NamesOf<E>::all[random_() % std::size(scene::NamesOf<E>::all)].value;
  }
  template <class... Ts>
  void shake(const scene::Field&, std::variant<Ts...>& x) {
    std::visit([&](auto& alternative) { describe(*this, alternative); }, x);
  }
  template <class T>
  void shake(const scene::Field&, T&) {}

  std::mt19937_64 random_;
};

template <class List>
void shake_all(Shaker& shaker, List& list) {
  for (auto& one : list) std::visit([&](auto& x) { describe(shaker, x); }, one);
}

TEST(XmlWrite, KeepsEveryBitOfEveryValue) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    Scene s = must_read(kExample);
    Shaker shaker(seed);
    shake_all(shaker, s.bsdfs);
    shake_all(shaker, s.phases);
    shake_all(shaker, s.media);
    shake_all(shaker, s.emitters);
    describe(shaker, s.sensor);
    describe(shaker, s.film);
    for (Shape& shape : s.shapes) {
      describe(shaker, shape);
      std::visit([&](auto& g) { describe(shaker, g); }, shape.geometry);
    }
    // Some values must be consistent with each other.
    s.sensor.far_clip = s.sensor.near_clip * 2;
    s.sensor.shutter_open = s.sensor.shutter_close = 0;  // those of a camera that stands still
    for (Emitter& e : s.emitters)
      if (auto* spot = std::get_if<SpotEmitter>(&e)) spot->beam_width = spot->cutoff_angle / 3;
    for (Bsdf& b : s.bsdfs)  // needs equal roughnesses
      if (auto* metal = std::get_if<RoughConductorBsdf>(&b)) metal->multiple_scattering = false;
    for (Shape& shape : s.shapes) {
      shape.shadow_catcher = shape.shadow_catcher && !shape.holdout;
      if (std::holds_alternative<NullBsdf>(s.bsdfs[shape.bsdf.value]) && !shape.emitter)
        shape.visible_shadow = shape.visible_reflection = shape.visible_volume = true;
    }
    const ReadResult again = read(write_xml(s));
    ASSERT_TRUE(again.scene) << messages(again) << write_xml(s);
    ASSERT_EQ(serialize(*again.scene), serialize(s)) << seed;
  }
}

TEST(XmlWrite, KeepsAZeroFalloff) {
  const Scene s = must_read(with_sensor(
      R"(<shape type="disk"><emitter type="area"><float name="cutoff_angle" value="90"/>
         <float name="beam_width" value="90"/><float name="falloff" value="3"/></emitter></shape>)"));
  EXPECT_EQ(s.shapes[0].emitter->falloff, 1);
  proven(s);
}

TEST(XmlWrite, DistinguishesAPinholeFromALens) {
  Scene s = must_read(with_sensor(""));
  EXPECT_THAT(proven(s), HasSubstr("<sensor type=\"perspective\">"));
  s.sensor.focus_distance = 7;
  EXPECT_THAT(proven(s), HasSubstr("<sensor type=\"thinlens\">"));
  s.sensor.aperture_radius = .1;
  proven(s);
}

// Mitsuba 3 takes an <rgb> in place of a volume for a reflectance, and refuses values above 1.
TEST(XmlWrite, WritesColoursOfMediaInAFormThatMitsubaReads) {
  const auto medium = [](std::string_view type, std::string_view colour) {
    return proven(must_read(with_sensor(fmt::format(
        R"(<medium type="{}" id="m"><rgb name="sigma_t" value="{}"/></medium>
           <shape type="cube"><bsdf type="null"/><ref name="interior" id="m"/></shape>)",
        type, colour))));
  };
  for (const std::string_view type : {"homogeneous", "heterogeneous"}) {
    EXPECT_THAT(medium(type, "1.4 1.3 1.01"), HasSubstr("<volume type=\"constvolume\" name=\"sigma_t\">"));
    EXPECT_THAT(medium(type, "0.4 0.3 1"), HasSubstr("<rgb name=\"sigma_t\" value=\"0.4 0.3 1\"/>"));
    EXPECT_THAT(medium(type, "7"), HasSubstr("<float name=\"sigma_t\" value=\"7\"/>"));
  }
}

TEST(XmlWrite, OmitsDefaultsUnknownToMitsuba) {
  const std::string text = proven(must_read(
      R"(<scene version="3.0.0"><sensor type="thinlens"><float name="aperture_radius" value="0.1"/>
<film type="hdrfilm"><rfilter type="box"/></film></sensor></scene>)"));

  EXPECT_THAT(text, ::testing::Not(HasSubstr("principal_point_offset")));
  EXPECT_THAT(text, HasSubstr("<rfilter type=\"box\"/>"));
}

TEST(XmlWrite, ReportsFeaturesThatOnlyLightshaftReads) {
  const auto ours = [](const std::string& objects) {
    return write_scene(must_read(with_sensor(objects))).only_ours;
  };
  using ::testing::ElementsAre;

  EXPECT_THAT(ours(R"(<shape type="sphere"/><medium type="homogeneous" id="m"/>)"), ::testing::IsEmpty());
  EXPECT_THAT(ours(R"(<shape type="ply"><string name="filename" value="mesh.ply"/>
                        <boolean name="flat_without_normals" value="true"/></shape>)"),
              ElementsAre("'flat_without_normals' of shape \"ply\""));
  EXPECT_THAT(ours(R"(<shape type="sphere"><bsdf type="roughplastic">
                        <boolean name="multiple_scattering" value="true"/></bsdf></shape>
                      <shape type="sphere"><bsdf type="coatedconductor"/></shape>)"),
              ElementsAre("'multiple_scattering' of bsdf \"roughplastic\"", "bsdf \"coatedconductor\""));
  EXPECT_THAT(
      ours(R"(<medium type="heterogeneous" id="m">
                        <volume type="gridvolume" name="sigma_t"><string name="filename" value="steam.vdb"/></volume>
                        <float name="emission" value="1"/></medium>
                      <shape type="cube"><bsdf type="null"/><ref name="interior" id="m"/></shape>)"),
      ElementsAre("grids that are no .vol, such as steam.vdb", "'emission' of medium \"heterogeneous\""));
}

}  // namespace
}  // namespace ls
