#include "formats/reader/nori_test.h"

#include <fmt/format.h>

#include "core/base/text/suggest.h"
#include "core/scene/schema/validate.h"
#include "formats/nori/object.h"
#include "formats/nori/translate.h"
#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"
#include "formats/xml/values.h"

namespace ls {
namespace scene {
namespace {

constexpr std::size_t kMaxTested = 1000;  // most scenes or bsdfs in a test; most numbers in a list
constexpr double kMaxSamples = 1e9;

const nori::Parameter kSignificanceLevel{
    "significanceLevel", nori::kFloat, "0.01", "", {.min = 0, .max = 1, .open_min = true, .open_max = true}};
const nori::Plugin kTTest{"test",
                          "ttest",
                          "",
                          {kSignificanceLevel,
                           {"sampleCount", nori::kInteger, "100000", "", {.min = 2, .max = kMaxSamples}},
                           {"references", nori::kString, "", ""},
                           {"angles", nori::kString, "", ""}}};
const nori::Plugin kChi2Test{
    "test",
    "chi2test",
    "",
    {kSignificanceLevel,
     {"sampleCount", nori::kInteger, "", "", {.min = -1, .max = kMaxSamples}},
     {"resolution", nori::kInteger, "10", "", {.min = 1, .max = 1000}},
     {"minExpFrequency", nori::kFloat | nori::kInteger, "5", "", {.min = 0, .max = kMaxSamples}},
     {"testCount", nori::kInteger, "5", "", {.min = 1, .max = kMaxTested}}}};

class TestReader {
 public:
  TestReader(Document& document, AssetSource& assets, Report& report)
      : document_(document), assets_(assets), report_(report) {}

  std::optional<NoriTest> read() {
    Element root = document_.root;
    nori::rename_shapes(root);
    if (!nori::check_objects(root, report_)) return std::nullopt;
    const bool chi2 = root.get("type") == "chi2test";
    if (!chi2 && root.get("type") != "ttest") {
      const std::vector<std::string> known{"ttest", "chi2test"};
      return report_.refuse(
          value_place(root, "type"),
          fmt::format("Nori has no test \"{}\"{}", root.get("type"), suggestion(root.get("type"), known)));
    }
    test_.kind = chi2 ? NoriTestKind::chi2_test : NoriTestKind::t_test;
    nori::Object o(root, chi2 ? kChi2Test : kTTest, report_);
    parameters(o);
    tested(o);
    o.finish();
    check(root);
    return report_.has_errors() ? std::nullopt : std::optional(std::move(test_));
  }

 private:
  void parameters(nori::Object& o) {
    test_.significance_level = o.number("significanceLevel", .01);
    if (test_.kind == NoriTestKind::t_test) {
      test_.sample_count = static_cast<std::uint64_t>(o.number("sampleCount", 1e5));
      test_.references = numbers(o, "references");
      test_.angles = numbers(o, "angles");
      return;
    }
    test_.sample_count = static_cast<std::uint64_t>(std::max(0.0, o.number("sampleCount", 0)));
    test_.resolution = static_cast<int>(o.number("resolution", 10));
    test_.min_expected = o.number("minExpFrequency", 5);
    test_.test_count = static_cast<int>(o.number("testCount", 5));
  }

  std::vector<double> numbers(nori::Object& o, std::string_view parameter) {
    const Element* e = o.take(parameter);
    if (!e) return {};
    auto values = parse_numbers(e->get("value"), kMaxTested);
    if (values) return std::move(*values);
    report_.error(value_place(*e, "value"), fmt::format("'{}' of {} wants up to {} numbers, not \"{}\"",
                                                        parameter, o.title(), kMaxTested, e->get("value")));
    return {};
  }

  void tested(nori::Object& o) {
    const auto bsdfs = o.nested("bsdf");
    const auto scenes =
        test_.kind == NoriTestKind::t_test ? o.nested("scene") : std::vector<const Element*>{};
    if (bsdfs.size() + scenes.size() > kMaxTested)
      return report_.error(o.element().at, fmt::format("more than {} scenes or bsdfs", kMaxTested));
    for (const Element* e : bsdfs) read_one(nori::translate_bsdf_alone(*e, report_), test_.bsdfs);
    for (const Element* e : scenes) read_one(nori::translate_scene(*e, report_), test_.scenes);
  }

  void read_one(std::optional<Element> scene, std::vector<Scene>& out) {
    if (!scene || report_.full()) return;
    document_.root = std::move(*scene);
    const Scene read = Reader(document_, assets_, report_).read();
    if (!report_.has_errors()) out.push_back(compacted(read));
  }

  void check(const Element& root) {
    if (report_.has_errors()) return;
    const std::size_t b = test_.bsdfs.size(), s = test_.scenes.size();
    if (b > 0 && s > 0)
      return report_.error(root.at, "a test is either of scenes or of bsdfs: this one has both");
    if (b + s == 0) return report_.error(root.at, "nothing stands in this test that could be tested");
    if (test_.kind != NoriTestKind::t_test) return;
    const std::size_t wanted = b > 0 ? b * test_.angles.size() : s;
    const bool by_channel = s > 0 && test_.references.size() == 3 * s;
    if (test_.references.size() != wanted && !by_channel)
      report_.error(root.at, fmt::format("{} references are given for {} {}", test_.references.size(), wanted,
                                         b > 0 ? "bsdfs times angles" : "scenes, or three for each"));
    else if (wanted == 0)
      report_.error(root.at, "no angles are given at which the bsdfs are to be tested");
  }

  Document& document_;
  AssetSource& assets_;
  Report& report_;
  NoriTest test_;
};

}  // namespace
}  // namespace scene

NoriTestResult read_nori_test(std::string_view file_name, std::string_view text, AssetSource& assets,
                              const ReadOptions& options) {
  scene::Report report(options.strict);
  NoriTestResult result;
  if (auto document = scene::load_document(file_name, text, assets, options, report)) {
    if (document->root.tag == "test")
      result.test = scene::TestReader(*document, assets, report).read();
    else
      report.error(document->root.at, "this is no test: its root is no <test>");
  }
  result.diagnostics = report.take();
  return result;
}

}  // namespace ls
