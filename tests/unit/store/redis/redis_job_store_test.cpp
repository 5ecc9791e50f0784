// Tests against a real redis-server that is killed, emptied and restarted. The destructor of a store sends
// all changes to Redis, so no test has to wait.
#include "coordinator/store/redis/redis_job_store.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "coordinator/store/redis/redis_records.h"
#include "tests/support/redis_server.h"
#include "tests/unit/store/sample_job.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

// Evaluates the condition repeatedly until it is true; returns false after a minute.
template <class Condition>
bool eventually(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

struct Url {
  const char* text;
  std::optional<RedisAddress> address;
};

TEST(RedisAddress, IsReadFromAUrl) {
  const Url urls[] = {
      {"redis://", std::nullopt},
      {"redis://cache", RedisAddress{"cache", 6379, 0, "", ""}},
      {"redis://cache/", RedisAddress{"cache", 6379, 0, "", ""}},
      {"redis://cache:7000/3", RedisAddress{"cache", 7000, 3, "", ""}},
      {"redis://[::1]:7000/3", RedisAddress{"::1", 7000, 3, "", ""}},
      {"redis://:p%40ss@cache", RedisAddress{"cache", 6379, 0, "", "p@ss"}},
      {"redis://farm:a/b@cache:1/2", RedisAddress{"cache", 1, 2, "farm", "a/b"}},
      {"redis://cache:0", std::nullopt},
      {"redis://cache:65536", std::nullopt},
      {"redis://cache:7x", std::nullopt},
      {"redis://cache/x", std::nullopt},
      {"redis://cache/-1", std::nullopt},
      {"redis://user@cache", std::nullopt},
      {"redis://u:%zz@cache", std::nullopt},
      {"redis://[::1", std::nullopt},
      {"rediss://cache", std::nullopt},
      {"http://cache", std::nullopt},
  };
  for (const Url& url : urls) {
    const auto read = parse_redis_url(url.text);
    ASSERT_EQ(read.has_value(), url.address.has_value()) << url.text;
    if (read) EXPECT_EQ(*read, *url.address) << url.text;
  }
}

TEST(RedisAddress, NeverShowsThePassword) {
  EXPECT_EQ(parse_redis_url("redis://farm:secret@[::1]:7000/3")->shown(), "redis://[::1]:7000/3");
  EXPECT_EQ(parse_redis_url("redis://farm:secret@cache:99999").error().message.find("secret"),
            std::string::npos);
}

class RedisStores : public testing::Test {
 protected:
  RedisStoreOptions options(std::string password = "") {
    return {.address = {"127.0.0.1", redis_.port(), 0, "", std::move(password)},
            .timeouts = {},
            .first_retry = std::chrono::milliseconds(1),
            .longest_retry = std::chrono::milliseconds(20)};
  }
  std::filesystem::path disk() const { return folder_.path() / ("jobs" + std::to_string(disk_) + ".sqlite"); }
  Result<std::unique_ptr<JobStore>> try_open() {
    return open_redis_job_store(open_sqlite_job_store(disk()).value(), options());
  }
  std::unique_ptr<JobStore> open() { return std::move(try_open()).value(); }
  void lose_the_disk() { ++disk_; }

  RedisReply ask(const RedisLink::Command& command) {
    return RedisLink::connect(options().address, {}).value()->run(command).value();
  }
  std::optional<StoredJob> in_redis(const JobId& id) {
    const auto fields = ask({"HGETALL", redis_job_key(id)});
    if (fields.items.empty()) return {};
    return parse_redis_job(fields).value().job;
  }
  static StoredJob without_revision(StoredJob job) {
    job.revision = 0;
    return job;
  }
  static std::vector<StoredJob> without_revisions(std::vector<StoredJob> jobs) {
    for (auto& job : jobs) job.revision = 0;
    return jobs;
  }

  TempFolder folder_;
  int disk_ = 0;
  test::RedisServer redis_;
};

TEST_F(RedisStores, RestoreEverythingAfterALostDisk) {
  const StoredJob first = sample_job("j-1"), second = [] {
    StoredJob job = sample_job("a-later-one");
    job.submitted_unix += 1;
    return job;
  }();
  {
    const auto store = open();
    ASSERT_TRUE(store->put_jobs(std::vector{first, second}));
    ASSERT_TRUE(store->add_point(first.id, {1, 2, 4, {.5, .25, .2, .3}}));
    ASSERT_TRUE(store->add_log(first.id, {10, "submitted"}));
    ASSERT_TRUE(store->reserve("starts", 7));
  }
  lose_the_disk();
  const auto store = open();
  EXPECT_EQ(without_revisions(store->jobs().value()), (std::vector{first, second}));
  ASSERT_EQ(store->points(first.id).value().size(), 1u);
  EXPECT_EQ(store->points(first.id).value()[0].error.relmse_hi, .3);
  EXPECT_EQ(store->log(first.id).value().at(0).text, "submitted");
  EXPECT_GE(store->reserve("starts", 1).value(), 7u);
}

TEST_F(RedisStores, RefillAnEmptiedRedis) {
  {
    const auto store = open();
    ASSERT_TRUE(store->put_job(sample_job("j-1")));
    ASSERT_TRUE(store->add_log({"j-1"}, {10, "submitted"}));
  }
  redis_.kill();
  redis_.start();
  ASSERT_FALSE(in_redis({"j-1"}));
  open().reset();
  EXPECT_EQ(without_revision(in_redis({"j-1"}).value()), sample_job("j-1"));
  EXPECT_EQ(parse_redis_job(ask({"HGETALL", redis_job_key({"j-1"})})).value().log.at(0).text, "submitted");
}

TEST_F(RedisStores, DetectThatAnIdleRedisWasEmptied) {
  auto store = open();
  ASSERT_TRUE(store->put_job(sample_job("j-1")));
  ASSERT_TRUE(eventually([&] { return in_redis({"j-1"}).has_value(); }));
  ask({"FLUSHALL"});
  store.reset();
  EXPECT_TRUE(in_redis({"j-1"}));
}

TEST_F(RedisStores, WriteAtTheEndDespiteABrokenConnection) {
  for (int i = 0; i < 20; ++i) {
    const JobId id{fmt::format("j-{}", i)};
    auto store = open();
    ASSERT_TRUE(store->put_job(sample_job(id.value)));
    ASSERT_TRUE(eventually([&] { return in_redis(id).has_value(); }));
    redis_.kill();
    redis_.start();
    store.reset();
    EXPECT_TRUE(in_redis(id)) << i;
  }
}

TEST_F(RedisStores, ContinueWithoutRedisAndUpdateItLater) {
  const auto store = open();
  ASSERT_TRUE(store->put_job(sample_job("j-1")));
  redis_.kill();
  ASSERT_TRUE(store->put_job(sample_job("j-2")));
  ASSERT_TRUE(store->remove_job({"j-1"}));
  EXPECT_EQ(store->jobs().value().size(), 1u);
  redis_.start();
  ASSERT_TRUE(eventually([&] { return in_redis({"j-2"}).has_value() && store->status().behind == 0; }));
  EXPECT_FALSE(in_redis({"j-1"}));
}

TEST_F(RedisStores, ReportThatRedisIsAway) {
  const auto store = open();
  EXPECT_NE(store->status().mirror.find(std::to_string(redis_.port())), std::string::npos);
  redis_.kill();
  ASSERT_TRUE(store->put_job(sample_job("j-1")));
  ASSERT_TRUE(eventually([&] { return !store->status().trouble.empty(); }));
  EXPECT_GE(store->status().behind, 1u);
  redis_.start();
  EXPECT_TRUE(eventually([&] { return store->status().trouble.empty() && store->status().behind == 0; }));
}

TEST_F(RedisStores, DoNotRestoreJobsRemovedWhileRedisWasAway) {
  {
    const auto store = open();
    ASSERT_TRUE(store->put_job(sample_job("j-1")));
  }
  {
    const auto before = open_sqlite_job_store(disk()).value();
    ASSERT_EQ(before->jobs().value().size(), 1u);
  }
  const auto kept = ask({"HGETALL", redis_job_key({"j-1"})});
  {
    const auto store = open();
    ASSERT_TRUE(store->remove_job({"j-1"}));
  }
  // As if Redis had restarted with older data.
  ask({"SADD", kRedisJobs, "j-1"});
  for (std::size_t i = 0; i + 1 < kept.items.size(); i += 2)
    ask({"HSET", redis_job_key({"j-1"}), kept.items[i].text, kept.items[i + 1].text});

  EXPECT_TRUE(open()->jobs().value().empty());
  EXPECT_FALSE(in_redis({"j-1"}));
}

TEST_F(RedisStores, KeepALaterRevisionOfAnotherWriter) {
  auto store = open();
  ASSERT_TRUE(store->put_job(sample_job("j-1")));
  ASSERT_TRUE(eventually([&] { return in_redis({"j-1"}).has_value(); }));
  StoredJob theirs = sample_job("j-1");
  theirs.revision = 99;
  theirs.name = "theirs.xml";
  ask(put_command({theirs.id, theirs.revision, to_json(theirs), {}, {}}));

  StoredJob mine = sample_job("j-1");
  mine.name = "mine.xml";
  ASSERT_TRUE(store->put_job(mine));
  store.reset();
  EXPECT_EQ(in_redis({"j-1"})->name, "theirs.xml");
}

TEST_F(RedisStores, UseTheHigherRevisionAtTheStart) {
  ASSERT_TRUE(open()->put_job(sample_job("j-1")));
  StoredJob later = sample_job("j-1");
  later.revision = 99;
  later.state = JobState::done;
  ask(put_command({later.id, later.revision, to_json(later), {}, {}}));
  EXPECT_EQ(open()->jobs().value().at(0), later);
}

TEST_F(RedisStores, StartWithoutRedisOnlyIfTheDiskHasJobs) {
  redis_.kill();
  const auto refused = try_open();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::unavailable);
  EXPECT_NE(refused.error().message.find(std::to_string(redis_.port())), std::string::npos);

  redis_.start();
  ASSERT_TRUE(open()->put_job(sample_job("j-1")));
  redis_.kill();
  EXPECT_EQ(open()->jobs().value().size(), 1u);
}

