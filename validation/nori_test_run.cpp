#include "validation/nori_test_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/assets/image.h"
#include "core/base/clock.h"
#include "validation/measure/hypothesis_tests.h"
#include "validation/measure/measure.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/random.h"

namespace ls::cli {
namespace {

using render::V2;
using render::V3;

constexpr std::uint64_t kSamplesPerCell = 5000;
// The density is integrated over each cell by the midpoint rule, on a grid of n x n points. n is doubled
// until that changes the integral by at most kConverged times the larger of the integral and kNegligible.
// With 1e6 samples, such errors add 1e6 * kConverged^2 = 0.01 to the statistic.
constexpr double kConverged = 1e-4, kNegligible = 1e-6;
constexpr int kFirstGrid = 8, kLastGrid = 512;
// If the integral of a density over all directions exceeds 1 by more than this, the density is wrong: the
// error of the numerical integration is far smaller.
constexpr double kExcess = 1e-3;

struct Surface {
  render::TextureTable textures;
  render::BsdfTable bsdfs;
  BsdfIndex index;
};

Result<Surface> surface_of(const Scene& scene, const render::AssetFiles& files) {
  Surface s;
  auto textures = render::TextureTable::build(scene, [&](const Asset& a) -> Result<ImageData> {
    const auto it = files.find(a.digest);
    if (it == files.end()) return fail(Errc::internal, "no file was given for '" + a.name + "'");
    return load_image(it->second, a.name);
  });
  if (!textures) return tl::unexpected(textures.error());
  s.textures = std::move(*textures);
  auto bsdfs = render::BsdfTable::build(scene, s.textures);
  if (!bsdfs) return tl::unexpected(bsdfs.error());
  s.bsdfs = std::move(*bsdfs);
  s.index = scene.shapes.at(0).bsdf;
  return s;
}

V3 direction(double cosine, double phi) {
  const double sine = std::sqrt(std::max(0., 1 - cosine * cosine));
  return {static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)),
          static_cast<float>(cosine)};
}

// The cells of a chi-square test of a BSDF's sampling. They divide the sphere of directions into parts of
// equal solid angle: `rows` rows in the cosine, and twice as many columns in phi. One more cell is for
// samples that are absorbed or scattered by a delta lobe.
class BinTable {
 public:
  BinTable(const render::BsdfTable& bsdfs, BsdfIndex index, int rows, const V3& wo)
      : bsdfs_(bsdfs), index_(index), rows_(rows), wo_(wo) {}

  std::size_t cells() const { return static_cast<std::size_t>(2 * rows_) * rows_ + 1; }

  std::vector<double> expected() const {
    std::vector<double> p;
    for (int i = 0; i < rows_; ++i)
      for (int j = 0; j < 2 * rows_; ++j) p.push_back(integral(i, j));
    double all = 0;
    for (const double x : p) all += x;
    p.push_back(1 - all);
    return p;
  }

  std::vector<double> observed(std::uint64_t samples, render::RandomStream stream) const {
    std::vector<double> n(cells(), 0);
    for (std::uint64_t k = 0; k < samples; ++k) {
      const float lobe = stream.uniform(), u = stream.uniform(), v = stream.uniform();
      const auto s = bsdfs_.sample(index_, V2(.5f, .5f), wo_, lobe, V2(u, v));
      ++n[s && !s->delta ? cell_of(s->wi) : cells() - 1];
    }
    return n;
  }

 private:
  std::size_t cell_of(const V3& w) const {
    double phi = std::atan2(double{w.y}, double{w.x});
    if (phi < 0) phi += 2 * std::numbers::pi;
    const int i = std::clamp(static_cast<int>((w.z + 1.) / 2 * rows_), 0, rows_ - 1);
    const int j = std::clamp(static_cast<int>(phi / std::numbers::pi * rows_), 0, 2 * rows_ - 1);
    return static_cast<std::size_t>(i) * 2 * rows_ + j;
  }

