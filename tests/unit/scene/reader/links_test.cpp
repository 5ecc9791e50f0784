// Reading of the links between lights and what they light or what shades it, and their errors.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/light/link_names.h"
#include "core/scene/analysis/needs.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/schema/light_links.h"
#include "core/scene/schema/validate.h"
#include "formats/reader/xml_write.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string listed(std::string_view name, std::string_view value) {
  return fmt::format(R"(<string name="{}" value="{}"/>)", name, value);
}
std::string point_light(std::string_view inside) {
  return fmt::format("<emitter type=\"point\">{}</emitter>\n", inside);
}
const std::string kLinkedHero = "<shape type=\"sphere\">" + listed("link_sets", "hero, all") + "</shape>\n";
const std::string kLinkedFloor = "<shape type=\"rectangle\">" + listed("link_sets", "floor") + "</shape>\n";
const std::string kLinkedFog =
    R"(<shape type="cube"><bsdf type="null"/><medium type="homogeneous" name="interior">)" +
    listed("link_sets", "fog") + "</medium></shape>\n";

std::string why_refused(const std::string& objects) {
  const ReadResult r = read(with_sensor(objects));
  return r.scene ? "" : messages(r);
}
Scene linked_and_pruned(const std::string& objects) {
  return scene::pruned(must_read(with_sensor(objects)), {true}).scene;
}
const LightLinks& links_of(const Scene& s, std::size_t light = 0) {
  return std::get<PointEmitter>(s.emitters.at(light)).links;
}

TEST(LinkNames, ListsHaveWhatIsInASetAndInNoneThatIsTakenOut) {
  const LinkList list = link_list("a, b,-c");

  EXPECT_TRUE(list.has({"a"}));
  EXPECT_TRUE(list.has({"b", "x"}));
  EXPECT_FALSE(list.has({"a", "c"}));
  EXPECT_FALSE(list.has({"x"}));
  EXPECT_FALSE(list.has({}));
  EXPECT_TRUE(link_list("-c").has({}));
  EXPECT_TRUE(link_list("-c").has({"x"}));
  EXPECT_FALSE(link_list("none").has({"x"}));
  EXPECT_EQ(link_list(" b , a,a"), link_list("a,b"));
  EXPECT_TRUE(link_list("").everything());
}

TEST(Links, OfLightsShapesAndMediaAreReadAndWritten) {
  const Scene s = must_read(with_sensor(
      kLinkedHero + kLinkedFloor + kLinkedFog +
      point_light(listed("receivers", "hero, fog, -floor") + listed("blockers", "none")) +
      "<shape type=\"disk\"><emitter type=\"area\">" + listed("receivers", "-all") + "</emitter></shape>"));

  EXPECT_EQ(s.shapes.at(0).link_sets, "hero, all");
  EXPECT_EQ(std::get<HomogeneousMedium>(s.media.at(0)).link_sets, "fog");
  EXPECT_EQ(links_of(s), (LightLinks{"hero, fog, -floor", "none"}));
  EXPECT_EQ(s.shapes.at(3).emitter->links, (LightLinks{"-all", ""}));
  EXPECT_EQ(must_read(write_xml(s)), s);
  EXPECT_EQ(deserialize_scene(serialize(s)).value(), s);
}

TEST(Links, OfScenesWithoutThemAreNotWritten) {
  EXPECT_EQ(serialize(must_read(with_sensor(point_light("")))).find("link"), std::string::npos);
}

TEST(Links, NameMustBeOfASetThatSomethingIsIn) {
  EXPECT_THAT(why_refused(kLinkedHero + point_light("\n" + listed("receivers", "heros"))),
              AllOf(HasSubstr("test.xml:4:33: error: no shape or medium is in the link set \"heros\""),
                    HasSubstr("did you mean 'hero'?")));
  EXPECT_THAT(why_refused(kLinkedHero + point_light(listed("blockers", "hero, -floor"))),
              HasSubstr("no shape or medium is in the link set \"floor\""));
  EXPECT_THAT(why_refused(point_light(listed("receivers", "hero"))),
              HasSubstr("give some of them the parameter 'link_sets'"));
  EXPECT_EQ(why_refused(kLinkedHero + point_light(listed("receivers", "none"))), "");
}

TEST(Links, NamesInListsMustBeRight) {
  const std::string name = "the name of a link set has 1 to 63 ASCII letters";
  for (const char* wrong : {"a b", "a,,b", "a,", "\xc3\xa9", "--a", "a;b", "*"}) {
    EXPECT_THAT(why_refused(point_light(listed("receivers", wrong))), HasSubstr(name)) << wrong;
    EXPECT_THAT(why_refused("<shape type=\"cube\">" + listed("link_sets", wrong) + "</shape>"),
                HasSubstr(name))
        << wrong;
  }
  EXPECT_THAT(why_refused(point_light(listed("receivers", ""))), HasSubstr("has 1 to 64 names, not 0"));
  EXPECT_THAT(why_refused("<shape type=\"cube\">" + listed("link_sets", "-a") + "</shape>"), HasSubstr(name));
  EXPECT_THAT(why_refused("<shape type=\"cube\">" + listed("link_sets", "a, none") + "</shape>"),
              HasSubstr("nothing can be in the link set \"none\""));
  EXPECT_THAT(why_refused(kLinkedHero + point_light(listed("receivers", "hero, -hero"))),
              HasSubstr("the link set \"hero\" is both in the list and, as \"-hero\", taken out of it"));
  std::string many = "a";
  for (int i = 0; i < 64; ++i) many += ", a" + std::to_string(i);
  EXPECT_THAT(why_refused(point_light(listed("receivers", many))), HasSubstr("has 1 to 64 names, not 65"));
}

