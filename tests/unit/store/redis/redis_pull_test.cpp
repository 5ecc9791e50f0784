// Copies jobs from Redis to a disk. If the coordinator is killed between any two writes of the copy, nothing
// is lost: the next start completes the copy.
#include "coordinator/store/redis/redis_pull.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/redis_server.h"
#include "tests/unit/store/sample_job.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

// A store that accepts `writes` writes and fails all later ones, as if the process had been killed.
class Dying final : public JobStore {
 public:
  Dying(JobStore& inner, int writes) : inner_(inner), left_(writes) {}

  Result<void> put_jobs(std::span<const StoredJob> jobs) override {
    return write([&] { return inner_.put_jobs(jobs); });
  }
  Result<std::vector<StoredJob>> jobs() const override { return inner_.jobs(); }
  Result<void> remove_jobs(std::span<const JobId> jobs) override {
    return write([&] { return inner_.remove_jobs(jobs); });
  }
  Result<void> add_point(const JobId& job, const ConvergencePoint& point) override {
    return write([&] { return inner_.add_point(job, point); });
  }
  Result<void> set_reference_error(const JobId& job, double spp, const ReferenceError& error) override {
    return write([&] { return inner_.set_reference_error(job, spp, error); });
  }
  Result<std::vector<ConvergencePoint>> points(const JobId& job) const override { return inner_.points(job); }
  Result<void> remove_points(const JobId& job) override {
    return write([&] { return inner_.remove_points(job); });
  }
  Result<void> add_log(const JobId& job, const LogLine& line) override {
    return write([&] { return inner_.add_log(job, line); });
  }
  Result<std::vector<LogLine>> log(const JobId& job) const override { return inner_.log(job); }
  Result<void> quarantine(const QuarantinedWorker& worker) override { return inner_.quarantine(worker); }
  Result<std::vector<QuarantinedWorker>> quarantined() const override { return inner_.quarantined(); }
  Result<std::uint64_t> reserve(const std::string& counter, std::uint64_t amount) override {
    return inner_.reserve(counter, amount);
  }

 private:
  template <class Write>
  Result<void> write(Write write) {
    if (left_ == 0) return fail(Errc::unavailable, "the process is dead");
    --left_;
    return write();
  }
  JobStore& inner_;
  int left_;
};

class RedisPull : public testing::Test {
 protected:
  RedisPull() {
    const auto put =
        link_->run(put_command({.id = id_,
                                .revision = 3,
                                .record = to_json(sample_job(id_.value)),
                                .points = points_json(points_),
                                .log = log_json({{1, "submitted"}, {2, "running"}, {3, "paused"}}),
                                .node = "b",
                                .fence = 1,
                                .state = "running"}));
    EXPECT_TRUE(put);
  }
  std::unique_ptr<JobStore> empty_disk() {
    return open_sqlite_job_store(folder_.path() / fmt::format("{}.sqlite", ++disks_)).value();
  }
  void expect_whole(const JobStore& local, const std::string& where) {
    ASSERT_EQ(local.jobs().value().size(), 1u) << where;
    const auto points = local.points(id_).value();
    ASSERT_EQ(points.size(), points_.size()) << where;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(points[i].spp, points_[i].spp) << where;
      EXPECT_EQ(points[i].reference_error, points_[i].reference_error) << where;
    }
    const auto log = local.log(id_).value();
    ASSERT_EQ(log.size(), 3u) << where;
    EXPECT_EQ(log[2].text, "paused") << where;
  }

  test::RedisServer redis_;
  TempFolder folder_;
  std::unique_ptr<RedisLink> link_ = RedisLink::connect({"127.0.0.1", redis_.port(), 0, "", ""}, {}).value();
  const JobId id_{"j-1"};
  const std::vector<ConvergencePoint> points_{
      {1, 2, 4, {.5, .25, .2, .3}}, {2, 4, 8, {.4, .2, .1, .3}, ReferenceError{.3, .2, .1, {}, {}}}};
  int disks_ = 0;
};

TEST_F(RedisPull, RestoresCheckpointsWithReferenceErrors) {
  const auto local = empty_disk();

  ASSERT_TRUE(pull_owned(*link_, *local, "b"));

  expect_whole(*local, "at once");
}

TEST_F(RedisPull, KillBetweenTwoWritesLosesNothingOfAJob) {
  bool died = true;
  for (int writes = 0; died; ++writes) {
    const auto local = empty_disk();
    Dying dying(*local, writes);
    died = !pull_owned(*link_, dying, "b");

    ASSERT_TRUE(pull_owned(*link_, *local, "b"));

    expect_whole(*local, fmt::format("after {} writes", writes));
    ASSERT_LT(writes, 100);
  }
}

TEST_F(RedisPull, LosesNothingOfAnInheritedJob) {
  const auto job = parse_redis_job(link_->run({"HGETALL", redis_job_key(id_)}).value()).value();
  bool died = true;
  for (int writes = 0; died; ++writes) {
    const auto local = empty_disk();
    ASSERT_TRUE(local->put_job(sample_job(id_.value)));  // data from an earlier ownership of the job
    ASSERT_TRUE(local->add_log(id_, {0, "long ago"}));
    Dying dying(*local, writes);
    died = !keep_inherited(dying, job);

    if (writes > 0) ASSERT_TRUE(pull_owned(*link_, *local, "b"));

    if (writes > 0) expect_whole(*local, fmt::format("after {} writes", writes));
    ASSERT_LT(writes, 100);
  }
}

}  // namespace
}  // namespace ls::coordinator
