// Phase functions of every kind for tests, and integrals over their angles.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/overloaded.h"
#include "worker/render/media/phase_function.h"

namespace ls::test {

struct NamedPhase {
  using V3d = render::V3d;
  std::string name;
  std::vector<render::PhaseFunctions::Kind> kinds;
  render::PhaseFunctions all;  // of `kinds`
  std::uint32_t which = 0;
  bool one_lobe = true;  // false: a mixture, which samples one of several lobes
  // A bound of the relative change of the function with a relative change of 1 - cos, or of 1 + cos backwards
  double steepness = 2;

  void add(render::PhaseFunctions::Kind kind) {
    kinds.push_back(kind);
    all.add(std::move(kind));
  }
  // The value of each colour, and their mean, in double: directions in float32 do not resolve all peaks.
  V3d value(const render::ScatteringAngle& a) const { return value(which, a); }
  double pdf(const render::ScatteringAngle& a) const {
    const V3d v = value(a);
    return (v.x + v.y + v.z) / 3;
  }

 private:
  V3d value(std::uint32_t i, const render::ScatteringAngle& a) const {
    return std::visit(overloaded{[&](const render::BlendedLobes& b) {
                                   return (1 - double{b.weight}) * value(b.first, a) +
                                          double{b.weight} * value(b.second, a);
                                 },
                                 [&](const render::TabulatedLobe& t) { return V3d(t.value(a)); },
                                 [&](const auto& one) { return V3d(one.density(a)); }},
                      kinds[i]);
  }
};

inline std::vector<NamedPhase> phase_kinds() {
  using namespace render;
  std::vector<NamedPhase> kinds;
  const auto add = [&](std::string name, PhaseFunctions::Kind kind, bool one_lobe = true,
                       double steepness = 2) {
    NamedPhase& n = kinds.emplace_back();
    n.name = std::move(name);
    n.add(std::move(kind));
    n.one_lobe = one_lobe;
    n.steepness = steepness;
  };
  add("rayleigh", RayleighLobe{});
  add("draine .6 1", DraineLobe{.6, 1});
  add("draine -.5 40", DraineLobe{-.5, 40});
  add("draine 0 1000", DraineLobe{0, 1000}, true, 1000);
  add("draine .999 1", DraineLobe{.999, 1});
  for (const double d : {.05, 1., 3., 5., 20., 50.})
    add(fmt::format("droplets {}", d), DropletLobe::of_diameter(d), false, 100);
  add("fournier_forand .1 1.33", FournierForandLobe(.1, 1.33));
  add("fournier_forand .018 1.1", FournierForandLobe(.018, 1.1));
  add("fournier_forand .4 1.8", FournierForandLobe(.4, 1.8));
  const std::vector<double> two[] = {{1, 3}}, runs[] = {{2, 0, 0, 1, 5, 0}},
                            colours[] = {{1, 2, 3, 0}, {6, 2, 1, 1}, {.5, 4, 0, 9}};
  add("table of two", TabulatedLobe(std::vector<double>{-1, 1}, two));
  add("table with zeros", TabulatedLobe(std::vector<double>{-1, -.7, -.1, 0, .9, 1}, runs), true, 1e4);
  add("table of colours", TabulatedLobe(std::vector<double>{-1, -.2, .4, 1}, colours), false, 100);
  NamedPhase& blend = kinds.emplace_back();
  blend.name = "blend of blends";
  blend.add(HenyeyGreensteinLobe{-.6});
  blend.add(DraineLobe{.5, 3});
  blend.add(BlendedLobes{.weight = .3f, .first = 0, .second = 1});
  blend.add(TabulatedLobe(std::vector<double>{-1, -.2, .4, 1}, colours));
  blend.add(BlendedLobes{.weight = .25f, .first = 2, .second = 3});
  blend.which = 4;
  blend.one_lobe = false;
  blend.steepness = 100;
  for (NamedPhase& kind : kinds) kind.all.find_mean_cosines();
  return kinds;
}

// The error of integral() and integral_below(): their steps have a relative width of 6e-4, so the midpoint
// rule is off by up to 3e-8 times the curvature of the function in ln x; at a kink or a jump by up to a
// step's share.
inline constexpr double kIntegralError = 2e-4;

// The integral of f(angle) over all directions scattered by less than `end`.
template <class F>
double integral_below(const render::ScatteringAngle& end, const F& f) {
  constexpr int kSteps = 50'000;
  const double least = std::log(1e-14);
  double sum = 0;
  // From straight on to 90 degrees in steps of ln x, and from there to straight back in steps of ln y
  for (const bool back : {false, true}) {
    double last = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double next = i + 1 == kSteps ? 1 : std::exp(least - least * (i + 1) / kSteps);
      double from = last, to = next;
      last = next;
      if (back)
        from = std::max(from, end.y);
      else
        to = std::min(to, end.x);
      if (!(to > from)) continue;
      const double middle = .5 * (from + to);
      const render::ScatteringAngle a{back ? 2 - middle : middle, back ? middle : 2 - middle};
      sum += f(a) * 2 * render::kPiD * (to - from);
    }
  }
  return sum;
}
template <class F>
double integral(const F& f) {
  return integral_below({2, 0}, f);
}

}  // namespace ls::test
