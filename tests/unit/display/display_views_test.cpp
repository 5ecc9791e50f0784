// Views of displays: the built-in ones against another version of OpenColorIO, configurations of users, the
// table for programs without OpenColorIO.
#include "util/display/display_views.h"

#include <Imath/half.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <tuple>

namespace ls {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Colour = std::array<double, 3>;

const char* const kAces = "sRGB - Display/ACES 1.0 - SDR Video";
const char* const kNone = "sRGB - Display/Un-tone-mapped";

std::array<int, 3> code(const DisplayView& view, const Colour& rgb) {
  const auto codes = view.codes(rgb);
  return {codes[0], codes[1], codes[2]};
}

// A configuration with one display, one view by the curve "half of the value", and the given colour spaces.
std::string config(const std::string& roles, const std::string& spaces) {
  return "ocio_profile_version: 2\nroles:\n  default: any\n" + roles +
         "file_rules:\n  - !<Rule> {name: Default, colorspace: default}\n"
         "displays:\n  Screen:\n    - !<View> {name: Halved, colorspace: halved}\n"
         "colorspaces:\n  - !<ColorSpace>\n    name: any\n" +
         spaces +
         "  - !<ColorSpace>\n    name: halved\n"
         "    from_scene_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, "
         "0, 0, 0, 1]}\n";
}

class Configurations : public ::testing::Test {
 protected:
  std::string file(const std::string& text) {
    const auto path = folder_ / "config.ocio";
    std::ofstream(path) << text;
    return path.string();
  }
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "ls-display-XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

// Codes by the configuration cg-config-v1.0.0_aces-v1.3_ocio-v2.1 in OpenColorIO 2.6.0 (Python), from its
// space "Linear Rec.709 (sRGB)". The two versions compute in float32 by other polynomials, so a value near
// the middle of two codes may round otherwise: codes may differ by 1.
TEST(BuiltInViews, AreThoseOfAces) {
  const auto views = DisplayViews::built_in();
  ASSERT_TRUE(views) << views.error().message;
  struct Case {
    const char* view;
    Colour rgb;
    std::array<double, 3> code;
  };
  const char* const kPq = "Rec.2100-PQ - Display/ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)";
  for (const Case& c :
       {Case{kAces, {0, 0, 0}, {0, 0, 0}}, Case{kAces, {.18, .18, .18}, {90.77, 90.77, 90.77}},
        Case{kAces, {1, 1, 1}, {207.05, 207.05, 207.05}}, Case{kAces, {.8, .2, .05}, {194.05, 104.02, 43.8}},
        Case{kAces, {.02, .05, .3}, {0, 31.73, 121.86}}, Case{kAces, {16, 8, 2}, {255, 251.34, 239.01}},
        Case{"Rec.1886 Rec.709 - Display/ACES 1.0 - SDR Video", {.8, .2, .05}, {197.23, 111.9, 54.81}},
        Case{"P3-D65 - Display/Un-tone-mapped", {.8, .2, .05}, {221.51, 142.42, 93.52}},
        Case{kPq, {.8, .2, .05}, {114.78, 93.63, 62.91}}, Case{kPq, {16, 8, 2}, {175.97, 171.43, 155.36}}}) {
    const auto view = views->view(c.view);
    ASSERT_TRUE(view) << view.error().message;
    const auto found = code(*view, c.rgb);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], c.code[i], 1) << c.view << " " << i;
  }
}

TEST(BuiltInViews, BeginWithTheCurveOfSrgb) {
  const auto views = DisplayViews::built_in().value();

  EXPECT_EQ(views.names().front(), "sRGB");
  EXPECT_EQ(views.standard(), "sRGB");
  EXPECT_EQ(code(views.view("sRGB").value(), {.5, .001, 2}), (std::array{188, 3, 255}));
}