TEST_F(RedisStores, KeepADamagedRecordForInspectionAndReadTheOthers) {
  ASSERT_TRUE(open()->put_job(sample_job("j-1")));
  ask({"SADD", kRedisJobs, "j-damaged", "j-of-another", "../../etc"});
  ask({"HSET", redis_job_key({"j-damaged"}), "revision", "3", "record", "{"});
  ask({"HSET", redis_job_key({"j-of-another"}), "revision", "3", "record", to_json(sample_job("j-1"))});
  StoredJob outside = sample_job("../../etc");
  ask({"HSET", redis_job_key({"../../etc"}), "revision", "3", "record", to_json(outside)});
  lose_the_disk();
  const auto jobs = open()->jobs().value();
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0].id.value, "j-1");
  EXPECT_EQ(ask({"HGET", redis_job_key({"j-damaged"}), "record"}).text, "{");
}

TEST_F(RedisStores, KeepQuarantinedWorkersIfEitherStoreIsLost) {
  ASSERT_TRUE(open()->quarantine({{"w-1"}, "evidence"}));
  redis_.kill();
  redis_.start();
  open().reset();  // sends the quarantine to the Redis that has lost it
  lose_the_disk();

  EXPECT_EQ(open()->quarantined().value(), (std::vector<QuarantinedWorker>{{{"w-1"}, "evidence"}}));
}

