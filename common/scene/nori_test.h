// Nori's <test type="ttest"> and <test type="chi2test">: what is to be tested, as plain data. Its files hold
// scenes or bsdfs and what is expected of them; `lightshaft validate FILE` runs them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/scene/read.h"

namespace ls {

enum class NoriTestKind { t_test, chi2_test };

struct NoriTest {
  NoriTestKind kind = NoriTestKind::t_test;
  double significance_level = .01;  // of the whole file, in (0, 1)
  // Of each scene or bsdf: paths or directions drawn. chi2_test: 0 says 5,000 for each cell of the table.
  std::uint64_t sample_count = 100'000;

  // Either scenes or bsdfs are tested, in the order of the file. A bsdf comes as a scene whose one shape is a
  // rectangle (normal +z) that wears it: scene.bsdfs[scene.shapes[0].bsdf.value].
  std::vector<Scene> scenes, bsdfs;

  // t_test. Of scenes: references[i] is the luminance expected of scenes[i]'s whole frame, averaged; or,
  // which Nori has not, references[3 i], [3 i + 1] and [3 i + 2] are its red, green and blue. Of
  // bsdfs: references[b * angles.size() + a] is the expected luminance of weights (f cos / pdf) of bsdfs[b]
  // sampled for light that arrives angles[a] degrees from the normal.
  std::vector<double> references, angles;

  // chi2_test, of bsdfs: so many cells in cos theta, twice that in phi; cells with fewer expected samples
  // than min_expected are joined; so many random directions are tested.
  int resolution = 10, test_count = 5;
  double min_expected = 5;
  bool operator==(const NoriTest&) const = default;
};

struct NoriTestResult {
  std::optional<NoriTest> test;  // absent if there is any error
  std::vector<Diagnostic> diagnostics;
};

// Whether the root element of this text is a <test>; false of what is no XML.
bool is_nori_test(std::string_view text);

// As read_scene(), whose errors are of the same kind.
NoriTestResult read_nori_test(std::string_view file_name, std::string_view text, AssetSource& assets,
                              const ReadOptions& options = {});

}  // namespace ls
