// Nori's <test type="ttest"> and <test type="chi2test"> as plain data: scenes or bsdfs with their expected
// results. `lightshaft validate FILE` runs them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "formats/read.h"

namespace ls {

enum class NoriTestKind { t_test, chi2_test };

struct NoriTest {
  NoriTestKind kind = NoriTestKind::t_test;
  double significance_level = .01;  // in (0, 1); holds for all tests of the file together
  // Number of paths or directions drawn per scene or bsdf. For chi2_test, 0 means 5,000 per cell of the table
  // of directions (see `resolution`).
  std::uint64_t sample_count = 100'000;

  // The tested scenes or bsdfs, in the order of the file. A bsdf is represented by a scene whose one shape is
  // a rectangle (normal +z) with that bsdf: scene.bsdfs[scene.shapes[0].bsdf.value].
  std::vector<Scene> scenes, bsdfs;

  // For t_test with scenes: references[i] is the expected mean luminance of the whole frame of scenes[i]; or,
  // as an extension of Nori's format, references[3 i], [3 i + 1] and [3 i + 2] are its red, green and blue.
  // For t_test with bsdfs: references[b * angles.size() + a] is the expected luminance of weights (f cos /
  // pdf) of bsdfs[b] sampled for light that arrives angles[a] degrees from the normal.
  std::vector<double> references, angles;

  // For chi2_test, which tests bsdfs: `resolution` cells in cos theta, twice as many in phi; cells with fewer
  // expected samples than min_expected are merged; `test_count` random directions are tested.
  int resolution = 10, test_count = 5;
  double min_expected = 5;
  bool operator==(const NoriTest&) const = default;
};

struct NoriTestResult {
  std::optional<NoriTest> test;  // nullopt if there are errors
  std::vector<Diagnostic> diagnostics;
};

// Reads a Nori test. Errors are reported as by read_scene().
NoriTestResult read_nori_test(std::string_view file_name, std::string_view text, AssetSource& assets,
                              const ReadOptions& options = {});

}  // namespace ls
