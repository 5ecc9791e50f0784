#include "util/report/job_page.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace ls::report {
namespace {

using nlohmann::json;

constexpr const char* kMarkup = "<img src=x onerror=\"alert('x')\">&amp;<script>alert(1)</script>";

json some_report() {
  json j = json::parse(
      R"({"job": "j-1", "name": "bath.xml", "state": "done", "stopped": "spp", "size": [320, 240], "spp": 512,
    "samples": 39321600, "render_seconds": 95.1, "core_seconds": 88.3, "load_seconds": 0.7, "peak_rss_bytes": 36347904,
    "rmse": 0.046, "relmse": 0.022, "relmse_ci95": [0.0125, 0.0389], "target_error": 0.005, "slope": -0.91,
    "slope_ci95": [-0.99, -0.83], "trend": "converging as expected", "trusted": true, "verdict": "converging as expected",
    "verdict_kind": "converging", "error": null, "threads": 3.5, "pixels_without_samples": 0, "efficiency": 0.5,
    "forecast": {"target": 0.005, "asked": true, "spp": 2048, "core_seconds": 300, "core_seconds_ci95": [222, 420]},
    "time": {"load": 1, "build": 2, "render": 80, "transfer": 4, "merge": 1, "idle": 12},
    "health": {"clean": true, "causes": []}, "clamped_values": 0, "seed": 7, "integrator": "volpath", "scene": "abcd",
    "analysis": {"parts": [{"part": "meshes", "used": false, "why": "no mesh files"}, {"part": "surfaces", "used": true, "why": "1 cube"}],
                 "left_out": [{"what": "texture", "why": "no shape wears it", "count": 3, "bytes": 2048}]},
    "warnings": [], "convergence": []})");
  for (double s = 1; s < 100; s *= 2)
    j["convergence"].push_back({{"seconds", s},
                                {"core_seconds", 2 * s},
                                {"spp", 8 * s},
                                {"rmse", 0.3},
                                {"relmse", 1 / s},
                                {"relmse_ci95", {0.8 / s, 1.2 / s}}});
  return j;
}

std::string page_of(const json& report) {
  auto page = job_page({report.dump(), {std::byte{1}, std::byte{2}}, {}, {}});
  EXPECT_TRUE(page) << page.error().message;
  return page ? *page : "";
}

void expect(const std::string& page, std::string_view words) {
  EXPECT_NE(page.find(words), std::string::npos) << '"' << words << "\" is not in\n" << page;
}

std::size_t times(const std::string& text, std::string_view what) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += what.size()) ++n;
  return n;
}

TEST(JobPage, ShowsAllOfTheReport) {
  const std::string page = page_of(some_report());

  for (const char* words :
       {"<h1>bath.xml</h1>",
        "done: all its samples are in",
        "320 × 240",
        "0.0220",
        "0.0125 to 0.0389",
        "target 0.005",
        "512",
        "95 s",
        "34.7 MiB",
        "Slope <b>−0.91</b> (−0.99 to −0.83",
        "relMSE 0.005 needs 5 min more of core time (3.7 min to 7 min), to 2,048 samples per pixel.",
        "relMSE against wall clock",
        "relMSE against core time",
        "<th scope=\"row\">",
        "80 %",
        "Clean: no sample was rejected",
        "no mesh files",
        "1 cube",
        "texture × 3, 2.0 KiB",
        "volpath",
        "data:image/png;base64,AQI="})
    expect(page, words);
}

// Without a requested target the forecast is for half of the error, and no target line is drawn.
TEST(JobPage, ShowsTheCostOfHalfTheErrorWithoutATarget) {
  json report = some_report();
  report["target_error"] = nullptr;
  report["forecast"]["asked"] = false;
  report["forecast"]["target"] = 0.011;
  const std::string page = page_of(report);

  expect(page, "relMSE 0.0110 would need 5 min more");
  EXPECT_EQ(times(page, "class=\"target\""), 0u);
  EXPECT_EQ(times(page_of(some_report()), "class=\"target\""), 2u) << "one in each plot";
}

