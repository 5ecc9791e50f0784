// Random scenes, most of them with values at the ends of what can be said: each is read or refused with a
// place, and what is read renders to finite pixels, clean or counted, the same in every variant.
#include <fmt/format.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/scene/json/serialize.h"
#include "core/scene/schema/validate.h"
#include "formats/reader/xml_write.h"
#include "tests/property/random_scene.h"
#include "tests/property/watch.h"
#include "tests/support/render_check.h"

namespace ls::test {
namespace {

constexpr std::uint64_t kRandomScenes = 200;  // of a usual run
constexpr SampleRange kSamples{0, 4};

struct Tally {
  std::uint64_t scenes = 0, refused_by_reader = 0, refused_by_renderer = 0, unclean = 0;
};

// The scene, after a journey through text. Nothing: refused, as it may be.
std::optional<Scene> reread(RandomScene& s, Tally& tally) {
  EXPECT_EQ(scene::find_inconsistency(s.scene), "");
  const ReadResult r = read_scene("random.xml", write_xml(s.scene), s.assets);
  for (const Diagnostic& d : r.diagnostics) {
    EXPECT_GT(d.place.line, 0) << format_diagnostic(d);
    EXPECT_FALSE(d.text.empty());
  }
  if (!r.scene) {
    EXPECT_FALSE(r.diagnostics.empty());
    ++tally.refused_by_reader;
    if (std::getenv("LIGHTSHAFT_TELL_REFUSED"))
      fmt::print("scene {}: {}\n", s.seed, r.diagnostics.empty() ? "" : r.diagnostics[0].text);
    return std::nullopt;
  }
  EXPECT_EQ(digest_of(*r.scene), digest_of(s.scene)) << serialize(*r.scene) << "\n" << serialize(s.scene);
  const auto travelled = deserialize_scene(serialize(*r.scene));
  if (travelled)
    EXPECT_TRUE(*travelled == *r.scene);
  else
    ADD_FAILURE() << travelled.error().message;
  return r.scene;
}

// How bright the brightest source is.
double brightest(const Scene& s) {
  double most = 0;
  const auto see = [&](const Rgb& c) { most = std::max({most, c[0], c[1], c[2]}); };
  for (const Texture& t : s.textures)
    if (const auto* c = std::get_if<ConstantTexture>(&t)) see(c->value);
  for (const Emitter& e : s.emitters)
    std::visit(
        [&](const auto& light) {
          if constexpr (requires { light.scale; })
            see({light.scale, 0, 0});
          else if constexpr (requires { light.radiance; })
            see(light.radiance);
          else if constexpr (requires { light.irradiance; })
            see(light.irradiance);
          else
            see(light.intensity);
        },
        e);
  for (const Medium& m : s.media) {
    if (const auto* h = std::get_if<HomogeneousMedium>(&m)) see(h->emission), see(h->source_radiance);
    if (const auto* h = std::get_if<HeterogeneousMedium>(&m)) see({h->emission_scale, 0, 0});
  }
  for (const Volume& v : s.volumes)
    if (const auto* c = std::get_if<ConstVolume>(&v)) see(c->value);
  return most;
}

// Light that a sample can't hold is counted and no error: of sources that bright, and of a medium that gives
// off light on a way without an end.
bool may_be_too_bright(const RandomScene& random) {
  constexpr double kBright = 1e15;
  const Scene& s = random.scene;
  if (std::max(brightest(s), random.assets.largest()) > kBright) return true;
  return std::any_of(s.media.begin(), s.media.end(), [](const Medium& m) {
    const auto* even = std::get_if<HomogeneousMedium>(&m);
    const auto* grid = std::get_if<HeterogeneousMedium>(&m);
    return (even && even->emission != Rgb{0, 0, 0}) || (grid && grid->emission);
  });
}

// The first sample that went wrong, for whoever looks into it.
std::string first_wrong(const render::World& w, FrameSize size) {
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      for (std::uint64_t n = kSamples.s0; n < kSamples.s1; ++n) {
        const auto v = render::render_sample(w, x, y, n);
        if (!v.finite)
          return fmt::format("sample {} of pixel {}, {}: {} {} {}", n, x, y, v.rgb[0], v.rgb[1], v.rgb[2]);
      }
  return "none";
}

void check_tile(const RandomScene& s, const render::World& w, const render::TileResult& r, Tally& tally) {
  for (const float x : r.sums) {
    ASSERT_TRUE(std::isfinite(x));
    ASSERT_TRUE(x >= 0) << x;
    ASSERT_TRUE(x == 0 || std::isnormal(x)) << x;
  }
  EXPECT_EQ(r.health.negative, 0u);
  EXPECT_EQ(r.health.majorant_violations, 0u);
  if (r.health.nonfinite == 0) return;
  ++tally.unclean;
  EXPECT_TRUE(may_be_too_bright(s)) << r.health.nonfinite << " samples went wrong; the first is "
                                    << first_wrong(w, s.scene.film.image_size());
}

void check_scene(RandomScene& s, Tally& tally) {
  ++tally.scenes;
  const auto scene = reread(s, tally);
  if (!scene) return;
  const auto world = render::build_world(*scene, settings_of(*scene, s.seed), s.assets.files(), 1);
  if (!world) {
    EXPECT_TRUE(world.error().code == Errc::invalid_argument ||
                world.error().code == Errc::resource_exhausted);
    EXPECT_FALSE(world.error().message.empty());
    ++tally.refused_by_renderer;
    if (std::getenv("LIGHTSHAFT_TELL_REFUSED")) fmt::print("scene {}: {}\n", s.seed, world.error().message);
    return;
  }
  const FrameSize size = scene->film.image_size();
  const PixelRect all{0, 0, size.width, size.height};
  const auto usual = render::render_tile(**world, all, kSamples, nullptr, nullptr);
  check_tile(s, **world, usual, tally);
  for (const std::string& variant : render::covering_variants(**world))
    ASSERT_EQ(render::render_tile_as(**world, variant, all, kSamples).sums, usual.sums) << variant;
  EXPECT_FALSE(render::describe(**world).variant.empty());
}

// What went wrong with one scene; the seed and the scene itself are told with it.
std::string wrong_with(RandomScene& s, Tally& tally) {
  testing::TestPartResultArray results;
  {
    testing::ScopedFakeTestPartResultReporter reporter(
        testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &results);
    check_scene(s, tally);
  }
  std::string text;
  for (int i = 0; i < results.size(); ++i)
    if (results.GetTestPartResult(i).failed())
      text += std::string(results.GetTestPartResult(i).message()) + "\n";
  return text;
}

TEST(RandomScenes, AreRefusedWithAPlaceOrRenderTheSameInEveryVariant) {
  const auto [first, count] = scenes_to_try(kRandomScenes);
  constexpr int kEnough = 12;  // failures
  Tally tally;
  double slowest = 0;
  std::uint64_t slow = 0;
  int failed = 0;
  for (std::uint64_t seed = first; seed < first + count && failed < kEnough; ++seed) {
    RandomScene s = random_scene(seed, random_choice(seed));
    const Watch watch(told(s));
    const auto start = std::chrono::steady_clock::now();

    const std::string wrong = wrong_with(s, tally);

    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (seconds > slowest) slowest = seconds, slow = seed;
    if (std::getenv("LIGHTSHAFT_TELL_SCENE")) fmt::print("{}", told(s));
    if (!wrong.empty()) ADD_FAILURE() << wrong << (failed++ ? fmt::format("scene {}\n", seed) : told(s));
  }
  fmt::print(
      "{} scenes; refused: {} by the reader, {} by the renderer; too bright: {}; slowest: {} in {:.2f} s\n",
      tally.scenes, tally.refused_by_reader, tally.refused_by_renderer, tally.unclean, slow, slowest);
  // Scenes that are nearly all refused would prove nothing.
  EXPECT_LT(tally.refused_by_reader + tally.refused_by_renderer, .4 * static_cast<double>(count) + 1);
}

}  // namespace
}  // namespace ls::test