// The curve of sRGB, and Rec. 709 to ACES and back to sRGB, are the same function. Our own curve compares
// with exact thresholds and the other is computed in float32, so codes may differ by 1.
TEST(BuiltInViews, WithoutToneMappingAreTheCurveOfSrgb) {
  const auto views = DisplayViews::built_in().value();
  const auto plain = views.view("sRGB").value(), none = views.view(kNone).value();

  for (const double light : {0., 1e-4, .002, .01, .18, .5, .99, 1.5, -.1})
    for (const Colour& rgb : {Colour{light, light, light}, Colour{light, .3, .02}, Colour{.7, .01, light}}) {
      const auto a = code(plain, rgb), b = code(none, rgb);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1) << light << " " << i;
    }
}

TEST(DisplayView, GivesAFiniteCodeForEveryNumber) {
  const auto views = DisplayViews::built_in().value();
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();

  for (const std::string& name : views.names()) {
    const auto view = views.view(name).value();
    EXPECT_EQ(code(view, {nan, .5, .5}), (std::array{255, 0, 255})) << name;
    EXPECT_EQ(code(view, {1e300, 1e300, 1e300}), code(view, {inf, inf, inf})) << name;
    EXPECT_EQ(code(view, {-inf, -inf, -inf})[0], code(view, {-1e9, -1e9, -1e9})[0]) << name;
    std::vector<float> extremes = {HUGE_VALF, -HUGE_VALF, std::nanf(""), 1e38f, -1e38f, 1e-45f};
    view.apply(extremes);
    for (const float v : extremes) EXPECT_TRUE(std::isfinite(v)) << name;
  }
  EXPECT_TRUE(views.view(kAces)->codes({}).empty());
}

// Along each axis light is exact at the table's places, in float16 with 11 bits: 2^-11 of a value of at most
// 1 is an eighth of a code, so rounding differs by at most one code.
TEST(DisplayView, TableHasTheColoursAtItsPlaces) {
  const auto view = DisplayViews::built_in()->view(kAces).value();
  const auto cube = view.cube();
  constexpr int n = DisplayView::kCubeSide;
  ASSERT_EQ(cube.size(), std::size_t{3} * n * n * n);
  EXPECT_EQ(DisplayView::cube_light(0), 0);
  EXPECT_FLOAT_EQ(DisplayView::cube_light(32), 255.f / 256);
  EXPECT_FLOAT_EQ(DisplayView::cube_light(64), 65535.f / 256);

  for (const auto& [r, g, b] : {std::tuple{0, 0, 0}, {32, 32, 32}, {30, 12, 3}, {5, 40, 64}}) {
    const auto exact =
        code(view, {DisplayView::cube_light(r), DisplayView::cube_light(g), DisplayView::cube_light(b)});
    for (std::size_t c = 0; c < 3; ++c) {
      Imath::half h;
      h.setBits(cube[3 * static_cast<std::size_t>((b * n + g) * n + r) + c]);
      EXPECT_NEAR(255 * std::clamp(static_cast<float>(h), 0.f, 1.f), exact[c], 1)
          << r << " " << g << " " << b;
    }
  }
}

TEST_F(Configurations, FindLinearRec709ByItsName) {
  for (const char* name : {"Linear Rec.709", "lin_rec709", "Linear Rec.709 (sRGB)", "Utility - Linear - sRGB",
                           "Linear BT.709", "linear srgb"}) {
    const auto views =
        DisplayViews::read(file(config("", fmt::format("  - !<ColorSpace>\n    name: \"{}\"\n", name))));
    ASSERT_TRUE(views) << name << views.error().message;
    EXPECT_EQ(views->names(), (std::vector<std::string>{"sRGB", "Screen/Halved"}));
    EXPECT_EQ(views->standard(), "Screen/Halved");
    EXPECT_EQ(code(views->view("Screen/Halved").value(), {1, .5, 0}), (std::array{128, 64, 0})) << name;
  }
  const auto inactive = DisplayViews::read(file("inactive_colorspaces: [Linear Rec.709]\n" +
                                                config("", "  - !<ColorSpace>\n    name: Linear Rec.709\n")));
  EXPECT_TRUE(inactive) << inactive.error().message;
  const auto alias = DisplayViews::read(
      file(config("", "  - !<ColorSpace>\n    name: lights\n    aliases: [x, lin_rec709]\n")));
  EXPECT_TRUE(alias);
}

