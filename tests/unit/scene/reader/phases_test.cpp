// Phase functions in files of Mitsuba.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/json/serialize.h"
#include "core/scene/limits.h"
#include "core/scene/schema/phase_tables.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

std::string fog(const std::string& phase) {
  return with_sensor("<shape type=\"cube\"><medium name=\"interior\" type=\"homogeneous\">" + phase +
                     "</medium></shape>");
}
std::string table(const std::string& lists) { return fog("<phase type=\"tabphase\">" + lists + "</phase>"); }
std::string list(const std::string& name, const std::string& numbers) {
  return "<string name=\"" + name + "\" value=\"" + numbers + "\"/>";
}
std::string error(const std::string& file) {
  const ReadResult r = read(file);
  return r.scene ? "" : messages(r);
}
Phase phase_of(const Scene& s) {
  return s.phases.at(std::visit([](const auto& m) { return m.phase.value; }, s.media.at(0)));
}
// The phase function that the file becomes, which writing and reading again must keep.
Phase must_read_phase(const std::string& phase) {
  const Scene s = must_read(fog(phase));
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(*deserialize_scene(serialize(s)), s);
  return phase_of(s);
}

TEST(Phases, AreReadWithTheirParametersAndDefaults) {
  EXPECT_EQ(must_read_phase("<phase type=\"rayleigh\"/>"), Phase(RayleighPhase{}));
  EXPECT_EQ(must_read_phase("<phase type=\"draine\"><float name=\"g\" value=\".4\"/><float name=\"alpha\" "
                            "value=\"3\"/></phase>"),
            Phase(DrainePhase{.4, 3}));
  EXPECT_EQ(must_read_phase("<phase type=\"droplets\"/>"), Phase(DropletsPhase{20}));
  EXPECT_EQ(must_read_phase("<phase type=\"fournier_forand\"><float name=\"backscatter\" value=\".02\"/>"
                            "</phase>"),
            Phase(FournierForandPhase{.02, 1.33}));
}

TEST(Phases, ReadTables) {
  EXPECT_EQ(must_read_phase("<phase type=\"tabphase\">" + list("values", "1, 2,3 4") + "</phase>"),
            Phase(TabulatedPhase{{1, 2, 3, 4}, {}, {}, {}, {}, {}}));
  EXPECT_EQ(must_read_phase("<phase type=\"tabphase\">" + list("red", "1 2 3") + list("green", "0 0 1") +
                            list("blue", "1e-3 2 1e6") + list("angles", "0 20 180") + "</phase>"),
            Phase(TabulatedPhase{{}, {1, 2, 3}, {0, 0, 1}, {1e-3, 2, 1e6}, {}, {0, 20, 180}}));
}

TEST(Phases, PutTablesByAngleIntoTheOrderOfCosines) {
  const scene::PhaseValues v = scene::values_of({{1, 2, 3}, {}, {}, {}, {}, {0, 60, 180}});
  ASSERT_EQ(v.cosines.size(), 3u);
  EXPECT_EQ(v.cosines[0], -1);
  EXPECT_NEAR(v.cosines[1], .5, 1e-15);
  EXPECT_EQ(v.cosines[2], 1);
  EXPECT_EQ(v.values, (std::vector<std::vector<double>>{{3, 2, 1}}));
}

TEST(Phases, ReadBlendsInTheirOrderOrByTheirNames) {
  const auto parts = [](const std::string& inner) {
    const Scene s = must_read(
        fog("<phase type=\"blendphase\"><float name=\"weight\" value=\".2\"/>" + inner + "</phase>"));
    EXPECT_EQ(must_read(write_xml(s)), s);
    const auto blend = std::get<BlendPhase>(phase_of(s));
    EXPECT_EQ(std::get<ConstVolume>(s.volumes.at(blend.weight.value)).value, (Rgb{.2, .2, .2}));
    return std::pair(s.phases.at(blend.first.value), s.phases.at(blend.second.value));
  };
  const std::pair<Phase, Phase> wanted(RayleighPhase{}, HgPhase{.8});
  EXPECT_EQ(parts("<phase type=\"rayleigh\"/><phase type=\"hg\"/>"), wanted);
  EXPECT_EQ(parts("<phase name=\"b\" type=\"hg\"/><phase name=\"a\" type=\"rayleigh\"/>"), wanted);
}

