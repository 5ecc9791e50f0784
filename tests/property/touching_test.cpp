// What must not change an image where surfaces lie on each other: a twin that nobody sees, a hair between
// them, a cut.
#include "tests/property/metamorphic.h"

namespace ls::test {
namespace {

// Every shape once more in its own place, letting all light pass and saying nothing of media.
std::optional<SceneBuilder> with_twins(const SceneBuilder& builder, bool first) {
  SceneBuilder out = builder;
  const BsdfIndex null = out.null();
  std::vector<Shape> twins = builder.scene.shapes;
  for (Shape& twin : twins) {
    twin.bsdf = null;
    twin.interior.reset();
    twin.exterior.reset();
    twin.is_medium_transition = false;
    twin.emitter.reset();
  }
  auto& shapes = out.scene.shapes;
  shapes.insert(first ? shapes.begin() : shapes.end(), twins.begin(), twins.end());
  return out;
}

TEST(Touching, InvisibleDuplicateChangesNothing) {
  Tests tests("property/twins");
  for (const bool first : {true, false}) {
    SCOPED_TRACE(first ? "listed before" : "listed after");
    expect_alike(tests, scenes(), [&](const SceneBuilder& builder) { return with_twins(builder, first); });
  }
  tests.close();
}

// Fog in a corner of a room, in boxes between these places of each axis.
struct Cuts {
  std::vector<double> x{-1, 1}, y{-1, 1}, z{-1, 1};
};
SceneBuilder fog_in_a_corner(const Cuts& cuts, bool grid, const std::string& integrator) {
  SceneBuilder builder({12, 12});
  builder.shape(RectangleShape{}, translate({0, 0, -1}) * scale(4), builder.diffuse(.5));
  builder.shape(RectangleShape{}, translate({0, 1, 0}) * rotate_x(90) * scale(4), builder.diffuse(.75));
  builder.shape(RectangleShape{}, translate({1, 0, 0}) * rotate_y(-90) * scale(4), builder.diffuse(.25));
  std::vector<float> values(6 * 6 * 6);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>((i * 7919) % 11) / 8;
  const MediumIndex fog =
      grid ? builder.heterogeneous(builder.grid({6, 6, 6}, values, translate({-1, -1, -1}) * scale(2)),
                                   {.9, .8, .5}, .75, .5)
           : builder.homogeneous({.25, .5, 1}, {.9, .8, .5}, .5);
  const BsdfIndex null = builder.null();
  for (std::size_t i = 1; i < cuts.x.size(); ++i)
    for (std::size_t j = 1; j < cuts.y.size(); ++j)
      for (std::size_t k = 1; k < cuts.z.size(); ++k) {
        const Vec3 a{cuts.x[i - 1], cuts.y[j - 1], cuts.z[k - 1]}, b{cuts.x[i], cuts.y[j], cuts.z[k]};
        builder.container(CubeShape{},
                          translate({(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2}) *
                              scale((b[0] - a[0]) / 2, (b[1] - a[1]) / 2, (b[2] - a[2]) / 2),
                          null, fog);
      }
  builder.scene.emitters.push_back(PointEmitter{{-2, -3, 2}, {8, 6, 4}});
  builder.scene.emitters.push_back(DirectionalEmitter{{.25, .5, -1}, {1, .5, .25}});
  builder.environment(.125);
  builder.look({-4, -5, 2}, {0, 0, -.25}, 35);
  builder.scene.integrator.name = integrator;
  builder.scene.integrator.max_depth = 6;
  return builder;
}

// One box against others, in both integrators and kinds of media.
void expect_same_fog(std::string_view share, const std::vector<Cuts>& others) {
  Tests tests(share);
  std::uint64_t seed = 700;
  for (const bool grid : {false, true})
    for (const char* integrator : {"volpath", "volpath_distant_mis"})
      for (const Cuts& other : others) {
        const Comparison c =
            look(fog_in_a_corner({}, grid, integrator), fog_in_a_corner(other, grid, integrator), seed += 10,
                 tests.level(3), {256, 4096});
        EXPECT_EQ(c.verdict, Verdict::alike)
            << integrator << (grid ? ", grid: " : ", homogeneous: ") << c.told;
      }
  tests.close();
}

TEST(Touching, BoxesThatShareFacesAreOneBox) {
  expect_same_fog("property/shared_faces",
                  {{{-1, .25, 1}, {-1, 1}, {-1, 1}}, {{-1, 0, 1}, {-1, -.5, 1}, {-1, .125, .75, 1}}});
}

// A hair takes 1.2e-4 of the fog from each face, in place of which light may come through: some 4e-4 of the
// image. The standard error of a second look is 1e-3 of it or more.
TEST(Touching, TinyGapBetweenFogAndWallsChangesNothing) {
  constexpr double kHair = 0x1p-13;
  expect_same_fog("property/hair", {{{-1, 1 - kHair}, {-1, 1 - kHair}, {-1 + kHair, 1}}});
}

}  // namespace
}  // namespace ls::test
