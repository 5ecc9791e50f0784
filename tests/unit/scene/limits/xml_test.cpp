// XML files at and beyond the limits of their size: the time to read or refuse them is linear in the size.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/scene/limits.h"
#include "tests/unit/scene/nori_testing.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

// Comparing each reference with every id, letter by letter, would take days.
TEST(HostileScenes, ManyUnresolvedReferencesBesideManyIdsAreSoonAnswered) {
  const std::string filler(40, 'y');
  std::string text;
  for (int i = 0; i < 150'000; ++i) text += fmt::format("<bsdf type=\"null\" id=\"{}{}\"/>", filler, i);
  text += "<bsdf type=\"twosided\">";
  for (int i = 0; i < 150'000; ++i) text += fmt::format("<ref id=\"{}{}\"/>", std::string(40, 'x'), i);
  const auto r = read(with_sensor(text + "</bsdf>"));
  EXPECT_EQ(r.diagnostics.size(), scene::kMaxDiagnostics);
  EXPECT_THAT(first(r), HasSubstr("no object has the id \"xxx"));
}

// The same for references in nested objects, which are resolved only when the outer object is converted.
TEST(HostileScenes, AFullReportEndsReadingWithinAnObject) {
  const std::string filler(40, 'y');
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += fmt::format("<bsdf type=\"null\" id=\"{}{}\"/>", filler, i);
  text += "<shape type=\"cube\">";
  for (int i = 0; i < 100'000; ++i)
    text += fmt::format("<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"{}{}\"/></bsdf>",
                        std::string(40, 'x'), i);
  EXPECT_LE(read(with_sensor(text + "</shape>")).diagnostics.size(), scene::kMaxDiagnostics);
}

TEST(HostileScenes, PlacesInOneLongLineAreNotCountedOutForWarningsThatAreNotShown) {
  std::string text = std::string(std::size_t{12} << 20, ' ') + kSensor;
  for (int i = 0; i < 300'000; ++i) text += "<sensor type=\"perspective\"/>";
  const auto r = read("<scene version=\"3.0.0\">" + text + "</scene>");
  EXPECT_TRUE(r.scene);
  ASSERT_EQ(r.diagnostics.size(), scene::kMaxDiagnostics);
  EXPECT_THAT(first(r), HasSubstr("a second sensor; the first (line 1) is used"));
}

TEST(HostileScenes, ALongRunAfterADollarIsNotTriedPrefixByPrefix) {
  std::string text = "<default name=\"a\" value=\"\"/>";
  const std::string run(65'000, 'a');
  for (int i = 0; i < 450; ++i) text += "<bsdf type=\"null\" id=\"$" + run + "\"/>";
  EXPECT_THAT(first(read(with_sensor(text))), HasSubstr("is given twice"));
}

// Comparing each name with all names before it would take half an hour.
TEST(HostileScenes, ANoriObjectOfCountlessElementsIsRefusedBeforeAnyIsLookedAt) {
  std::string text = "<mesh type=\"sphere\">";
  for (int i = 0; i < 400'000; ++i) text += fmt::format("<float name=\"a{}\" value=\"1\"/>", i);
  const auto r = read(nori_scene(text + "</mesh>"));
  EXPECT_FALSE(r.scene);
  ASSERT_EQ(r.diagnostics.size(), 1u);  // about the mesh, none about its elements
  EXPECT_THAT(first(r), HasSubstr("mesh \"sphere\" has 400000 elements in it; 4096 are allowed"));
}

TEST(HostileScenes, CountlessDefinesThatNothingAsksForAreSoonToldOf) {
  std::map<std::string, std::string> defines;
  std::string text;
  for (int i = 0; i < 2000; ++i) {
    defines[fmt::format("{}{}", std::string(58, 'x'), i)] = "1";
    text += fmt::format("<default name=\"{}{}\" value=\"\"/>", std::string(58, 'y'), i);
  }
  const auto r = read(with_sensor(text), {.defines = defines});
  EXPECT_TRUE(r.scene);
  EXPECT_EQ(r.diagnostics.size(), scene::kMaxDiagnostics);
}

}  // namespace
}  // namespace ls
