// The cases of `lightshaft validate`: questions with answers that are known without the renderer, asked of it
// as a job's is (pruned, serialized, read by a worker, rendered in units).
//
// To add one: write a function `void add_SUBJECT(Table& t)` in a file of this folder (small, one subject),
// declare it below, name it in all.cpp, and in it call
//   t.mean(id, rows, about, scene, expected, options)   the mean of the frame, a statistical answer
//   t.same(id, rows, about, scene, other, options)      two scenes whose means are equal
//   t.exact(id, rows, about, check)                     what has no standard error: bits, refusals, single
//   values
// `id` is ROW-subject/code path/integrator, for example "N03-semi-infinite-a.9/grid/volpath": `--case` takes
// a prefix of it or a glob, and it is the case's seed. `rows` names the rows that it answers: "N3 7.1".
// `about` is one sentence for the page of the table. `scene` is a function that makes the scene
// (scene_kit.h), or the scene itself. How many paths a mean takes is found by a first, small run of other
// numbers: state the band only. See ways.h for one case over all code paths and integrators.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "cli/cases/scene_kit.h"

namespace ls::cases {

using Channels = std::array<double, 3>;
inline Channels grey(double v) { return {v, v, v}; }
inline Rgb rgb(double v) { return {v, v, v}; }

// A scene that is made when it is wanted.
class Maker {
 public:
  Maker(const SceneKit& kit) : make_([kit] { return kit; }) {}
  template <class F>
  requires std::is_invocable_r_v<SceneKit, F> Maker(F make) : make_(std::move(make)) {}
  SceneKit operator()() const { return make_(); }

 private:
  std::function<SceneKit()> make_;
};

// The band where a case states none.
inline constexpr double kBand = .003;

// The interval of the mean must lie within `band` (a share of the answer) around the answer, and must not
// miss it by more than float32 rounding and `slack`.
struct MeanOptions {
  double band = kBand;
  // Of a wider one: why, in a sentence for the page of the table.
  std::string why_band = {};
  // Where the answer itself is only known to this share of it: derived beside the case.
  double slack = 0;
  // What is compared is what is missing to 1.
  bool complement = false;
  // Each channel by itself; else green speaks for all. Set by itself where the expected channels differ.
  bool channels = false;
  // Left out of the quick table: long paths, or heavy tails.
  bool slow = false;
  // Not 0: so many paths to begin with, where a first run of few misses what matters, or takes it for more
  // than it is.
  std::uint64_t paths = 0;
  // Not 0: so many whole frames, and the error is told by how their means differ. For frames in which a few
  // pixels vary so much more than all others that an error from one frame rests on these alone.
  std::uint64_t frames = 0;
};

struct Mean {
  Maker scene;
  Channels expected;
};
struct Same {
  Maker scene, other;
};

// What an exact check found: passed if |got - expected| <= tolerance and `why` is empty.
struct Figure {
  double expected = 0, got = 0, tolerance = 0;
  std::string why = {};  // of a failure that no number shows
  std::uint64_t unhealthy = 0;
};
struct Bench {
  std::uint64_t seed = 0;
  int threads = 1;
  std::string id = {};  // the case's
  double gain = 1;      // RunOptions::gain
};
struct Exact {
  std::function<Figure(const Bench&)> check;
};

struct Case {
  std::string id, rows, about;
  MeanOptions options;
  std::variant<Mean, Same, Exact> question;
};

class Table {
 public:
  void mean(std::string id, std::string rows, std::string about, Maker scene, const Channels& expected,
            MeanOptions options = {});
  void same(std::string id, std::string rows, std::string about, Maker scene, Maker other,
            MeanOptions options = {});
  void exact(std::string id, std::string rows, std::string about, std::function<Figure(const Bench&)> check,
             bool slow = false);

  const std::vector<Case>& cases() const { return cases_; }

 private:
  std::vector<Case> cases_;
};

// One subject each.
void add_depths(Table& t);
void add_scales(Table& t);
void add_grids(Table& t);
void add_albedos(Table& t);
void add_phases(Table& t);
void add_lamps(Table& t);
void add_light_shapes(Table& t);
void add_slabs(Table& t);
void add_single(Table& t);
void add_fields(Table& t);
void add_emission(Table& t);
void add_furnaces(Table& t);
void add_direct_light(Table& t);
void add_seed(Table& t);
void add_surfaces(Table& t);
void add_rooms(Table& t);
void add_interfaces(Table& t);
void add_microfacets(Table& t);
void add_places(Table& t);
void add_bodies(Table& t);
void add_bugs(Table& t);

// All of them, in the order of the report.
Table all_cases();

// The rows of the list (STABILITY.md) that unit tests answer: sums, counters, and what no scene shows.
struct Elsewhere {
  const char *row, *file, *test;  // test: as GoogleTest or pytest names it, found in the file
};
const std::vector<Elsewhere>& answered_elsewhere();

}  // namespace ls::cases