TEST(JobPage, ShowsTheTrueErrorBesideTheEstimate) {
  json report = some_report();
  for (json& p : report["convergence"]) p["true_relmse"] = 1.1 * p["relmse"].get<double>();
  report["reference"] = {
      {"relmse", 0.0242}, {"rmse", 0.05}, {"flip", 0.043}, {"digest", "beef"}, {"noise_relmse", 0.0002}};
  const std::string page = page_of(report);

  for (const char* words :
       {"True relMSE", "0.0242", "FLIP", "0.0430", "against the reference", "beef", "2.00 × 10⁻⁴, taken off"})
    expect(page, words);
  EXPECT_EQ(times(page, "polyline class=\"line c1 dashed\""), 2u);
  EXPECT_EQ(times(page_of(some_report()), "polyline class=\"line c1"), 0u);
}

TEST(JobPage, ErrorBelowTheReferencesNoiseIsNotShownAsZero) {
  json report = some_report();
  for (json& p : report["convergence"]) p["true_relmse"] = .1234, p["true_relmse_below_noise"] = false;
  report["convergence"].back()["true_relmse_below_noise"] = true;
  report["reference"] = {
      {"relmse", 0.}, {"rmse", 0.}, {"below_noise", true}, {"rmse_below_noise", true}, {"same_seed", false}};

  const std::string page = page_of(report);
  report["reference"]["same_seed"] = true;
  const std::string same = page_of(report);

  EXPECT_EQ(times(page, "<b>below the reference's noise</b>"), 2u);
  EXPECT_EQ(times(page, "<td>below the reference's noise</td>"), 1u);
  // The checkpoint is not drawn either: both plots have one dot less than there are checkpoints.
  EXPECT_EQ(times(page, "<title>0.123 at "), 2 * (report["convergence"].size() - 1));
  EXPECT_EQ(times(page, "shares this job"), 0u);
  expect(same, "The reference shares this job&#39;s seed");
}

void doubt(json& report) {
  report["trusted"] = false;
  report["verdict"] = "don't trust yet: few pixels carry the error";
  report["verdict_kind"] = "heavy_tail";
}

void expect_not(const std::string& page, std::string_view words) {
  EXPECT_EQ(page.find(words), std::string::npos) << '"' << words << "\" is in\n" << page;
}

TEST(JobPage, ShowsUntrustedEstimatesAndHealthProblems) {
  json report = some_report();
  doubt(report);
  report["few_hits_pixels"] = 12;
  report["health"] =
      json::parse(R"({"clean": false, "causes": [{"text": "3 samples were not a number", "frame": null,
    "first": [{"pixel": [412, 96], "sample": 1100}], "replay": "lightshaft render x.xml --pixel 412,96 --sample 1100"}]})");
  const std::string page = page_of(report);

  expect(page, "class=\"verdict\" role=\"note\">don&#39;t trust yet: few pixels carry the error");
  EXPECT_EQ(times(page, "few pixels carry the error"), 1u);
  expect(page, "3 samples were not a number; first at pixel 412,96, sample 1,100.");
  expect(page, "lightshaft render x.xml --pixel 412,96 --sample 1100");
  expect(page, "In 12 pixels too few samples found light");
}

TEST(JobPage, UntrustedJobHasAdvice) {
  json report = some_report();
  expect_not(page_of(report), "What to do");
  doubt(report);
  report["advice"] = "still noisy; render on: lightshaft extend j-1 --spp 256";

  expect(page_of(report), "<b>What to do</b>: still noisy; render on: lightshaft extend j-1 --spp 256");
}

TEST(JobPage, HasTheErrorOfTheDenoisedLayersFirst) {
  json report = some_report();
  report["denoised"] = {{"by", "OIDN"}, {"relmse", 0.0012}, {"relmse_ci95", {0.001, 0.0014}}};
  const std::string page = page_of(report);

  expect(page, "class=\"key\"><dt>relMSE, denoised</dt>");
  EXPECT_LT(page.find("<dt>relMSE, denoised</dt>"), page.find("<dt>relMSE</dt>"));
}

