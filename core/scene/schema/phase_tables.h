// Checks of phase functions that concern several of their values.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/scene/schema/parameter_problem.h"

namespace ls::scene {

// Looks for what is wrong with the table. The parameter of the result is one of its lists.
ParameterProblem table_problem(const TabulatedPhase& table);

// The contents of a table without problems. `values` has one list, or one for each colour.
struct PhaseValues {
  std::vector<double> cosines;  // ascending from -1 to 1
  std::vector<std::vector<double>> values;
};
PhaseValues values_of(const TabulatedPhase& table);

// Returns how deep a phase function is nested; 1: it contains no others. None of those that it contains may
// be nested more than kMaxPhaseNesting deep, or contain itself.
int nesting_of(std::span<const Phase> phases, PhaseIndex i);
// Returns whether phase functions contain each other in a circle, or more than kMaxPhaseNesting deep. All
// indices must be valid.
bool nested_too_deep(std::span<const Phase> phases);

}  // namespace ls::scene