TEST_F(RedisStores, RefusedRecordDoesNotBlockOthers) {
  ask({"SET", redis_job_key({"j-000"}), "of another type"});
  auto store = open();
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(store->put_job(sample_job(fmt::format("j-{:03}", i))));

  // Both conditions must hold at once: between two attempts for the rejected job, the others may be sent
  // without an error.
  const auto only_it = [](const StoreStatus& s) { return s.behind == 1 && !s.trouble.empty(); };
  ASSERT_TRUE(eventually([&] { return only_it(store->status()); }));
  EXPECT_TRUE(in_redis({"j-199"}));
}

struct SharedStores : RedisStores {
  std::unique_ptr<JobStore> open_node(const std::string& node) {
    auto with = options();
    with.node = node;
    return open_redis_job_store(open_sqlite_job_store(folder_.path() / (node + ".sqlite")).value(), with)
        .value();
  }
  // Makes the changes in Redis that another coordinator makes when it takes over the job.
  void give(const std::string& job, const std::string& from, const std::string& to, int fence) {
    ask({"HSET", redis_job_key({job}), "owner", to, "from", from, "fence", std::to_string(fence)});
    ask({"SMOVE", "lightshaft:owned:" + from, "lightshaft:owned:" + to, job});
    ask({"RPUSH", "lightshaft:lost:" + from, fmt::format("{} {}", job, fence)});
  }
};

