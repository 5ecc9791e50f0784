// Photometric files of lamps (IES), as images of all directions.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/assets/image.h"
#include "tests/unit/assets/hostile.h"

namespace ls {
namespace {

using test::bytes_of;
using testing::HasSubstr;

struct Photometry {
  std::string before = "IESNA:LM-63-2002\n[TEST] made here\nTILT=NONE\n";
  double multiplier = 1, ballast = 1;
  int type = 1;
  std::vector<double> vertical, horizontal;
  std::function<double(double v, double h)> candela = [](double, double) { return 1; };

  std::string text() const {
    std::string s = before + fmt::format("1 1000 {} {} {} {} 2 0.1 0.2 0\n{} 1 50\n", multiplier,
                                         vertical.size(), horizontal.size(), type, ballast);
    s += fmt::format("{}\n{}\n", fmt::join(vertical, " "), fmt::join(horizontal, " "));
    for (const double h : horizontal) {
      for (const double v : vertical) s += fmt::format("{} ", candela(v, h));
      s += "\n";
    }
    return s;
  }
};

ImageData decode_lamp(const std::string& text) {
  const auto image = decode_image("lamp.ies", bytes_of(text));
  EXPECT_TRUE(image) << (image ? "" : image.error().message);
  return image ? *image : ImageData{};
}
std::string ies_refusal(const std::string& text) {
  const auto image = decode_image("lamp.ies", bytes_of(text));
  return image ? "accepted" : image.error().message;
}

// The texel of a direction by Clarberg's equal-area map, as in the section on spherical geometry of pbrt-v4's
// book, where the map's axes are the same.
double at(const ImageData& image, double x, double y, double z) {
  const double length = std::hypot(x, y, z);
  x /= length, y /= length, z /= length;
  const double r = std::sqrt(1 - std::abs(z)), ax = std::abs(x), ay = std::abs(y);
  double phi = std::max(ax, ay) == 0 ? 0 : std::atan2(ay, ax) * 2 / std::numbers::pi;
  double v = phi * r, u = r - v;
  if (z < 0) {
    const double folded = 1 - v;
    v = 1 - u;
    u = folded;
  }
  const auto texel = [&](double s, double sign) {
    const double place = (std::copysign(s, sign) + 1) / 2 * image.width;
    return std::min<std::size_t>(image.width - 1, static_cast<std::size_t>(place));
  };
  return double{image.f32[texel(v, y) * image.width + texel(u, x)]};
}
// The same, of angles of type C.
double at_angles(const ImageData& image, double v, double h) {
  const double k = std::numbers::pi / 180;
  return at(image, std::sin(v * k) * std::cos(h * k), -std::sin(v * k) * std::sin(h * k), std::cos(v * k));
}
std::vector<double> steps(double from, double to, double step) {
  std::vector<double> all;
  for (double x = from; x <= to; x += step) all.push_back(x);
  return all;
}

// A texel is at most .5 degrees wide, and the intensities below change by at most 10 a degree.
constexpr double kTexel = 6;

TEST(Ies, IntensitiesAreWhereTheirAnglesPoint) {
  const auto candela = [](double v, double h) {
    return 1000 + 3 * v + (h <= 90 ? 4 * h : (360 - h) * 4 / 3);
  };
  const ImageData image = decode_lamp(
      Photometry{.vertical = steps(0, 180, 10), .horizontal = steps(0, 360, 15), .candela = candela}.text());
  EXPECT_EQ(image.width, image.height);
  EXPECT_EQ(image.channels, 1u);
  for (const double v : {1., 20., 77., 91., 130., 178.})
    for (const double h : {1., 29., 90., 170., 190., 271., 359.})
      EXPECT_NEAR(at_angles(image, v, h), candela(v, h), v < 5 || v > 175 ? 400 : kTexel * 1.5)
          << v << " " << h;
}

TEST(Ies, SymmetricLampsAreCompleted) {
  const auto of = [](std::vector<double> horizontal) {
    return decode_lamp(Photometry{
        .vertical = {0, 90, 180}, .horizontal = std::move(horizontal), .candela = [](double, double h) {
          return 100 + h;
        }}.text());
  };
  const ImageData around = of({30}), quarter = of({0, 45, 90}), half = of({0, 90, 180}),
                  other = of({90, 180, 270}), open = of({0, 90, 180, 270});
  for (const double h : {10., 100., 200., 300.}) {
    EXPECT_NEAR(at_angles(around, 60, h), 130, kTexel) << h;
    EXPECT_NEAR(at_angles(quarter, 60, h),
                100 + (h <= 90    ? h
                       : h <= 180 ? 180 - h
                       : h <= 270 ? h - 180
                                  : 360 - h),
                kTexel)
        << h;
    EXPECT_NEAR(at_angles(half, 60, h), 100 + (h <= 180 ? h : 360 - h), kTexel) << h;
    EXPECT_NEAR(at_angles(other, 60, h), 100 + (h < 90 ? 180 - h : h <= 270 ? h : 540 - h), kTexel) << h;
  }
  // 360 degrees are 0 degrees again
  EXPECT_NEAR(at_angles(open, 60, 300), 100 + 270 * 2 / 3., kTexel);
}

TEST(Ies, TypesAAndBTurnAboutTheirAxes) {
  const double k = std::numbers::pi / 180, h = 30 * k, v = 50 * k;
  for (const int type : {2, 3}) {
    const auto candela = [](double vertical, double horizontal) {
      return 200 + vertical + 2 * horizontal / 3;
    };
    const ImageData image = decode_lamp(Photometry{
        .type = type, .vertical = steps(-90, 90, 10), .horizontal = steps(-90, 90, 10), .candela = candela}
                                            .text());
    const double there = type == 2
                             ? at(image, std::sin(h), std::cos(h) * std::sin(v), std::cos(h) * std::cos(v))
                             : at(image, std::cos(v) * std::sin(h), std::sin(v), std::cos(v) * std::cos(h));
    EXPECT_NEAR(there, candela(50, 30), kTexel) << type;
    EXPECT_EQ(at(image, .1, .1, -1), type == 3 ? 0 : at(image, .1, .1, -1)) << "behind the lamp";
    // From 0 degrees on, a lamp is symmetric
    const ImageData one = decode_lamp(Photometry{
        .type = type, .vertical = steps(0, 90, 10), .horizontal = steps(0, 90, 10), .candela = candela}
                                          .text());
    for (const double sx : {-1, 1})
      for (const double sy : {-1, 1})
        EXPECT_NEAR(at(one, .4 * sx, .3 * sy, 1), at(image, .4, .3, 1), kTexel) << type;
  }
}

TEST(Ies, FactorsMultiply) {
  const ImageData image = decode_lamp(Photometry{
      .multiplier = 2.5,
      .ballast = .5,
      .vertical = {0, 180},
      .horizontal = {0},
      .candela = [](double, double) {
        return 8;
      }}.text());
  for (const float x : image.f32) ASSERT_EQ(x, 10);
}

TEST(Ies, ThereIsNoLightBeyondTheLastAngle) {
  const ImageData image = decode_lamp(Photometry{.vertical = {0, 90}, .horizontal = {0}}.text());
  EXPECT_EQ(at_angles(image, 88, 10), 1);
  EXPECT_EQ(at_angles(image, 92, 10), 0);
}

TEST(Ies, OlderAndOddFilesAreRead) {
  Photometry p{.vertical = {0, 45, 90}, .horizontal = {0}};
  const ImageData usual = decode_lamp(p.text());
  const auto same = [&](const std::string& before) {
    p.before = before;
    EXPECT_EQ(decode_lamp(p.text()).f32, usual.f32) << before;
  };
  same("IESNA91\nTILT=NONE\n");
  same("A TILTED LAMP = of 1986\nTILT = NONE\t\r\n");
  same("IESNA91\nTilt=None\n");
  same("IES:LM-63-2019\n[MANUFAC] \xe9\nTILT=INCLUDE\n1\n3\n0 45 90\n1 .9 .8\n");
  p.before = "IESNA:LM-63-2002\nTILT=NONE\n";
  std::string text = p.text();
  for (char& c : text)
    if (c == ' ') c = ',';
  EXPECT_EQ(decode_lamp(text).f32, usual.f32) << "numbers between commas";
  text = p.text();
  for (char& c : text)
    if (c == '\n') c = '\r';
  EXPECT_EQ(decode_lamp(text).f32, usual.f32) << "lines that end as in old Macs";
  EXPECT_EQ(decode_lamp(p.text() + "\nEND\n").f32, usual.f32) << "text behind the numbers";
}

TEST(Ies, BrokenFilesAreRefusedWithTheirLine) {
  Photometry p{.vertical = {0, 45, 90}, .horizontal = {0, 90}};
  const std::string fine = p.text();
  const auto with = [&](const auto& change) {
    Photometry other = p;
    change(other);
    return ies_refusal(other.text());
  };
  EXPECT_THAT(ies_refusal("IESNA:LM-63-2002\n[TEST]\n"), HasSubstr("no line begins with TILT="));
  EXPECT_THAT(with([](auto& q) { q.before = "TILT=other.tlt\n"; }), HasSubstr("line 1: TILT=other.tlt"));
  EXPECT_THAT(with([](auto& q) {
                q.vertical = {0, 90, 45};
              }),
              HasSubstr("the vertical angles do not ascend"));
  EXPECT_THAT(with([](auto& q) { q.vertical = {-90, 0, 90}; }), HasSubstr("0 to 180 degrees"));
  EXPECT_THAT(with([](auto& q) { q.horizontal = {0, 100}; }), HasSubstr("90, 180 or 360"));
  EXPECT_THAT(with([](auto& q) { q.candela = [](double, double) { return -1; }; }),
              HasSubstr("line 8: an intensity is -1"));
  EXPECT_THAT(with([](auto& q) { q.candela = [](double, double) { return NAN; }; }),
              HasSubstr("'nan' is no number"));
  EXPECT_THAT(with([](auto& q) { q.multiplier = 1e300; }), HasSubstr("an intensity is 1e+300"));
  EXPECT_THAT(with([](auto& q) { q.type = 4; }), HasSubstr("line 4: the photometric type"));
  EXPECT_THAT(ies_refusal(fine.substr(0, fine.size() - 5)),
              HasSubstr("line 9: 4 of 6 intensities: the file ends"));
  EXPECT_THAT(ies_refusal("IESNA91\nTILT=NONE\n1 1 1 4000000000 4000000000 1 2 0 0 0\n"),
              HasSubstr("the number of vertical angles"));
  EXPECT_THAT(ies_refusal(""), HasSubstr("lamp.ies"));
  EXPECT_THAT(ies_refusal(fine + "7\n"), HasSubstr("more than 6 intensities: 3 vertical times 2 horizontal"));
  EXPECT_THAT(with([](auto& q) { q.type = 0; }), HasSubstr("the photometric type, 1 to 3: this is 0"));
  EXPECT_THAT(with([](auto& q) { q.vertical = {0}; }), HasSubstr("only one vertical angle"));
  EXPECT_THAT(with([](auto& q) { q.horizontal = {0, .5}; }), HasSubstr("90, 180 or 360"));
  EXPECT_THAT(with([](auto& q) { q.type = 2, q.horizontal = {0}; }), HasSubstr("only one horizontal angle"));
  EXPECT_THAT(with([](auto& q) {
                q.vertical = {0, .05, .1, 180}, q.candela = [](double v, double) { return v == 0 ? 1e6 : 0; };
              }),
              HasSubstr("its beam is too narrow"));
}

TEST(Ies, HostileFilesAreRefusedOrRead) {
  const std::string file = Photometry{.vertical = {0, 90}, .horizontal = {0, 90}}.text();
  const auto decoder = [](std::string_view name, std::span<const std::byte> bytes) {
    return decode_ies(name, bytes);
  };
  // The decoder accepts only cuts after the first digit of the last number.
  EXPECT_EQ(test::accepted_truncations(file, decoder), 2);
  test::survive_mutations(
      file, decoder,
      [](const ImageData& image) {
        for (const float x : image.f32) ASSERT_TRUE(x >= 0 && x <= 1e30f);
      },
      40);
}

}  // namespace
}  // namespace ls