TEST(JobPage, HasTheMeanOfTheImageAndTheErrorOfSquares) {
  json report = some_report();
  report["mean"] = {0.5, 0.25, 0.125};
  report["mean_ci95"] = {{0.49, 0.51}, {0.23, 0.27}, {0.12, 0.13}};
  report["relmse_16"] = 0.003;
  report["relmse_16_ci95"] = nullptr;

  expect(page_of(report), "<dt>Mean of the image</dt>");
  expect(page_of(report), "95 %: ± 0.02");
  expect(page_of(report), "<dt>relMSE, 16 x 16</dt>");
  report["mean"] = {0.5, "a", nullptr};
  expect_not(page_of(report), "Mean of the image");
}

// The verdict is shown for every report with `trusted` false, even early ones, and whatever its
// `verdict_kind` is.
TEST(JobPage, ShowsDoubtIfTheReportIsUntrusted) {
  for (const char* kind : {"early", "heavy_tail", "bias_floor", ""}) {
    json report = some_report();
    doubt(report);
    report["verdict_kind"] = kind;
    report.erase("slope");
    expect(page_of(report), "class=\"verdict\"");
  }
  json older = some_report();
  older.erase("trusted");
  older["verdict_kind"] = "bias_floor";
  expect(page_of(older), "class=\"verdict\"");
  expect_not(page_of(some_report()), "class=\"verdict\"");
}

TEST(JobPage, UntrustedJobHasNoForecast) {
  json report = some_report();
  doubt(report);
  report["rmse_ci95"] = {0.0401, 0.0502};
  const std::string page = page_of(report);

  expect(page, "<b>0.0220</b><small>don&#39;t trust yet</small>");
  expect(page, "<b>0.0460</b><small>don&#39;t trust yet</small>");
  expect(page, "relMSE 0.005 needs at least 5 min more of core time, to at least 2,048 samples per pixel.");
  for (const char* claim : {"0.0125 to 0.0389", "0.0401", "3.7 min", "converging as expected"})
    expect_not(page, claim);
}

// No interval is shown: not as a band, at a point, in the table, or for the slope.
TEST(JobPage, UntrustedCurveHasNoIntervals) {
  json report = some_report();
  expect(page_of(report), "class=\"band c0\"");
  expect(page_of(report), "<th scope=\"col\">95 % interval</th>");
  doubt(report);
  const std::string page = page_of(report);

  for (const char* claim : {"class=\"band", "95 %", "0.0250 to 0.0375", "−0.99 to −0.83"})
    expect_not(page, claim);
  expect(page, "<title>0.0312 at 32 s</title>");
  expect(page,
         "Slope <b>−0.91</b> (independent samples give −1). No intervals are shown: the estimate can&#39;t "
         "be trusted yet.");
  const std::size_t names = times(page, "<th scope=\"col\">"), cells = times(page, "<td>0.300</td>");
  EXPECT_EQ(names, 5u) << "time, core time, samples, RMSE, relMSE";
  EXPECT_EQ(cells, report["convergence"].size());
}

TEST(JobPage, UntrustedEstimateBelowTheTargetIsNotShownAsReached) {
  json report = some_report();
  report["stopped"] = "error";
  expect(page_of(report), "done: the target error is reached ·");
  doubt(report);
  expect(page_of(report), "done: the target error is reached by its own estimate: don&#39;t trust yet ·");
}

TEST(JobPage, ShowsTheVerdictBeforeThereIsASlope) {
  json report = some_report();
  report["slope"] = report["slope_ci95"] = report["trend"] = nullptr;
  report["verdict_kind"] = "early";
  report["verdict"] = "too early to tell how it converges";
  expect(page_of(report), "<p class=\"note\">Too early to tell how it converges. relMSE 0.005 needs");

  report["convergence"] = json::array();
  expect(page_of(report), "Too early to tell how it converges.");
}