// White of Rec. 709 is white of ACES2065-1 and, as D65, (0.95046, 1, 1.08906) in XYZ, of which the view
// halves each.
TEST_F(Configurations, FindLinearRec709ByTheirInterchange) {
  const auto aces = DisplayViews::read(file(config("  aces_interchange: any\n", "")));
  ASSERT_TRUE(aces) << aces.error().message;
  EXPECT_EQ(code(aces->view("Screen/Halved").value(), {1, 1, 1}), (std::array{128, 128, 128}));

  const auto xyz = DisplayViews::read(file(config("  cie_xyz_d65_interchange: any\n", "")));
  ASSERT_TRUE(xyz) << xyz.error().message;
  EXPECT_EQ(code(xyz->view("Screen/Halved").value(), {1, 1, 1}), (std::array{121, 128, 139}));
}

TEST_F(Configurations, AreRefusedWithWhatIsMissing) {
  EXPECT_THAT(DisplayViews::read(file(config("", ""))).error().message,
              HasSubstr("where linear Rec. 709 is"));
  EXPECT_THAT(DisplayViews::read("/nowhere/config.ocio").error().message, StartsWith("/nowhere/config.ocio"));
  EXPECT_THAT(DisplayViews::read(folder_.string()).error().message, HasSubstr("OpenColorIO"));
  EXPECT_THAT(DisplayViews::read(file("ocio_profile_version: 9\n")).error().message, HasSubstr("9"));
  const std::string whole = config("", "  - !<ColorSpace>\n    name: Linear Rec.709\n");
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += 7) {
    // Cut after a complete line the text may be a smaller configuration: then its views are shown or refused.
    const auto cut = DisplayViews::read(file(whole.substr(0, bytes)));
    if (!cut) continue;
    for (const std::string& name : cut->names()) {
      const auto view = cut->view(name);
      if (view) {
        EXPECT_EQ(code(*view, {0, 0, 0}), (std::array{0, 0, 0}));
      }
    }
  }
}

// The file of a look-up table is missing.
TEST_F(Configurations, LeaveOutViewsThatCannotBeShown) {
  const std::string text = config("", "  - !<ColorSpace>\n    name: Linear Rec.709\n") +
                           "  - !<ColorSpace>\n    name: broken\n"
                           "    from_scene_reference: !<FileTransform> {src: nowhere.cube}\n";
  const std::string halved = "    - !<View> {name: Halved, colorspace: halved}\n",
                    broken = "    - !<View> {name: Broken, colorspace: broken}\n";
  const auto at = text.find(halved);
  const auto second = DisplayViews::read(file(std::string(text).insert(at + halved.size(), broken)));
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->names(), (std::vector<std::string>{"sRGB", "Screen/Halved"}));
  ASSERT_EQ(second->left_out().size(), 1u);
  EXPECT_EQ(second->left_out().begin()->first, "Screen/Broken");
  EXPECT_THAT(second->left_out().begin()->second, HasSubstr("nowhere.cube"));
  EXPECT_FALSE(second->view("Screen/Broken"));

  // The first view is what people would see without choosing one.
  const auto first = DisplayViews::read(file(std::string(text).insert(at, broken)));
  EXPECT_THAT(first.error().message, AllOf(HasSubstr("its first view"), HasSubstr("nowhere.cube")));
}

TEST_F(Configurations, ComeFromTheEnvironment) {
  ::setenv("OCIO", file(config("", "  - !<ColorSpace>\n    name: Linear Rec.709\n")).c_str(), 1);
  const auto theirs = DisplayViews::of_environment();
  ::setenv("OCIO", "", 1);
  const auto ours = DisplayViews::of_environment();
  ::unsetenv("OCIO");

  ASSERT_TRUE(theirs && ours);
  EXPECT_THAT(theirs->names(), Contains("Screen/Halved"));
  EXPECT_THAT(ours->names(), Contains(kAces));
  EXPECT_THAT(ours->view("sRGB - Display/ACES 1.0 - SDR video").error().message, HasSubstr("did you mean"));
}

}  // namespace
}  // namespace ls
