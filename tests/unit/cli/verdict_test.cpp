#include "cli/output/convergence_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/farm/farm_tables.h"
#include "cli/farm/job_results.h"
#include "cli/local/local_render.h"
#include "cli/output/console.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kWords = "don't trust yet: few pixels carry the error (like 16 of 76800)";

json some_job() {
  return json::parse(
      R"({"id": "j-1", "name": "bath.xml", "state": "running", "progress": 0.4, "size": [320, 240],
    "spp": 512, "spp_asked": 512, "spp_done": 215, "rmse": 0.031, "rmse_ci95": [0.0301, 0.032], "relmse": 0.00418,
    "relmse_ci95": [0.0039, 0.00448], "target_error": 0.001, "eta_seconds": 252, "eta_ci95": [186, 330],
    "eta_with_more": {"workers": 8, "seconds": 66, "ci95": [50, 90]}, "elapsed_seconds": 187, "core_seconds": 742,
    "verdict": {"kind": "converging", "words": "converging as expected", "trusted": true}, "few_hits": 0,
    "slope": -0.98, "slope_ci95": [-1.06, -0.9], "efficiency_per_core": 0.322, "reference": null,
    "pixels_without_samples": 0, "error": null, "warnings": []})");
}

json untrusted_job() {
  json job = some_job();
  job["verdict"] = {{"kind", "heavy_tail"}, {"words", kWords}, {"trusted", false}};
  return job;
}

TEST(Verdict, IsUntrustedByKindOrFlag) {
  const auto doubtful = [](const char* verdict) {
    return verdict_of({{"verdict", json::parse(verdict)}}).doubtful;
  };

  EXPECT_TRUE(doubtful(R"({"kind": "heavy_tail", "words": ""})")) << "an older coordinator";
  EXPECT_TRUE(doubtful(R"({"kind": "bias_floor", "words": "", "trusted": false})"));
  EXPECT_TRUE(doubtful(R"({"kind": "early", "words": "", "trusted": false})"));
  EXPECT_FALSE(doubtful(R"({"kind": "early", "words": "", "trusted": true})"));
  for (const char* no_verdict : {"null", "5", "{}", R"({"kind": 1, "trusted": "no"})"})
    EXPECT_FALSE(doubtful(no_verdict)) << no_verdict;
  EXPECT_FALSE(verdict_of(json::object()).doubtful);
}

TEST(Verdict, UntrustedJobSaysSoOnce) {
  const auto words = [](const char* text) {
    return verdict_of({{"verdict", {{"kind", "early"}, {"words", text}, {"trusted", false}}}}).words;
  };

  EXPECT_EQ(words(kWords), kWords);
  EXPECT_EQ(words("no sample has found light"), "don't trust yet: no sample has found light");
  EXPECT_EQ(words(""), "don't trust yet");
  EXPECT_EQ(words("a\x1b[2Jb"), "don't trust yet: a [2Jb");
}

TEST(ShownJob, ShowsAllErrorFigures) {
  json job = some_job();
  job["reference"] = {{"rmse", 0.0319}, {"relmse", 0.00443}, {"flip", 0.0271}};
  job["few_hits"] = 12;
  job["pixels_without_samples"] = 4096;

  const std::string shown = job_text(job);

  for (const char* row :
       {"relMSE +0.00418 \\(0.0039 to 0.00448\\)", "RMSE +0.031 \\(0.0301 to 0.032\\)",
        "target relMSE +0.001", "true relMSE +0.00443", "true RMSE +0.0319", "FLIP +0.0271",
        "verdict +converging as expected", "too little light +12 pixels", "slope +-0.98 \\(-1.06 to -0.9\\)",
        "efficiency +0.322 ", "left +4:12 \\(3:06 to 5:30\\)", "not reached yet +4,096 pixels"})
    EXPECT_THAT(shown, ContainsRegex(row));
}

TEST(ShownJob, NeverShowsZeroForAnErrorBelowTheReferencesNoise) {
  json job = some_job();
  job["reference"] = {{"rmse", 0}, {"relmse", 0}, {"below_noise", true}, {"rmse_below_noise", true}};

  const std::string below = job_text(job);
  job["reference_same_seed"] = true;
  const std::string same = job_text(job);

  EXPECT_THAT(below, ContainsRegex("true relMSE +below the reference's noise"));
  EXPECT_THAT(below, ContainsRegex("true RMSE +below the reference's noise"));
  EXPECT_THAT(same, ContainsRegex("true relMSE +0 \\(not to be trusted: one seed\\)"));
}

TEST(ShownJob, LeavesOutUnknownFigures) {
  const std::string shown = job_text({{"id", "j-1"}, {"reference", nullptr}, {"few_hits", nullptr}});

  for (const char* row :
       {"true", "FLIP", "verdict", "too little light", "slope", "efficiency", "not reached", "target"})
    EXPECT_THAT(shown, Not(HasSubstr(row)));
}