  double integral(int i, int j) const {
    const double width = 2. / rows_, angle = std::numbers::pi / rows_;
    const auto sum = [&](int n) {
      double total = 0;
      for (int a = 0; a < n; ++a)
        for (int b = 0; b < n; ++b)
          total += double{bsdfs_
                              .eval(index_, V2(.5f, .5f), wo_,
                                    direction(-1 + (i + (a + .5) / n) * width, (j + (b + .5) / n) * angle))
                              .pdf};
      return total * width * angle / (double{1} * n * n);
    };
    double coarse = sum(kFirstGrid);
    for (int n = 2 * kFirstGrid; n <= kLastGrid; n *= 2) {
      const double fine = sum(n);
      const bool done = std::abs(fine - coarse) <= kConverged * std::max(fine, kNegligible);
      coarse = fine;
      if (done) break;
    }
    return coarse;
  }

  const render::BsdfTable& bsdfs_;
  BsdfIndex index_;
  int rows_;
  V3 wo_;
};

class Runner {
 public:
  Runner(const NoriTest& test, const render::AssetFiles& files, const ValidateOptions& options)
      : test_(test), files_(files), options_(options) {}

  Result<std::vector<ValidateCase>> run() {
    if (test_.kind == NoriTestKind::chi2_test) return chi2();
    const std::size_t per_scene = test_.scenes.empty() ? 1 : test_.references.size() / test_.scenes.size();
    level_ = sidak(test_.significance_level, test_.references.size());
    for (std::size_t i = 0; i < test_.scenes.size(); ++i) {
      const std::string name = fmt::format("scene {}", i + 1);
      const double* expected = &test_.references[i * per_scene];
      const auto ok = per_scene == 3 ? t_test(test_.scenes[i],
                                              {name + ", red", name + ", green", name + ", blue"}, expected)
                                     : t_test(test_.scenes[i], {name}, expected);
      if (!ok) return tl::unexpected(ok.error());
    }
    for (std::size_t b = 0; b < test_.bsdfs.size(); ++b) {
      for (std::size_t a = 0; a < test_.angles.size(); ++a) {
        const double angle = test_.angles[a];
        const auto ok =
            t_test(albedo_scene(test_.bsdfs[b], angle), {fmt::format("bsdf {} at {} degrees", b + 1, angle)},
                   &test_.references[b * test_.angles.size() + a]);
        if (!ok) return tl::unexpected(ok.error());
      }
    }
    return std::move(cases_);
  }

 private:
  bool asked_for(const std::string& name) const { return name.find(options_.only) != std::string::npos; }

  // Tests the mean of a scene by t-tests, and adds a case for each of `names`: one name means the luminance,
  // three names mean the channels.
  Result<void> t_test(const Scene& scene, const std::vector<std::string>& names, const double* expected) {
    const std::uint64_t seed = options_.seed + number_++;
    bool any = false;
    for (const std::string& name : names) any = any || asked_for(name);
    if (!any) return {};
    // Switches path reuse off. With it, pixels would share parts of paths, so their errors would depend on
    // each other; but the standard error of a mean is computed as if the errors of the pixels were
    // independent.
    Scene alone = scene;
    alone.integrator.path_reuse = -1;
    const auto m = measure(alone, files_, test_.sample_count, seed, options_.threads);
    if (!m) return tl::unexpected(m.error());
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (!asked_for(names[k])) continue;
      const std::size_t q = names.size() == 1 ? static_cast<std::size_t>(Measured::luminance) : k;
      ValidateCase c;
      c.name = names[k];
      c.expected = expected[k];
      c.got = m->mean[q];
      c.standard_error = m->standard_error[q];
      c.level = level_;
      c.nonfinite = m->unhealthy();
      c.seconds = m->seconds / static_cast<double>(names.size());
      judge(c, m->freedom[q], cases::kRounding * std::abs(c.expected));
      add(std::move(c));
    }
    return {};
  }

  Result<std::vector<ValidateCase>> chi2() {
    const auto directions = static_cast<std::size_t>(test_.test_count);
    level_ = sidak(test_.significance_level, test_.bsdfs.size() * directions);
    for (std::size_t b = 0; b < test_.bsdfs.size(); ++b) {
      for (std::size_t i = 0; i < directions; ++i) {
        const std::uint64_t seed = options_.seed + number_++;
        const std::string name = fmt::format("bsdf {}, direction {}", b + 1, i + 1);
        if (!asked_for(name)) continue;
        auto c = chi2_case(test_, b, files_, seed);
        if (!c) return tl::unexpected(c.error());
        c->name = name;
        c->level = level_;
        if (c->why.empty() && !(c->p > level_))
          c->why = fmt::format("p = {:.2g} is below {:.2g}", c->p, level_);
        add(std::move(*c));
      }
    }
    return std::move(cases_);
  }

  void add(ValidateCase c) {
    if (options_.done) options_.done(c);
    cases_.push_back(std::move(c));
  }

  const NoriTest& test_;
  const render::AssetFiles& files_;
  const ValidateOptions& options_;
  double level_ = 0;
  std::uint64_t number_ = 0;  // number of tests so far; it is added to the seed of the next test
  std::vector<ValidateCase> cases_;
};

}  // namespace