TEST_F(SharedStores, QuarantineIsSharedWithOtherCoordinators) {
  const auto a = open_node("a"), b = open_node("b");

  ASSERT_TRUE(a->quarantine({{"w-1"}, "evidence"}));

  std::vector<QuarantinedWorker> told;
  ASSERT_TRUE(eventually([&] { return !(told = b->moved().quarantined).empty(); }));
  EXPECT_EQ(told, (std::vector<QuarantinedWorker>{{{"w-1"}, "evidence"}}));
  EXPECT_EQ(b->quarantined().value(), told);
  EXPECT_TRUE(a->moved().quarantined.empty());
}

TEST_F(SharedStores, ReturnedJobHasOnlyTheLogOfItsLastOwner) {
  const auto a = open_node("a");
  ASSERT_TRUE(a->put_job(sample_job("j-1")));
  ASSERT_TRUE(a->add_log({"j-1"}, {1, "by a"}));
  ASSERT_TRUE(eventually([&] { return in_redis({"j-1"}) && a->status().behind == 0; }));
  give("j-1", "a", "b", 2);
  std::vector<JobId> lost;
  ASSERT_TRUE(eventually([&] { return !(lost = a->moved().lost).empty(); }));

  ASSERT_TRUE(a->add_log({"j-1"}, {2, "cancelled"}));  // a write that was queued before the job was lost
  ASSERT_TRUE(a->add_point({"j-1"}, {1, 2, 4, {}}));
  EXPECT_TRUE(a->log({"j-1"}).value().empty());
  EXPECT_TRUE(a->points({"j-1"}).value().empty());
  ask({"HSET", redis_job_key({"j-1"}), "log", R"([[3,"by b"]])"});
  give("j-1", "b", "a", 3);
  ask({"CLIENT", "KILL", "TYPE", "normal"});

  std::vector<JobStore::Inherited> back;
  ASSERT_TRUE(eventually([&] { return !(back = a->moved().inherited).empty(); }));
  EXPECT_EQ(back[0].job.id.value, "j-1");
  EXPECT_EQ(back[0].from, "b");
  ASSERT_EQ(a->log({"j-1"}).value().size(), 1u);
  EXPECT_EQ(a->log({"j-1"}).value()[0].text, "by b");
}

TEST_F(SharedStores, NewOwnerKnowsAllSharedRecords) {
  const auto a = open_node("a");
  ASSERT_TRUE(a->put_job(sample_job("j-1")));
  StoredJob cancelled = sample_job("j-1");
  cancelled.state = JobState::cancelled;

  ASSERT_TRUE(a->put_job(cancelled));
  ASSERT_TRUE(a->share(std::vector<JobId>{{"j-1"}}));

  EXPECT_EQ(in_redis({"j-1"})->state, JobState::cancelled);
  ASSERT_TRUE(a->remove_job({"j-1"}));
  ASSERT_TRUE(a->share(std::vector<JobId>{{"j-1"}}));
  EXPECT_FALSE(in_redis({"j-1"}));
}

TEST_F(SharedStores, SharingFailuresAreReported) {
  const auto a = open_node("a");
  ASSERT_TRUE(a->put_job(sample_job("j-1")));
  ASSERT_TRUE(a->share(std::vector<JobId>{{"j-1"}}));
  EXPECT_TRUE(a->can_share());
  redis_.kill();
  ASSERT_TRUE(a->put_job(sample_job("j-1")));

  EXPECT_EQ(a->share(std::vector<JobId>{{"j-1"}}).error().code, Errc::unavailable);
  EXPECT_TRUE(eventually([&] { return !a->can_share(); }));

  redis_.start();
  EXPECT_TRUE(eventually([&] { return a->can_share().has_value(); }));
  EXPECT_TRUE(a->share(std::vector<JobId>{{"j-1"}}));
}

