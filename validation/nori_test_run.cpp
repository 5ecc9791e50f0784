#include "validation/nori_test_run.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "validation/chi_square.h"
#include "validation/measure/hypothesis_tests.h"
#include "validation/measure/measure.h"
#include "validation/significance_level.h"

namespace ls::cli {
namespace {

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

  // Tests a scene's mean: with one name its luminance, with three names its channels.
  Result<void> t_test(const Scene& scene, const std::vector<std::string>& names, const double* expected) {
    const std::uint64_t seed = options_.seed + number_++;
    bool any = false;
    for (const std::string& name : names) any = any || asked_for(name);
    if (!any) return {};
    // The error of the mean is estimated from pixels, so their errors must be independent: pixels share no
    // paths.
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
  std::uint64_t number_ = 0;  // number of the case, which determines its seed
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
  // A very narrow view that hits the rectangle, [-1, 1]^2 in z = 0, in its middle.
  const double a = degrees * std::numbers::pi / 180, s = std::sin(a), c = std::cos(a), away = 1;
  scene.sensor = {};
  // Columns: left, up, forward, position; forward points to the origin.
  scene.sensor.to_world.m = {0, c, -s, s * away, 1, 0, 0, 0, 0, -s, -c, c * away, 0, 0, 0, 1};
  scene.sensor.fov = 1e-3;
  scene.film.size = {1, 1};
  return scene;
}

Result<std::vector<ValidateCase>> validate_test(const NoriTest& test, const render::AssetFiles& files,
                                                const ValidateOptions& options) {
  return Runner(test, files, options).run();
}

}  // namespace ls::cli