Scene albedo_scene(const Scene& bsdf, double degrees) {
  Scene scene = bsdf;
  scene.emitters = {ConstantEmitter{{1, 1, 1}}};
  scene.media.clear();
  scene.integrator = {};
  scene.integrator.name = "path";
  scene.integrator.max_depth = 2;
  // A very narrow view of the middle of the rectangle [-1, 1]^2 in z = 0, `degrees` off its normal.
  const double a = degrees * std::numbers::pi / 180, s = std::sin(a), c = std::cos(a), away = 1;
  scene.sensor = {};
  // The columns of the matrix, which is stored by rows, are the camera's axes left, up and forward, and its
  // position. The camera points to the origin.
  scene.sensor.to_world.m = {0, c, -s, s * away, 1, 0, 0, 0, 0, -s, -c, c * away, 0, 0, 0, 1};
  scene.sensor.fov = 1e-3;
  scene.film.size = {1, 1};
  return scene;
}

Result<std::vector<ValidateCase>> validate_test(const NoriTest& test, const render::AssetFiles& files,
                                                const ValidateOptions& options) {
  return Runner(test, files, options).run();
}

Result<ValidateCase> chi2_case(const NoriTest& test, std::size_t bsdf, const render::AssetFiles& files,
                               std::uint64_t seed) {
  const SystemClock clock;
  const TimePoint start = clock.now();
  const auto surface = surface_of(test.bsdfs[bsdf], files);
  if (!surface) return tl::unexpected(surface.error());
  if (!surface->bsdfs.has_smooth(surface->index))
    return fail(Errc::invalid_argument,
                fmt::format("bsdf {} has delta lobes alone, so it has no density that a chi2test could test",
                            bsdf + 1));
  render::RandomStream stream(render::combine(seed, 0x6368693274657374));
  // Draws the outgoing direction with a density proportional to its cosine, as in Nori.
  const double u = stream.uniform(), phi = 2 * std::numbers::pi * stream.uniform();
  const BinTable table(surface->bsdfs, surface->index, test.resolution, direction(std::sqrt(1 - u), phi));
  const std::uint64_t samples =
      test.sample_count > 0 ? test.sample_count : kSamplesPerCell * (table.cells() - 1);
  std::vector<double> expected = table.expected();
  const double missing = expected.back();
  for (double& share : expected) share *= static_cast<double>(samples);
  const ChiSquare found = chi_square(expected, table.observed(samples, stream), test.min_expected);
  ValidateCase c;
  c.expected = found.freedom;
  c.got = found.statistic;
  c.standard_error = std::sqrt(2 * c.expected);
  c.z = (c.got - c.expected) / c.standard_error;
  c.p = found.p;
  if (found.impossible > 0) c.why = fmt::format("{} samples lie where the density is 0", found.impossible);
  if (missing < -kExcess) c.why = fmt::format("the density adds up to {:.6g}", 1 - missing);
  c.seconds = seconds(clock.now() - start);
  return c;
}

}  // namespace ls::cli
