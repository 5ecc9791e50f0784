// Rules of volumes, and of the media that they describe, that concern several of their values.
#pragma once

#include <span>

#include "core/scene/scene.h"
#include "core/scene/schema/parameter_problem.h"

namespace ls::scene {

// Looks for what is wrong with the volume apart from what it contains. All indices must be valid.
ParameterProblem volume_problem(std::span<const Volume> volumes, const Volume& volume);

// Returns whether the volume fills a box, so that a medium that has it as its density ends.
bool has_box(std::span<const Volume> volumes, VolumeIndex i);

// Looks for volumes that a medium or a phase function can't have: volumes without a box, other than the
// density; and volumes that vary, if the density is a "heightfog". The volumes must be without problems.
ParameterProblem medium_problem(std::span<const Volume> volumes, const HeterogeneousMedium& m);
ParameterProblem phase_problem(std::span<const Volume> volumes, const BlendPhase& p);

// Returns how deep a volume is nested; 1: it contains no others. None of those that it contains may be nested
// more than kMaxVolumeNesting deep, or contain itself.
int nesting_of(std::span<const Volume> volumes, VolumeIndex i);
// Returns whether volumes contain each other in a circle, or more than kMaxVolumeNesting deep. All indices
// must be valid.
bool nested_too_deep(std::span<const Volume> volumes);

}  // namespace ls::scene