// A scene may have a thousand sets, but not a thousand different lists of them.
TEST(Links, ListsAreLimitedInNumber) {
  const auto with_lists = [](int count) {
    std::string objects;
    for (int i = 0; i < 1000; ++i)
      objects +=
          fmt::format("<shape type=\"sphere\">{}</shape>\n", listed("link_sets", fmt::format("s{}", i)));
    for (int i = 0; i < count; ++i)
      for (int twice = 0; twice < 2; ++twice)
        objects += point_light(listed("receivers", fmt::format("s{}, s0", i)));
    return objects;
  };

  EXPECT_EQ(why_refused(with_lists(64)), "");
  EXPECT_THAT(
      why_refused(with_lists(65)),
      AllOf(HasSubstr("test.xml:1130:"), HasSubstr("64 different lists of receivers and blockers at most")));

  Scene s = must_read(with_sensor(with_lists(64)));
  EXPECT_EQ(scene::find_inconsistency(s), "");
  std::get<PointEmitter>(s.emitters[0]).links.blockers = "s900";
  EXPECT_THAT(scene::find_inconsistency(s), HasSubstr("more than 64 different lists"));
}

TEST(Links, MayNotBeWrongInJson) {
  Scene s = must_read(with_sensor(kLinkedHero + point_light(listed("receivers", "hero"))));
  std::get<PointEmitter>(s.emitters[0]).links.receivers = "a b";

  const auto again = deserialize_scene(serialize(s));

  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().message, HasSubstr("receivers"));
}

// ---- what becomes of them

TEST(Links, ToAllThatThereIsAreLeftOut) {
  const std::string objects = "<shape type=\"sphere\"/>\n<shape type=\"rectangle\"/>\n";
  const std::string light = point_light("");
  const Scene bare = linked_and_pruned(objects + light);

  EXPECT_EQ(
      linked_and_pruned("<shape type=\"sphere\">" + listed("link_sets", "a") +
                        "</shape>\n<shape type=\"rectangle\">" + listed("link_sets", "b") + "</shape>\n" +
                        point_light(listed("receivers", "a, b") + listed("blockers", "b, a"))),
      bare);
  // The two receivers of the other light stay.
  const Scene some =
      linked_and_pruned(kLinkedHero + kLinkedFloor + point_light(listed("receivers", "hero, floor")) +
                        point_light(listed("receivers", "hero")));
  EXPECT_EQ(links_of(some, 0), LightLinks{});
  EXPECT_EQ(links_of(some, 1), (LightLinks{"hero", ""}));
  EXPECT_EQ(some.shapes[0].link_sets, "hero, all");
}

TEST(Links, ToAllShapesButNotToAMediumStay) {
  const Scene s = linked_and_pruned(kLinkedHero + kLinkedFog +
                                    point_light(listed("receivers", "hero") + listed("blockers", "hero")));

  EXPECT_EQ(links_of(s), (LightLinks{"hero", ""}));
}

TEST(Links, CountAmongTheNeeds) {
  const auto needs = [](const std::string& objects) {
    return scene::needs_of(linked_and_pruned(objects), true);
  };
  const scene::Needs some =
      needs(kLinkedHero + kLinkedFloor + point_light(listed("receivers", "hero")) + point_light(""));

  EXPECT_EQ(some.linked_lights, 1u);
  EXPECT_THAT(scene::canonical_json(some), HasSubstr("\"linked_lights\":1"));
  EXPECT_EQ(scene::canonical_json(needs(kLinkedHero + point_light(""))).find("linked_lights"),
            std::string::npos);
}

// A medium in an opaque body is kept if light passes the body: it attenuates this light.
TEST(Links, MediumInWhatLightPassesStays) {
  const std::string body = R"(<shape type="sphere"><point name="center" x="0" y="0" z="9"/>)" +
                           listed("link_sets", "body") +
                           R"(<bsdf type="diffuse"/><medium type="homogeneous" name="interior"/></shape>)";

  EXPECT_TRUE(linked_and_pruned(body + kLinkedFloor + point_light(listed("blockers", "body"))).media.empty());
  EXPECT_EQ(linked_and_pruned(body + kLinkedFloor + point_light(listed("blockers", "-body"))).media.size(),
            1u);
}

TEST(Links, WarnOfSetsThatHaveNoEffect) {
  const auto said = [](const std::string& objects) {
    const ReadResult r = read(with_sensor(objects));
    EXPECT_TRUE(r.scene) << messages(r);
    return messages(r);
  };
  const std::string fog =
      R"(<shape type="cube"><bsdf type="null"/><string name="link_sets" value="edge"/>
<medium name="interior" type="homogeneous"><string name="link_sets" value="haze"/></medium></shape>)";
  const auto lamp = [](const std::string& parameter, const std::string& list) {
    return fmt::format(R"(<emitter type="point"><string name="{}" value="{}"/></emitter>)", parameter, list);
  };
  EXPECT_THAT(said(fog + lamp("blockers", "-haze")), HasSubstr("media attenuate all light"));
  EXPECT_THAT(said(fog + lamp("receivers", "edge")),
              HasSubstr("no surface and no medium is in the link set \"edge\""));
  EXPECT_THAT(said(fog + lamp("receivers", "-haze")), Not(HasSubstr("no effect")));
}

TEST(Links, NamesAreSeparatedByAnyBlanks) {
  EXPECT_EQ(link_sets(" a,\t b\n,c "), (std::vector<std::string>{"a", "b", "c"}));
}

}  // namespace
}  // namespace ls