TEST(ShownJob, UntrustedJobHasNoIntervalsAndAMinimumTime) {
  const std::string shown = job_text(untrusted_job());

  for (const char* row : {"relMSE +0.00418 \\(don't trust yet\\)", "RMSE +0.031 \\(don't trust yet\\)",
                          "verdict +don't trust yet: few pixels carry", "left +at least 4:12",
                          "with 8 more workers +at least 1:06"})
    EXPECT_THAT(shown, ContainsRegex(row));
  EXPECT_THAT(shown, Not(HasSubstr("0.0039")));
  EXPECT_THAT(shown, Not(HasSubstr("5:30")));
  EXPECT_THAT(shown, Not(HasSubstr("-1.06"))) << "of the slope";
}

TEST(ShownJob, TimeLeftOfAJobThatEndsBySamplesIsExactEvenIfUntrusted) {
  json job = untrusted_job();
  job["target_error"] = nullptr;
  EXPECT_THAT(job_text(job), Not(HasSubstr("at least")));
  EXPECT_THAT(jobs_table({{"jobs", {job}}}), Not(HasSubstr("at least")));
}

TEST(ShownJob, ShowsWhatEndsIt) {
  const auto samples = [](const char* fields) {
    json job = json::parse(fields);
    job.update({{"spp", 65536}, {"spp_done", 88}});
    return job_text(job);
  };

  EXPECT_THAT(samples(R"({"spp_asked": null, "target_error": 0.001})"),
              HasSubstr("88, until the target (at most 65,536)"));
  EXPECT_THAT(samples(R"({"spp_asked": null, "target_error": null})"),
              HasSubstr("88, until its time is up (at most 65,536)"));
  EXPECT_THAT(samples(R"({"spp_asked": null, "state": "done"})"), ContainsRegex("samples per pixel +88\n"));
  EXPECT_THAT(samples(R"({"spp_asked": 65536, "target_error": 0.001})"), HasSubstr("88 of 65536"));
  EXPECT_THAT(samples("{}"), HasSubstr("88 of 65536")) << "an older coordinator";
}

TEST(JobsTable, MarksUntrustedJobs) {
  EXPECT_THAT(jobs_table({{"jobs", {untrusted_job()}}}),
              ContainsRegex("at least 4:12 +bath.xml \\(don't trust its error yet\\)"));
  EXPECT_THAT(jobs_table({{"jobs", {some_job()}}}), Not(HasSubstr("trust")));
}

TEST(ProgressOfAJob, IsUntrustedWithItsVerdict) {
  EXPECT_TRUE(progress_of(untrusted_job()).doubtful);
  EXPECT_FALSE(progress_of(some_job()).doubtful);
}

std::string said_at_the_end(json job, bool quiet) {
  job["state"] = "done";
  testing::internal::CaptureStderr();
  EXPECT_EQ(print_end(job, quiet), kOk);
  return testing::internal::GetCapturedStderr();
}

TEST(WatchedJob, ReportsItsErrorAtTheEnd) {
  EXPECT_EQ(said_at_the_end(some_job(), false), "relMSE 0.00418 (0.0039 to 0.00448)\n");
  json compared = some_job();
  compared["reference"] = {{"relmse", 0.00443}, {"flip", 0.0271}};
  EXPECT_EQ(said_at_the_end(compared, false),
            "relMSE 0.00418 (0.0039 to 0.00448), true relMSE 0.00443, FLIP 0.0271\n");
  compared["reference"]["below_noise"] = true;
  EXPECT_EQ(said_at_the_end(compared, false),
            "relMSE 0.00418 (0.0039 to 0.00448), true relMSE below the reference's noise, FLIP 0.0271\n");
  EXPECT_EQ(said_at_the_end(some_job(), true), "");
  EXPECT_EQ(said_at_the_end({{"id", "j-1"}}, false), "") << "there is nothing to tell";
}

TEST(WatchedJob, QuietModeReportsDoubt) {
  for (const bool quiet : {false, true})
    EXPECT_EQ(said_at_the_end(untrusted_job(), quiet), std::string("relMSE 0.00418: ") + kWords + "\n");
  EXPECT_EQ(said_at_the_end({{"verdict", {{"trusted", false}, {"words", "all is black"}}}}, false),
            "don't trust yet: all is black\n");
}

constexpr const char* kAdvice = "still noisy; render on: lightshaft extend j-1 --spp 2048";

TEST(ShownJob, UntrustedJobHasAdvice) {
  json job = untrusted_job();
  job["verdict"]["advice"] = kAdvice;

  EXPECT_THAT(job_text(job), ContainsRegex(std::string("what to do +") + kAdvice));
  EXPECT_EQ(said_at_the_end(job, true), std::string("relMSE 0.00418: ") + kWords + "\n" + kAdvice + "\n");
}

