// A case: a scene, how much to sample of it, and what every channel's mean must be.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/scene_builder.h"

namespace ls::test {

struct Case {
  std::string name;  // letters, digits and _
  SceneBuilder builder;
  std::array<double, 3> expected{};
  std::uint64_t spp = 256;  // at least, for each of the film's 16 x 16 pixels
  // The confidence interval must lie within this share of the expected value: a test without power fails.
  double band = .005;
  // Where the answer itself is only known to this share, derived beside the case.
  double slack = 0;
  // What is compared is what is missing to 1.
  bool complement = false;
};

// One function a subject; the order is the order of the report.
void add_extremes(std::vector<Case>& cases);
void add_environments(std::vector<Case>& cases);
void add_materials(std::vector<Case>& cases);
void add_distant(std::vector<Case>& cases);
void add_overlaps(std::vector<Case>& cases);
void add_points_in_grids(std::vector<Case>& cases);
void add_channels(std::vector<Case>& cases);

inline std::array<double, 3> grey(double v) { return {v, v, v}; }
inline Rgb rgb(double v) { return {v, v, v}; }

}  // namespace ls::test