TEST(JobPage, ShowsWhyAJobFailed) {
  json report = some_report();
  report["state"] = "failed";
  report["stopped"] = nullptr;
  report["error"] = "SIGSEGV on 3 workers\nat pixel 412,96";
  const std::string page = page_of(report);

  expect(page, "<b>The job failed</b><pre>SIGSEGV on 3 workers\nat pixel 412,96</pre>");
  expect_not(page_of(some_report()), "The job failed");
}

TEST(JobPage, ShowsWhatStoppedAnUnfinishedJob) {
  json report = some_report();
  report["state"] = "cancelled";
  report["stopped"] = "user";
  expect(page_of(report), "cancelled: someone stopped it");
}

TEST(JobPage, ReportsPixelsWithoutSamples) {
  json report = some_report();
  report["pixels_without_samples"] = 12800;
  expect(page_of(report),
         "No sample has reached 12,800 of 76,800 pixels yet: the error figures are of the others.");
  report.erase("size");
  expect(page_of(report), "No sample has reached 12,800 pixels yet");
  expect_not(page_of(some_report()), "No sample has reached");
}

TEST(JobPage, TruncatedTableIsMarked) {
  json report = some_report();
  const json point = report["convergence"][0];
  report["convergence"] = json::array();
  for (int i = 1; i <= 300; ++i) {
    report["convergence"].push_back(point);
    report["convergence"].back()["seconds"] = i;
  }
  const std::string page = page_of(report);

  expect(page, "<summary>The last 256 of 300 points as a table</summary>");
  expect_not(page, "<td>44 s</td>");
  expect(page, "<td>45 s</td>");
  expect(page_of(some_report()), "<summary>The points as a table</summary>");
}

TEST(JobPage, SaysWhichSecondsItCounts) {
  const std::string page = page_of(some_report());

  for (const char* words : {"getting the files that the scene names", "reading them and building the world",
                            "Seconds of threads: of render their CPU time, of the others by the clock.",
                            "<b>0.500</b><small>1 / (relMSE × seconds), 3.5 threads</small>"})
    expect(page, words);
}

TEST(JobPage, TinyPartsOfTheTimeAreShownAsLessThanOnePercent) {
  json report = some_report();
  report["time"] = {{"load", .0001},     {"build", 0},  {"render", 100},
                    {"transfer", .0001}, {"merge", .4}, {"idle", 0}};
  const std::string page = page_of(report);

  EXPECT_EQ(times(page, "<td>&lt; 1 %</td>"), 3u);
  EXPECT_EQ(times(page, "<td>&gt; 99 %</td>"), 1u);
  EXPECT_EQ(times(page, "<td>0 %</td>"), 2u);
}

TEST(JobPage, ProvenanceShowsTheRequestedSettings) {
  json report = some_report();
  report.update(json::parse(R"({"max_depth": -1, "rr_depth": 5, "spp_asked": 4096, "time_asked": 90})"));
  for (const char* row :
       {"<dt>Maximum depth</dt><dd><span>unlimited</span>",
        "<dt>Russian roulette</dt><dd><span>from depth 5</span>",
        "<dt>Samples asked</dt><dd><span>4,096 per pixel</span>",
        "<dt>Target relMSE</dt><dd><span>0.005</span>", "<dt>Time asked</dt><dd><span>90 s</span>"})
    expect(page_of(report), row);
  report["max_depth"] = 12;
  expect(page_of(report), "<dt>Maximum depth</dt><dd><span>12</span>");
  for (const char* key : {"spp_asked", "time_asked", "target_error"}) report[key] = nullptr;
  for (const char* name : {"Samples asked", "Time asked", "Target relMSE"}) expect_not(page_of(report), name);
}

TEST(JobPage, CaptionSaysWhetherThePictureIsDenoised) {
  JobPage page{.report = some_report().dump(), .image = {std::byte{1}}};
  expect(*job_page(page), "<figcaption>As it was rendered.</figcaption>");
  expect_not(*job_page(page), "Denoised; the maps");

  page.denoised = true;

  expect(*job_page(page), "<figcaption>Denoised; the maps are of the image as it was rendered.</figcaption>");
  expect(*job_page(page), "alt=\"bath.xml, denoised\"");
}