TEST(ShownJob, HasTheErrorOfTheDenoisedLayersFirst) {
  json job = some_job();
  job["denoised"] = {{"relmse", 0.0005}, {"relmse_ci95", {0.0004, 0.0006}}};
  const std::string shown = job_text(job);

  EXPECT_THAT(shown, ContainsRegex("denoised relMSE +0.0005 \\(0.0004 to 0.0006\\)"));
  EXPECT_LT(shown.find("denoised relMSE"), shown.find("\nrelMSE"));
  EXPECT_EQ(said_at_the_end(job, false),
            "denoised relMSE 0.0005 (0.0004 to 0.0006); as rendered relMSE 0.00418 (0.0039 to 0.00448)\n");
  job["denoised"]["relmse_ci95"] = nullptr;
  EXPECT_THAT(job_text(job), HasSubstr("0.0005 (a few pixels carry its noise: no interval)"));
}

TEST(ShownJob, NamesTheJobItWaitsForOnceEvenIfThatIsItsError) {
  json job = some_job();
  job["waits_for"] = "waits for job j-0, which is running";
  EXPECT_THAT(job_text(job), ContainsRegex("waits +waits for job j-0, which is running"));
  EXPECT_THAT(jobs_table({{"jobs", {job}}}), HasSubstr("(waits for another job)"));
  job["error"] = job["waits_for"];
  EXPECT_THAT(job_text(job), Not(ContainsRegex("\nwaits ")));
  EXPECT_THAT(job_text(job), ContainsRegex("error +waits for job j-0"));
}

TEST(DefaultImage, IsNamedByTheSceneInTheWorkingFolder) {
  const auto name = [](const char* of) { return default_image({{"name", of}}); };
  EXPECT_EQ(name("bath.xml"), "bath.exr");
  EXPECT_EQ(name("../../etc/bath.xml"), "bath.exr");
  EXPECT_EQ(name("chapel v3"), "chapel v3.exr");
  EXPECT_EQ(name(".profile"), "profile.exr");
  EXPECT_EQ(name(".."), "image.exr");
  EXPECT_EQ(name(""), "image.exr");
  EXPECT_EQ(default_image({{"name", "smoke.xml"}, {"frames", {{"total", 3}}}}), "smoke_####.exr");
}

TEST(ReportSummary, HasTheErrorOfTheDenoisedLayersFirst) {
  json report = json::parse(R"({"spp": 64, "render_seconds": 9, "relmse": 0.39, "relmse_ci95": [0.2, 0.8],
    "trusted": true, "verdict_kind": "early", "denoised": {"relmse": 0.01, "relmse_ci95": [0.009, 0.011]}})");
  EXPECT_THAT(report_summary(report),
              HasSubstr(", denoised relMSE 0.01 (0.009 to 0.011); as rendered relMSE 0.39 (0.2 to 0.8)"));
}

TEST(LocalReport, HasTheCommandThatContinuesIt) {
  const auto report = local_report(
      R"({"job": "j-7", "name": "/home/anna/ball.xml", "advice": "still noisy; render on: lightshaft extend j-7 --spp 256"})",
      {.instructions = fail(Errc::unavailable, "no counter")});

  ASSERT_TRUE(report);
  EXPECT_EQ((*report)["advice"], "still noisy; render on: lightshaft render ball.xml --spp 256");
}

TEST(ReportSummary, UntrustedImageHasNoInterval) {
  json report = json::parse(R"({"spp": 64, "render_seconds": 9, "relmse": 0.39, "relmse_ci95": [0.2, 0.8],
    "trusted": false, "verdict_kind": "early", "verdict": "no sample has found light",
    "forecast": {"target": 0.2, "core_seconds": 60, "core_seconds_ci95": [50, 80]}})");

  EXPECT_THAT(
      report_summary(report),
      HasSubstr(", relMSE 0.39: don't trust yet: no sample has found light; 0.2 would cost at least 1:00 "
                "more on one core"));
  EXPECT_THAT(report_summary(report), Not(HasSubstr("0.8")));
  report["trusted"] = true;
  EXPECT_THAT(report_summary(report), HasSubstr("relMSE 0.39 (0.2 to 0.8); 0.2 would cost 1:00 more"));
}

TEST(ReportSummary, ReportsErrorsBelowTheReferencesNoise) {
  json report = json::parse(R"({"spp": 64, "render_seconds": 9, "relmse": 0.39, "true_relmse": 0,
    "true_relmse_below_noise": true, "reference": {"same_seed": false}})");

  EXPECT_THAT(report_summary(report), HasSubstr("true relMSE below the reference's noise"));
  report["reference"]["same_seed"] = true;
  EXPECT_THAT(report_summary(report), HasSubstr("true relMSE 0 (not to be trusted"));
}

}  // namespace
}  // namespace ls::cli