// The numbers 1 - cos of such angles are equal in double, so there is no line through their values.
TEST(Phases, RefuseAnglesThatCannotBeToldApart) {
  for (const std::string& places :
       {list("angles", "0 179.9999999999 180"), list("angles", "0 1e-9 180"),
        list("nodes", "-1 -0.9999999999999999 1"), list("nodes", "-1 0.99999999999999999 1")})
    EXPECT_THAT(error(table(list("values", "1 1 1") + places)),
                AnyOf(HasSubstr("too close"), HasSubstr("ascend")))
        << places;
  EXPECT_EQ(error(table(list("values", "1 1 1") + list("angles", "0 1e-5 180"))), "");
  EXPECT_EQ(error(table(list("values", "1e30 1e-320"))), "") << "any scale";
}

TEST(Phases, KeepTheOrderOfBlendsOfWhichOnePartHasAName) {
  for (const char* first : {"name=\"zz\"", ""}) {
    const std::string second = *first ? "" : "name=\"aa\"";
    const Scene s = must_read(fog(
        fmt::format("<phase type=\"blendphase\"><phase type=\"rayleigh\" {}/><phase type=\"hg\" {}/></phase>",
                    first, second)));
    EXPECT_EQ(s.phases.at(std::get<BlendPhase>(phase_of(s)).first.value), Phase(RayleighPhase{}));
  }
}

TEST(Phases, RefuseWrongTablesWithTheirPlace) {
  const auto expect = [](const std::string& lists, const std::string& place, const std::string& what) {
    const std::string got = error(table(lists));
    EXPECT_THAT(got, HasSubstr(what)) << lists;
    // The caret stands below what is wrong
    const auto line = got.find(place);
    ASSERT_NE(line, std::string::npos) << got;
    EXPECT_NE(got.find('^'), std::string::npos) << got;
  };
  expect("", "tabphase", "'values' of phase \"tabphase\" is missing");
  expect(list("values", "1"), "\"1\"", "has 1 numbers; 2 to 2520 are wanted");
  expect(list("values", "1, , 2"), "1, , 2", "has a hole: number 2 is missing");
  expect(list("values", "1, 2,"), "1, 2,", "has a hole: number 3 is missing");
  expect(list("values", "1 nan 2"), "1 nan 2", "wants finite numbers, but number 2 is \"nan\"");
  expect(list("values", "1 1e999 2"), "1e999", "wants finite numbers, but number 2 is \"1e999\"");
  expect(list("values", "1 -2 3"), "1 -2 3", "has -2 as number 2, out of its range 0 <= values");
  expect(list("values", "0 0 0"), "0 0 0", "is zero everywhere");
  expect(list("values", "1 1e31"), "1e31", "at most 1e30 is allowed");
  expect(list("values", "1 2") + list("red", "1 2"), "1 2", "is given beside 'red', 'green' and 'blue'");
  expect(list("red", "1 2") + list("green", "1 2"), "tabphase", "'blue' of phase \"tabphase\" has 0 numbers");
  expect(list("red", "1 2") + list("green", "1 2 3") + list("blue", "1 2"), "1 2 3",
         "has 3 numbers, and 'red' 2");
  expect(list("values", "1 2 3") + list("angles", "0 180"), "1 2 3", "has 3 numbers, and 'angles' 2");
  expect(list("values", "1 2 3") + list("angles", "0 60 60"), "0 60 60",
         "must ascend: number 3 is 60 after 60");
  expect(list("values", "1 2 3") + list("angles", "0 60 170"), "0 60 170",
         "leaves a hole: it goes from 0 to 170, not from 0 to 180");
  expect(list("values", "1 2") + list("nodes", "-1 .5"), "-1 .5", "leaves a hole");
  expect(list("values", "1 2") + list("nodes", "-1 1") + list("angles", "0 180"), "0 180",
         "is given beside 'nodes'");
}

