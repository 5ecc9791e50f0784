// Hostile scene texts: reading takes bounded time and memory, and ends with a scene or with messages.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "core/scene/limits.h"
#include "formats/xml/source_text.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls {
namespace {

using ::testing::HasSubstr;

TEST(HostileScenes, SelfIncludeIsRefused) {
  MemoryAssets assets;
  assets.files["a.xml"] = "<scene version=\"3.0.0\"><include filename=\"a.xml\"/></scene>";
  const auto r = read_scene("main.xml", with_sensor("<include filename=\"a.xml\"/>"), assets);
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(first(r), HasSubstr("includes itself"));
  EXPECT_EQ(r.diagnostics[0].place, (SourcePlace{"a.xml", 1, 43}));
}

TEST(HostileScenes, IncludesThatMultiplyAreRefusedEarly) {
  MemoryAssets assets;
  for (int i = 0; i < 14; ++i) {
    std::string twice = fmt::format("<include filename=\"{}.xml\"/>", i + 1);
    assets.files[fmt::format("{}.xml", i)] = "<scene version=\"3.0.0\">" + twice + twice + "</scene>";
  }
  assets.files["14.xml"] = "<scene version=\"3.0.0\"><shape type=\"cube\"/></scene>";
  const auto r = read_scene("main.xml", with_sensor("<include filename=\"0.xml\"/>"), assets);
  EXPECT_FALSE(r.scene);
  EXPECT_THAT(first(r), HasSubstr("includes are limited"));
  EXPECT_LE(assets.reads, 10 * scene::kMaxIncludes);
}

TEST(HostileScenes, IncludeDepthIsLimited) {
  MemoryAssets assets;
  for (int i = 0; i < 40; ++i)
    assets.files[fmt::format("{}.xml", i)] =
        fmt::format("<scene version=\"3.0.0\"><include filename=\"{}.xml\"/></scene>", i + 1);
  EXPECT_THAT(first(read_scene("main.xml", with_sensor("<include filename=\"0.xml\"/>"), assets)),
              HasSubstr("includes are limited"));
}

TEST(HostileScenes, IncludedBytesAreCountedTogether) {
  MemoryAssets assets;
  assets.files["big.xml"] =
      "<scene version=\"3.0.0\">" + std::string(scene::kMaxTextBytes - 100, ' ') + "</scene>";
  std::string many;
  for (int i = 0; i < 4; ++i) many += "<include filename=\"big.xml\"/>";
  EXPECT_THAT(first(read_scene("main.xml", with_sensor(many), assets)), HasSubstr("limited to"));
}

TEST(HostileScenes, EntitiesAreNotExpanded) {
  const auto r = read(
      "<!DOCTYPE s [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;\">]><scene version=\"3.0.0\"><shape "
      "type=\"&b;\"/>" +
      kSensor + "</scene>");
  EXPECT_THAT(first(r), HasSubstr("there is no shape \"&b;\""));
}

TEST(HostileScenes, NestedParametersDoNotMultiply) {
  std::string text = "<scene version=\"3.0.0\"><default name=\"a\" value=\"aaaaaaaaaa\"/>";
  for (char c = 'b'; c <= 'k'; ++c) {
    std::string tenfold;
    for (int i = 0; i < 10; ++i) tenfold += fmt::format("${}", static_cast<char>(c - 1));
    text += fmt::format("<default name=\"{}\" value=\"{}\"/>", c, tenfold);
  }
  EXPECT_THAT(first(read(text + kSensor + "</scene>")), HasSubstr("longer than"));
}

TEST(HostileScenes, OversizedFileIsRefused) {
  const auto r = read(std::string(scene::kMaxTextBytes + 1, ' '));
  EXPECT_THAT(first(r), HasSubstr("limited to 32 MiB"));
}

TEST(HostileScenes, TooManyElementsAreRefused) {
  std::string text = "<scene version=\"3.0.0\">";
  for (std::size_t i = 0; i <= scene::kMaxElements; ++i) text += "<a/>";
  EXPECT_THAT(first(read(text + "</scene>")), HasSubstr("more than 500000 elements"));
}

TEST(HostileScenes, ElementWithCountlessAttributesIsRefused) {
  std::string text = "<shape type=\"cube\"";
  for (int i = 0; i < 1'000'000; ++i) text += fmt::format(" a{}=\"\"", i);
  EXPECT_THAT(first(read(with_sensor(text + "/>"))), HasSubstr("<shape> has more than 32 attributes"));
}

TEST(HostileScenes, NamesOfParametersAreBounded) {
  const std::string name(scene::kMaxParameterNameBytes + 1, 'a');
  EXPECT_THAT(first(read(with_sensor("<default name=\"" + name + "\" value=\"1\"/>"))),
              HasSubstr("longer than 128 bytes"));
  EXPECT_TRUE(read(with_sensor("<default name=\"" + name.substr(1) +
                               "\" value=\"1\"/><bsdf type=\"null\" id=\"$" + name.substr(1) + "\"/>"))
                  .scene);
}

TEST(HostileScenes, LineIndexOfATextOfEmptyLinesStaysSmall) {
  const std::size_t size = std::size_t{1} << 20;
  const scene::SourceText text("t", std::string(size, '\n'));
  EXPECT_EQ(text.line(size - 1), static_cast<int>(size));
  EXPECT_LT(text.index_bytes(), size / 512);
}

TEST(HostileScenes, LongChainsOfReferencesAreRefused) {
  std::string chain;
  for (int i = 0; i < 5000; ++i)
    chain += fmt::format(
        "<texture type=\"checkerboard\" id=\"t{}\"><ref name=\"color0\" id=\"t{}\"/></texture>", i, i + 1);
  EXPECT_THAT(first(read(with_sensor(chain + "<texture type=\"checkerboard\" id=\"t5000\"/>"))),
              HasSubstr("nested more than 64 deep"));
}

TEST(HostileScenes, ManyPropertiesTakeLinearTime) {
  std::string text = "<bsdf type=\"diffuse\">";
  for (int i = 0; i < 100'000; ++i) text += fmt::format("<float name=\"n{}\" value=\"1\"/>", i);
  EXPECT_EQ(read(with_sensor(text + "</bsdf>")).diagnostics.size(), scene::kMaxDiagnostics);
}

// Damages a good scene at random. It is still read, or refused with a place. A scene that is read is equal
// after serialisation and reading.
TEST(HostileScenes, RandomDamageNeverCrashes) {
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const std::string pieces[] = {"<",
                                ">",
                                "\"",
                                "/>",
                                "&#0;",
                                "$",
                                "$spp",
                                "<ref id=\"fog\"/>",
                                "-1e308",
                                "nan",
                                "\xc3",
                                " ",
                                "<!--",
                                "]]>",
                                "<include filename=\"cloud.vol\"/>"};
  int good = 0;
  for (int n = 0; n < 6000; ++n) {
    std::string text = kExample;
    for (std::size_t edits = 1 + below(3); edits > 0; --edits) {
      const std::size_t at = below(text.size());
      switch (below(4)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(20));
          break;
        case 2:
          text.insert(at, pieces[below(std::size(pieces))]);
          break;
        default:
          text.insert(below(text.size()), text.substr(at, 1 + below(200)));
      }
    }
    const auto r = read(text);
    if (r.scene) {
      ++good;
      const auto again = deserialize_scene(serialize(*r.scene));
      ASSERT_TRUE(again) << again.error().message;
      EXPECT_EQ(*again, *r.scene);
      continue;
    }
    ASSERT_FALSE(r.diagnostics.empty()) << text;
    for (const Diagnostic& d : r.diagnostics) {
      EXPECT_GT(d.place.line, 0);
      EXPECT_GT(d.place.column, 0);
      EXPECT_FALSE(format_diagnostic(d).empty());
    }
  }
  EXPECT_GT(good, 20) << "damage within numbers and names of ids leaves scenes that read";
}

}  // namespace
}  // namespace ls