TEST_F(SharedStores, RestartOfRedisBetweenTwoChangesIsNotNoticed) {
  const auto a = open_node("a");
  ASSERT_TRUE(a->put_job(sample_job("j-1")));
  ASSERT_TRUE(a->share(std::vector<JobId>{{"j-1"}}));
  ASSERT_TRUE(a->locate_job({"j-1"}));
  for (int i = 0; i < 10; ++i) {
    redis_.kill();
    redis_.start();

    EXPECT_TRUE(a->locate_job({"j-1"})) << i;
    ASSERT_TRUE(a->put_job(sample_job("j-1")));
    EXPECT_TRUE(a->share(std::vector<JobId>{{"j-1"}})) << i;
  }
}

TEST_F(SharedStores, JobOfAnotherCoordinatorIsNotChangedHere) {
  const auto a = open_node("a");
  ASSERT_TRUE(a->put_job(sample_job("j-1")));
  ASSERT_TRUE(a->share(std::vector<JobId>{{"j-1"}}));
  give("j-1", "a", "b", 2);
  ASSERT_TRUE(eventually([&] { return !a->moved().lost.empty(); }));

  EXPECT_EQ(a->put_job(sample_job("j-1")).error().code, Errc::unavailable);
  EXPECT_EQ(a->share(std::vector<JobId>{{"j-1"}}).error().code, Errc::unavailable);
}

TEST(RedisLink, ReplacesAConnectionThatTheServerHasClosed) {
  test::RedisServer redis;
  const RedisAddress address{"127.0.0.1", redis.port(), 0, "", ""};
  auto link = RedisLink::connect(address, {}).value();
  EXPECT_EQ(RedisLink::renew(link, address, {}).value(), false);
  ASSERT_TRUE(link->run({"PING"}));

  redis.kill();
  redis.start();

  EXPECT_EQ(RedisLink::renew(link, address, {}).value(), true);
  EXPECT_TRUE(link->run({"PING"}));
}

TEST(RedisLink, SaysWhichServerNeedsAPassword) {
  test::RedisServer redis("secret");
  RedisAddress address{"127.0.0.1", redis.port(), 0, "", ""};
  const auto none = RedisLink::connect(address, {});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Errc::invalid_argument);
  EXPECT_NE(none.error().message.find("password"), std::string::npos);
  address.password = "secret";
  EXPECT_TRUE(RedisLink::connect(address, {}));
}

// Random histories: changes, removals, a Redis that loses its data, a disk that is lost. The second loss
// comes only after a start that has copied the data between the two. At the end both match the history.
TEST_F(RedisStores, MatchTheHistoryAfterAnyLoss) {
  for (std::uint32_t seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    ask({"FLUSHALL"});
    lose_the_disk();
    std::map<JobId, StoredJob> reference_error;
    std::set<JobId> removed;
    auto store = open();
    for (int step = 0; step < 40; ++step) {
      switch (random() % 8) {
        case 0:
          if (reference_error.empty()) break;
          removed.insert(reference_error.begin()->first);
          ASSERT_TRUE(store->remove_job(reference_error.begin()->first));
          reference_error.erase(reference_error.begin());
          break;
        case 1:  // Redis loses its data while the store is open
          redis_.kill();
          redis_.start();
          break;
        case 2:  // the disk is lost
          store.reset();
          lose_the_disk();
          store = open();
          break;
        case 3:
          store.reset();
          store = open();
          break;
        default: {
          // The id of a removed job is not used again.
          StoredJob job = sample_job(fmt::format("j-{}-{}", step / 20, random() % 5));
          if (removed.contains(job.id)) break;
          job.name = std::to_string(step);
          ASSERT_TRUE(store->put_job(job));
          reference_error[job.id] = job;
        }
      }
    }
    store.reset();
    store = open();
    std::map<JobId, StoredJob> here;
    for (StoredJob& job : without_revisions(store->jobs().value())) here[job.id] = job;
    EXPECT_EQ(here, reference_error) << "seed " << seed;
    store.reset();
    for (const auto& [id, job] : reference_error)
      EXPECT_EQ(without_revision(in_redis(id).value()), job) << "seed " << seed;
  }
}

}  // namespace
}  // namespace ls::coordinator