TEST(JobPage, SampleLegendMarksItsUpperEndAsOpen) {
  auto page = job_page({some_report().dump(), {}, {std::byte{1}}, {std::byte{2}}});
  ASSERT_TRUE(page);
  expect(*page, "</svg>16,384 or more</span>");
  expect(*page, "</svg>100 % or more</span>");
}

TEST(JobPage, ShowsThreadsOfAMachineOrTheFarmsMean) {
  json report = some_report();
  expect(page_of(report), "<dt>Threads</dt><dd><span>3.5</span>");
  report["threads"] = 16;
  expect(page_of(report), "<dt>Threads</dt><dd><span>16</span>");
}

// Replaces every text of the report by markup, since any of them may be untrusted.
void poison(json& j) {
  if (j.is_string()) j = kMarkup;
  if (j.is_structured())
    for (json& child : j) poison(child);
}

TEST(JobPage, EscapesAllTextsOfTheReport) {
  json report = some_report();
  report["warnings"] = {"w"};
  report["note"] = "n";
  report["error"] = "e";
  report["trusted"] = false;
  report["build"] = report["pixels_sha256"] = report["numeric_class"] = "x";
  report["features_used"] = report["features_left_out"] = {"f"};
  report["health"]["causes"] =
      json::parse(R"([{"text": "t", "replay": "r", "first": [{"pixel": [1, 2], "sample": 3}], "frame": 4}])");
  poison(report);
  const std::string page = page_of(report);

  EXPECT_GT(times(page, "&lt;img src=x onerror=&quot;alert(&#39;x&#39;)&quot;&gt;"), 15u);
  EXPECT_EQ(times(page, "<script"), 0u);
  EXPECT_EQ(times(page, "<img"), 1u) << "the picture itself";
  EXPECT_EQ(times(page, "onerror=\""), 0u);
}

// Checks a page made from a damaged report: it must not show NaN or infinity. (Each "Provenance" contains
// "nan".)
void expect_sound(const json& report) {
  const std::string page = page_of(report);
  EXPECT_EQ(times(page, "nan"), times(page, "Provenance")) << report.dump(1);
  EXPECT_EQ(times(page, "inf"), 0u) << report.dump(1);
}

TEST(JobPage, LeavesOutWhatTheReportLacksAndIgnoresValuesOfWrongTypes) {
  const json whole = some_report();
  const std::vector<json> others{nullptr,
                                 true,
                                 "text",
                                 -1,
                                 0,
                                 1e308,
                                 json::array(),
                                 json::object(),
                                 json::array({"a", nullptr}),
                                 json::array({json::object()})};
  for (const auto& [key, value] : whole.items()) {
    json without = whole;
    without.erase(key);
    expect_sound(without);
    for (const json& other : others) {
      json mutant = whole;
      mutant[key] = other;
      expect_sound(mutant);
      for (const char* nested : {"time", "forecast", "health", "analysis"})
        if (whole[nested].is_object()) {
          mutant = whole;
          for (json& inner : mutant[nested]) inner = other;
          expect_sound(mutant);
        }
    }
  }
  expect_sound(json::object());
}

TEST(JobPage, HandlesAnyConvergencePoints) {
  json report = some_report();
  report["convergence"] =
      json::parse(R"([null, 1, {}, {"seconds": -1, "relmse": 0}, {"seconds": "x", "relmse": []},
    {"seconds": 1e300, "core_seconds": 1e-300, "relmse": 1e300, "relmse_ci95": [1, 2, 3]}, {"seconds": 1, "relmse": 1e-300, "relmse_ci95": ["a", 0]}])");
  expect_sound(report);
}

TEST(JobPage, RefusesInputThatIsNotAReport) {
  for (const char* text : {"", "[]", "{", "7"})
    EXPECT_EQ(job_page({text, {}, {}, {}}).error().code, Errc::invalid_argument) << text;
}

TEST(JobPage, IsDeterministic) { EXPECT_EQ(page_of(some_report()), page_of(some_report())); }

}  // namespace
}  // namespace ls::report