TEST(Phases, RefuseWrongNumbersAndBlends) {
  const auto blend = [](const std::string& inner) {
    return error(fog("<phase type=\"blendphase\">" + inner + "</phase>"));
  };
  const std::string two = "<phase type=\"rayleigh\"/><phase type=\"hg\"/>";
  EXPECT_THAT(blend("<phase type=\"rayleigh\"/>"), HasSubstr("needs two nested phase functions, not 1"));
  EXPECT_THAT(blend(two + "<phase type=\"hg\"/>"), HasSubstr("needs two nested phase functions, not 3"));
  EXPECT_THAT(blend("<float name=\"weight\" value=\"1.5\"/>" + two),
              HasSubstr("out of its range 0 <= weight"));
  EXPECT_THAT(blend("<rgb name=\"weight\" value=\".1 .2 .3\"/>" + two),
              HasSubstr("is one number, not a colour"));
  EXPECT_THAT(error(fog("<phase type=\"droplets\"><float name=\"diameter\" value=\"60\"/></phase>")),
              HasSubstr("'diameter' of phase \"droplets\" is 60, out of its range 0.001 <= diameter <= 50"));
  EXPECT_THAT(error(fog("<phase type=\"draine\"><float name=\"g\" value=\"1\"/></phase>")),
              HasSubstr("out of its range"));
  EXPECT_THAT(error(fog("<phase type=\"sggx\"/>")), HasSubstr("depend on a direction of the medium"));
  std::string nested = "<phase type=\"hg\"/>";
  for (int i = 1; i < scene::kMaxPhaseNesting; ++i)
    nested = "<phase type=\"blendphase\">" + nested + "<phase type=\"rayleigh\"/></phase>";
  EXPECT_EQ(error(fog(nested)), "");
  EXPECT_THAT(error(fog("<phase type=\"blendphase\">" + nested + "<phase type=\"rayleigh\"/></phase>")),
              HasSubstr("phase functions are nested more than 8 deep"));
}

// Scenes in JSON do not pass the reader.
TEST(Phases, RefuseWrongScenesInJson) {
  const auto refused = [](std::vector<Phase> phases) {
    Scene s = must_read(fog("<phase type=\"isotropic\"/>"));
    s.volumes = {ConstVolume{{.5, .5, .5}, {}}, ConstVolume{{2, 2, 2}, {}}};
    std::visit([](auto& m) { m.phase = {0}; }, s.media.at(0));
    s.phases = std::move(phases);
    const auto again = deserialize_scene(serialize(s));
    return again ? std::string() : again.error().message;
  };
  EXPECT_EQ(refused({BlendPhase{{0}, {1}, {1}}, RayleighPhase{}}), "");
  EXPECT_THAT(refused({BlendPhase{{0}, {1}, {0}}, RayleighPhase{}}), HasSubstr("in a circle"));
  EXPECT_THAT(refused({BlendPhase{{0}, {1}, {7}}, RayleighPhase{}}), HasSubstr("refers to object 7"));
  EXPECT_THAT(refused({BlendPhase{{1}, {1}, {1}}, RayleighPhase{}}), HasSubstr("not one number from 0 to 1"));
  EXPECT_THAT(refused({TabulatedPhase{{1}, {}, {}, {}, {}, {}}}), HasSubstr("has 1 numbers"));
  EXPECT_THAT(refused({TabulatedPhase{{0, 0}, {}, {}, {}, {}, {}}}), HasSubstr("is zero everywhere"));
}

}  // namespace
}  // namespace ls
