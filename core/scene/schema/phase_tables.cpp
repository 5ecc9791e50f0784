#include "core/scene/schema/phase_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/scene/limits.h"

namespace ls::scene {
namespace {

struct NamedList {
  std::string_view name;
  const std::vector<double>* numbers;
};

// The lists of values that are given, of one colour or of three.
std::vector<NamedList> lists_of(const TabulatedPhase& t) {
  if (!t.values.empty()) return {{"values", &t.values}};
  return {{"red", &t.red}, {"green", &t.green}, {"blue", &t.blue}};
}

double cosine_of_degrees(double angle) { return std::cos(angle * std::numbers::pi / 180); }

ParameterProblem problem_of_places(std::string_view name, const std::vector<double>& at, double first,
                                   double last, double (*cosine_of)(double)) {
  for (std::size_t i = 1; i < at.size(); ++i) {
    if (!(at[i] > at[i - 1]))
      return {name, fmt::format("must ascend: number {} is {} after {}", i + 1, at[i], at[i - 1])};
    if (1 - cosine_of(at[i]) == 1 - cosine_of(at[i - 1]))
      return {name, fmt::format("has numbers too close to each other: {} and {} are {} and {}", i, i + 1,
                                at[i - 1], at[i])};
  }
  if (at.front() != first || at.back() != last)
    return {name, fmt::format("leaves a hole: it goes from {} to {}, not from {} to {}", at.front(),
                              at.back(), first, last)};
  return {};
}

}  // namespace

ParameterProblem table_problem(const TabulatedPhase& t) {
  const bool coloured = !t.red.empty() || !t.green.empty() || !t.blue.empty();
  if (t.values.empty() == !coloured)
    return {"values", coloured ? "is given beside 'red', 'green' and 'blue'; give one or the other"
                               : "is missing: give 'values', or 'red', 'green' and 'blue'"};
  if (!t.nodes.empty() && !t.angles.empty())
    return {"angles", "is given beside 'nodes'; give one or the other"};
  const auto& places = t.nodes.empty() ? t.angles : t.nodes;
  const std::string_view of_places = t.nodes.empty() ? "angles" : "nodes";
  const auto lists = lists_of(t);
  for (const auto& [name, numbers] : lists) {
    if (numbers->size() < 2 || numbers->size() > kMaxPhaseAngles)
      return {name, fmt::format("has {} numbers; 2 to {} are wanted", numbers->size(), kMaxPhaseAngles)};
    if (numbers->size() != lists[0].numbers->size())
      return {name, fmt::format("has {} numbers, and '{}' {}", numbers->size(), lists[0].name,
                                lists[0].numbers->size())};
    if (!places.empty() && numbers->size() != places.size())
      return {name, fmt::format("has {} numbers, and '{}' {}", numbers->size(), of_places, places.size())};
    double most = 0;
    for (std::size_t i = 0; i < numbers->size(); ++i) {
      const double x = (*numbers)[i];
      if (!(x >= 0) || !std::isfinite(x)) return {name, fmt::format("has the number {} at {}", x, i + 1)};
      most = std::max(most, x);
    }
    if (!(most > 0)) return {name, "is zero everywhere: it scatters no light; for that, give an albedo of 0"};
    if (!(most <= 1e30)) return {name, fmt::format("reaches {}; at most 1e30 is allowed", most)};
  }
  if (!t.nodes.empty()) return problem_of_places("nodes", t.nodes, -1, 1, [](double c) { return c; });
  if (!t.angles.empty()) return problem_of_places("angles", t.angles, 0, 180, cosine_of_degrees);
  return {};
}

PhaseValues values_of(const TabulatedPhase& t) {
  PhaseValues out;
  for (const auto& [name, numbers] : lists_of(t)) out.values.push_back(*numbers);
  const std::size_t n = out.values[0].size();
  if (!t.nodes.empty()) {
    out.cosines = t.nodes;
  } else if (!t.angles.empty()) {
    // Angles ascend from straight on, cosines from straight back
    for (auto& list : out.values) std::ranges::reverse(list);
    for (std::size_t i = n; i-- > 0;) out.cosines.push_back(cosine_of_degrees(t.angles[i]));
  } else {
    for (std::size_t i = 0; i < n; ++i)
      out.cosines.push_back(-1 + 2 * static_cast<double>(i) / static_cast<double>(n - 1));
  }
  out.cosines.front() = -1;
  out.cosines.back() = 1;
  return out;
}

int nesting_of(std::span<const Phase> phases, PhaseIndex i) {
  const auto* b = std::get_if<BlendPhase>(&phases[i.value]);
  return b ? 1 + std::max(nesting_of(phases, b->first), nesting_of(phases, b->second)) : 1;
}

bool nested_too_deep(std::span<const Phase> phases) {
  // Each pass finds the depths that are one larger than those that the pass before found
  std::vector<int> depth(phases.size(), 1);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < phases.size(); ++i) {
      const auto* b = std::get_if<BlendPhase>(&phases[i]);
      if (!b) continue;
      const int d = 1 + std::max(depth[b->first.value], depth[b->second.value]);
      if (d > kMaxPhaseNesting) return true;
      changed |= std::exchange(depth[i], d) != d;
    }
  }
  return false;
}

}  // namespace ls::scene
