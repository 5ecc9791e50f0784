#include "coordinator/store/jobs/job_store.h"

#include <gtest/gtest.h>

#include <limits>

#include "coordinator/base/limits.h"
#include "tests/unit/store/sample_job.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

TEST(StoredJob, RoundTripsThroughJson) {
  const StoredJob job = sample_job("j-1");
  EXPECT_EQ(parse_stored_job(to_json(job)).value(), job);
}

TEST(StoredJob, RefusesDamagedJson) {
  EXPECT_FALSE(parse_stored_job("{"));
  EXPECT_FALSE(parse_stored_job("{}"));
}

TEST(StoredJob, RefusesInvalidCounts) {
  const std::string text = to_json(sample_job("j-1"));
  for (const std::string field : {"\"peak_rss_bytes\":", "\"units\":", "\"bytes\":"})
    for (const std::string wrong : {"184467440737095516160", "-1", "1.5", "true"}) {
      std::string changed = text;
      const std::size_t at = changed.find(field) + field.size();
      changed.replace(at, changed.find_first_of(",}", at) - at, wrong);
      EXPECT_FALSE(parse_stored_job(changed)) << field << wrong;
    }
}

TEST(StoredJob, InfiniteSumSurvivesARoundTrip) {
  StoredJob job = sample_job("j-1");
  job.totals.core_seconds = job.totals.time.load = std::numeric_limits<double>::infinity();

  const auto read = parse_stored_job(to_json(job));

  ASSERT_TRUE(read) << read.error().message;
  job.totals.core_seconds = job.totals.time.load = 0;
  EXPECT_EQ(*read, job);
}

TEST(StoredJob, ReadsRecordsWhoseInfiniteSumIsNull) {
  std::string text = to_json(sample_job("j-1"));
  const std::size_t at = text.find("\"core_seconds\":") + 15;
  text.replace(at, text.find(',', at) - at, "null");

  const auto read = parse_stored_job(text);

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->totals.core_seconds, 0);
}

class JobStores : public testing::TestWithParam<bool> {
 protected:
  std::unique_ptr<JobStore> open() {
    return GetParam() ? open_sqlite_job_store(dir_.path() / "jobs.sqlite").value() : make_memory_job_store();
  }
  TempFolder dir_;
};
INSTANTIATE_TEST_SUITE_P(Both, JobStores, testing::Bool(),
                         [](const auto& info) { return info.param ? "Sqlite" : "Memory"; });

TEST_P(JobStores, StoresAndRemovesSeveralJobsTogether) {
  const auto store = open();
  const std::vector jobs{sample_job("j-1-frame2"), sample_job("j-1-frame10"), sample_job("j-2")};
  ASSERT_TRUE(store->put_jobs(jobs));
  EXPECT_EQ(store->jobs().value(), jobs);
  ASSERT_TRUE(store->add_log(jobs[0].id, {1, "gone with its job"}));

  ASSERT_TRUE(store->remove_jobs(std::vector{jobs[0].id, jobs[1].id, JobId{"j-none"}}));

  EXPECT_EQ(store->jobs().value(), std::vector{jobs[2]});
  EXPECT_TRUE(store->log(jobs[0].id).value().empty());
  ASSERT_TRUE(store->put_jobs({}));
}

TEST_P(JobStores, KeepsJobsInOrderOfSubmissionAndReplacesThem) {
  const auto store = open();
  ASSERT_TRUE(store->put_job(sample_job("j-2")));
  ASSERT_TRUE(store->put_job(sample_job("j-1")));
  StoredJob changed = sample_job("j-2");
  changed.state = JobState::done;
  ASSERT_TRUE(store->put_job(changed));

  EXPECT_EQ(store->jobs().value(), (std::vector{changed, sample_job("j-1")}));
}

TEST_P(JobStores, KeepsPointsAndLogsByJob) {
  const auto store = open();
  ASSERT_TRUE(store->add_point({"a"}, {1, 2, 4, {.5, .25, .2, .3}}));
  ASSERT_TRUE(store->add_point({"b"}, {9, 9, 9, {}}));
  ASSERT_TRUE(store->add_point({"a"}, {2, 4, 8, {.4, .2, .1, .3}}));
  ASSERT_TRUE(store->add_log({"a"}, {10, "submitted"}));

  const auto points = store->points({"a"}).value();
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].spp, 4);
  EXPECT_EQ(points[1].error.relmse_hi, .3);
  EXPECT_EQ(store->log({"a"}).value().at(0).text, "submitted");
  EXPECT_TRUE(store->log({"b"}).value().empty());
}

TEST_P(JobStores, KeepsComparisonsWithAReference) {
  const auto store = open();
  const ReferenceError all{.5, .25, .1, .01, .02}, few{.4, .2};
  ASSERT_TRUE(store->add_point({"a"}, {1, 2, 4, {}}));
  ASSERT_TRUE(store->add_point({"a"}, {2, 4, 8, {}}));
  ASSERT_TRUE(store->set_reference_error({"a"}, 4, all));
  ASSERT_TRUE(store->set_reference_error({"a"}, 8, few));

  const auto points = store->points({"a"}).value();

  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].reference_error, all);
  EXPECT_EQ(points[1].reference_error, few);
}

TEST_P(JobStores, KeepsQuarantinedWorkersForGoodWithTheFirstEvidence) {
  const auto store = open();
  ASSERT_TRUE(store->quarantine({{"w-2"}, "it rendered tile 3 otherwise"}));
  ASSERT_TRUE(store->quarantine({{"w-1"}, "and this one tile 4"}));
  ASSERT_TRUE(store->quarantine({{"w-2"}, "again"}));

  EXPECT_EQ(store->quarantined().value(),
            (std::vector<QuarantinedWorker>{{{"w-1"}, "and this one tile 4"},
                                            {{"w-2"}, "it rendered tile 3 otherwise"}}));
}

TEST_P(JobStores, CountsUpAndNeverGivesANumberTwice) {
  const auto store = open();
  EXPECT_EQ(store->reserve("events", 100).value(), 0u);
  EXPECT_EQ(store->reserve("events", 5).value(), 100u);
  EXPECT_EQ(store->reserve("starts", 1).value(), 0u);
  EXPECT_EQ(store->reserve("events", 1).value(), 105u);
}

TEST(SqliteJobStore, KeepsRecordsAfterReopening) {
  TempFolder dir;
  const auto file = dir.path() / "jobs.sqlite";
  {
    const auto store = open_sqlite_job_store(file).value();
    ASSERT_TRUE(store->put_job(sample_job("j-1")));
    ASSERT_TRUE(store->reserve("events", 7));
    ASSERT_TRUE(store->quarantine({{"w-2"}, "evidence"}));
  }
  const auto store = open_sqlite_job_store(file).value();
  EXPECT_EQ(store->quarantined().value().size(), 1u);
  EXPECT_EQ(store->jobs().value(), std::vector{sample_job("j-1")});
  EXPECT_EQ(store->reserve("events", 1).value(), 7u);
}

TEST(SqliteJobStore, ReportsAFileThatIsNotADatabase) {
  TempFolder dir;
  const auto file = dir.path() / "jobs.sqlite";
  FILE* f = std::fopen(file.c_str(), "wb");
  for (int i = 0; i < 200; ++i) std::fputs("this is no database ", f);
  std::fclose(f);

  const auto store = open_sqlite_job_store(file);

  ASSERT_FALSE(store);
  EXPECT_NE(store.error().message.find("jobs.sqlite"), std::string::npos);
}

}  // namespace
}  // namespace ls::coordinator
