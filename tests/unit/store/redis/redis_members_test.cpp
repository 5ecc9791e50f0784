// Several coordinators and a real redis-server. Tests call beat() themselves and delete keys instead of
// waiting for them to expire, so the number of polls until a takeover is known.
#include "coordinator/store/redis/redis_members.h"

#include <gtest/gtest.h>

#include "tests/support/redis_server.h"
#include "tests/unit/store/sample_job.h"

namespace ls::coordinator {
namespace {

TEST(FailureDetector, CountsConsecutiveChecks) {
  FailureDetector book(3);
  const std::map<std::string, bool> away{{"a", false}, {"b", true}}, back{{"a", true}, {"b", true}};

  EXPECT_TRUE(book.look(away).empty());
  EXPECT_TRUE(book.look(away).empty());
  EXPECT_TRUE(book.look(back).empty()) << "it lives";
  EXPECT_TRUE(book.look(away).empty());
  EXPECT_TRUE(book.look(away).empty());
  EXPECT_EQ(book.look(away), std::vector<std::string>{"a"});
}

TEST(FailureDetector, RestartsAfterItsOwnAbsence) {
  FailureDetector book(2);
  const std::map<std::string, bool> away{{"a", false}};
  EXPECT_TRUE(book.look(away).empty());

  book.begin_again();

  EXPECT_TRUE(book.look(away).empty());
  EXPECT_EQ(book.look(away).size(), 1u);
}

struct OneMember {
  std::vector<TakenJob> taken;
  std::vector<LostJob> lost;
  std::vector<std::vector<QuarantinedWorker>> quarantined;
  std::set<JobId> known;
  bool keeps = true;  // false: storing a job that was taken over fails
  std::function<void()> on_taken = [] {};
  std::unique_ptr<RedisMembers> members;
};

// The time from a coordinator's death until another one takes over its jobs: its last heartbeat expires after
// a lease, then `looks` polls must find no heartbeat.
TEST(MemberOptions, DefaultTakeoverIsWithinTenSeconds) {
  const MemberOptions usual;

  EXPECT_LE(usual.lease + usual.looks * usual.beat, std::chrono::seconds(10));
}

class Members : public testing::Test {
 protected:
  static constexpr int kLooks = 2;

  OneMember& add(const std::string& node) {
    auto& one = all_[node];
    MemberOptions options{.address = {"127.0.0.1", redis_.port(), 0, "", ""}, .node = node};
    options.lease = std::chrono::hours(1);  // a test ends it by deleting the key
    options.looks = kLooks;
    one.members = std::make_unique<RedisMembers>(
        options, RedisMembers::Callbacks{
                     [&one](std::vector<TakenJob> jobs) {
                       for (auto& job : jobs) {
                         if (one.keeps) one.known.insert(job.job.job.id);
                         one.taken.push_back(std::move(job));
                       }
                       one.on_taken();
                     },
                     [&one](const std::vector<LostJob>& jobs) {
                       one.lost.insert(one.lost.end(), jobs.begin(), jobs.end());
                     },
                     [&one](const std::vector<QuarantinedWorker>& all) { one.quarantined.push_back(all); },
                     [&one](std::vector<JobId> ids) {
                       std::erase_if(ids, [&](const JobId& id) { return one.known.contains(id); });
                       return ids;
                     }});
    EXPECT_TRUE(one.members->join());
    return one;
  }
  RedisReply ask(const RedisLink::Command& command) {
    return RedisLink::connect({"127.0.0.1", redis_.port(), 0, "", ""}, {}).value()->run(command).value();
  }
  std::int64_t put(const std::string& node, const std::string& id, std::uint64_t fence,
                   std::uint64_t revision = 1, const std::string& state = "running") {
    return ask(put_command({.id = {id},
                            .revision = revision,
                            .record = to_json(sample_job(id)),
                            .node = node,
                            .fence = fence,
                            .state = state}))
        .number;
  }
  void lease_ends(const std::string& node) { ask({"DEL", "lightshaft:alive:" + node}); }
  std::string field(const std::string& id, const std::string& name) {
    return ask({"HGET", redis_job_key({id}), name}).text;
  }

  test::RedisServer redis_;
  std::map<std::string, OneMember> all_;
};

TEST_F(Members, JobsOfADeadMemberAreTakenAsSoonAsItCountsAsGone) {
  add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(b.members->beat());
  EXPECT_TRUE(b.taken.empty()) << "it lives";

  lease_ends("a");
  for (int look = 1; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());
  EXPECT_TRUE(b.taken.empty());
  ASSERT_TRUE(b.members->beat());

  ASSERT_EQ(b.taken.size(), 1u);
  EXPECT_EQ(b.taken[0].job.job.id.value, "j-1");
  EXPECT_EQ(b.taken[0].job.fence, 2u);
  EXPECT_EQ(b.taken[0].from, "a");
  EXPECT_EQ(field("j-1", "owner"), "b");
}

TEST_F(Members, JobIsReportedAsTakenEvenIfTheReplyToTheTakeoverWasLost) {
  add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  ASSERT_TRUE(b.members->beat());
  // The changes that a takeover makes in Redis, without an answer: the connection breaks.
  ask({"HINCRBY", redis_job_key({"j-1"}), "fence", "1"});
  ask({"HSET", redis_job_key({"j-1"}), "owner", "b", "from", "a"});
  ask({"SMOVE", "lightshaft:owned:a", "lightshaft:owned:b", "j-1"});
  ask({"CLIENT", "KILL", "TYPE", "normal"});

  ASSERT_TRUE(b.members->beat() || b.members->beat()) << "an attempt after the first has another connection";
  ASSERT_TRUE(b.members->beat());

  ASSERT_EQ(b.taken.size(), 1u) << "once";
  EXPECT_EQ(b.taken[0].job.job.id.value, "j-1");
  EXPECT_EQ(b.taken[0].job.fence, 2u);
  EXPECT_EQ(b.taken[0].from, "a");
}

TEST_F(Members, JobThatCouldNotBeStoredIsReportedUntilItIs) {
  add("a");
  auto& b = add("b");
  b.keeps = false;
  ASSERT_EQ(put("a", "j-1", 1), 1);
  lease_ends("a");
  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());
  ASSERT_EQ(b.taken.size(), 1u);

  ASSERT_TRUE(b.members->beat());
  EXPECT_EQ(b.taken.size(), 2u);
  b.keeps = true;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(b.members->beat());

  ASSERT_EQ(b.taken.size(), 3u);
  EXPECT_EQ(b.taken[2].job.fence, 2u);
  EXPECT_EQ(b.taken[2].from, "a");
}

TEST_F(Members, UnreadableEntriesAndBadIdsAreLeftAlone) {
  add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  ask({"HSET", redis_job_key({"j-1"}), "record", "{"});
  ASSERT_EQ(put("a", "../../x", 1), 1);
  ask({"RPUSH", "lightshaft:lost:b", "../../y 7"});
  lease_ends("a");

  for (int look = 0; look < 3 * kLooks; ++look) ASSERT_TRUE(b.members->beat());

  EXPECT_TRUE(b.taken.empty());
  EXPECT_TRUE(b.lost.empty());
  EXPECT_EQ(field("j-1", "owner"), "a");
  EXPECT_EQ(field("../../x", "owner"), "a");
  EXPECT_EQ(ask({"LLEN", "lightshaft:lost:b"}).number, 0) << "dealt with";
}

TEST_F(Members, ShareEachNewQuarantine) {
  auto& a = add("a");
  ASSERT_TRUE(a.members->beat());
  EXPECT_TRUE(a.quarantined.empty());

  ask({"HSET", kRedisQuarantined, "w-1", "evidence"});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(a.members->beat());
  ask({"HSET", kRedisQuarantined, "w-2", "evidence"});
  ASSERT_TRUE(a.members->beat());

  ASSERT_EQ(a.quarantined.size(), 2u);
  EXPECT_EQ(a.quarantined[0], (std::vector<QuarantinedWorker>{{{"w-1"}, "evidence"}}));
  EXPECT_EQ(a.quarantined[1].size(), 2u);
}

TEST_F(Members, MemberThatWakesAfterItsLeaseWritesNothingAndLearnsWhatItLost) {
  auto& a = add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  lease_ends("a");
  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());
  ASSERT_EQ(b.taken.size(), 1u);
  const std::string before = field("j-1", "record");

  EXPECT_EQ(put("a", "j-1", 1, 1'000'000, "done"), static_cast<int>(PutAnswer::lost));
  for (const auto& command : remove_commands({"j-1"}, "a")) ask(command);
  EXPECT_EQ(field("j-1", "record"), before);
  EXPECT_EQ(field("j-1", "state"), "running");
  ASSERT_TRUE(a.members->beat());
  EXPECT_EQ(a.lost, (std::vector<LostJob>{{{"j-1"}, 2}}));
  ASSERT_TRUE(a.members->beat());
  EXPECT_EQ(a.lost.size(), 1u) << "told once";

  EXPECT_EQ(put("b", "j-1", 2, 1), 1) << "the new owner writes";
}

TEST_F(Members, MemberThatReturnsBetweenTwoChecksKeepsItsJobs) {
  auto& a = add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  lease_ends("a");
  for (int look = 1; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());

  ASSERT_TRUE(a.members->beat());
  for (int look = 0; look < 10; ++look) ASSERT_TRUE(b.members->beat());

  EXPECT_TRUE(b.taken.empty());
  EXPECT_TRUE(a.lost.empty());
}

TEST_F(Members, EachJobIsTakenByOneOfSeveralHeirs) {
  add("a");
  auto &b = add("b"), &c = add("c");
  for (int i = 0; i < 20; ++i) ASSERT_EQ(put("a", "j-" + std::to_string(i), 1), 1);
  lease_ends("a");

  for (int look = 0; look < 2 * kLooks; ++look)
    for (auto* one : {&b, &c}) ASSERT_TRUE(one->members->beat());

  EXPECT_EQ(b.taken.size() + c.taken.size(), 20u);
  EXPECT_EQ(ask({"SCARD", "lightshaft:owned:a"}).number, 0);
}

TEST_F(Members, LongTakeoverRenewsItsClaimAndSendsHeartbeats) {
  add("a");
  auto& b = add("b");
  for (int i = 1; i <= 300; ++i) ASSERT_EQ(put("a", frame_job({"j-film"}, i).value, 1), 1);
  lease_ends("a");
  std::vector<std::int64_t> claims, beats;  // state of the two keys when jobs are stored
  b.on_taken = [&] {
    claims.push_back(ask({"PTTL", "lightshaft:heir:a"}).number);
    beats.push_back(ask({"EXISTS", "lightshaft:alive:b"}).number);
    ask({"PEXPIRE", "lightshaft:heir:a", "5000"});
    lease_ends("b");
  };

  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());

  EXPECT_EQ(b.taken.size(), 300u);
  ASSERT_GT(claims.size(), 2u) << "it looks up several times";
  for (const std::int64_t claim : claims) EXPECT_GT(claim, 5000);
  for (const std::int64_t beat : beats) EXPECT_EQ(beat, 1);
  EXPECT_EQ(ask({"EXISTS", "lightshaft:heir:a"}).number, 0) << "it is done";
}

TEST_F(Members, MemberWithoutItsClaimTakesNoMore) {
  add("a");
  auto &b = add("b"), &c = add("c");
  for (int i = 1; i <= 300; ++i) ASSERT_EQ(put("a", frame_job({"j-film"}, i).value, 1), 1);
  lease_ends("a");
  b.on_taken = [&] { ask({"SET", "lightshaft:heir:a", "c"}); };

  for (int look = 1; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());
  EXPECT_FALSE(b.members->beat());
  const std::size_t before = b.taken.size();
  EXPECT_LT(before, 300u);
  EXPECT_EQ(ask({"GET", "lightshaft:heir:a"}).text, "c") << "the claim of another stays";
  EXPECT_TRUE(b.members->beat());
  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(c.members->beat());

  EXPECT_EQ(b.taken.size(), before);
  EXPECT_EQ(c.taken.size(), 300 - before);
}

TEST_F(Members, DeadHeirsJobsAreTakenOver) {
  add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  lease_ends("a");
  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());
  lease_ends("b");
  auto& c = add("c");

  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(c.members->beat());

  ASSERT_EQ(c.taken.size(), 1u);
  EXPECT_EQ(c.taken[0].job.fence, 3u);
  EXPECT_EQ(put("b", "j-1", 2, 99), static_cast<int>(PutAnswer::lost));
}

TEST_F(Members, EndedJobsStayAndSequencesMoveAsAWhole) {
  add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-done", 1, 1, "done"), 1);
  ASSERT_EQ(put("a", frame_job({"j-film"}, 1).value, 1, 1, "done"), 1);
  ASSERT_EQ(put("a", frame_job({"j-film"}, 2).value, 1, 1, "paused"), 1);
  lease_ends("a");

  for (int look = 0; look < kLooks; ++look) ASSERT_TRUE(b.members->beat());

  ASSERT_EQ(b.taken.size(), 2u);
  EXPECT_EQ(field("j-done", "owner"), "a");
  const auto film = b.members->owner_of({"j-film"}).value();
  ASSERT_TRUE(film);
  EXPECT_EQ(film->node, "b");
  for (int frame : {1, 2})
    for (const auto& command : remove_commands(frame_job({"j-film"}, frame), "b")) ask(command);
  EXPECT_FALSE(b.members->owner_of({"j-film"}).value()) << "removed with its frames";
}

TEST_F(Members, EmptiedRedisCausesNoTakeoverAndTheHigherFenceWins) {
  auto& a = add("a");
  auto& b = add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);
  redis_.kill();
  EXPECT_FALSE(b.members->beat());
  redis_.start();
  for (int look = 0; look < 10; ++look) ASSERT_TRUE(b.members->beat());
  EXPECT_TRUE(b.taken.empty());

  ASSERT_TRUE(a.members->beat()) << "on a new connection";
  EXPECT_EQ(put("a", "j-1", 1, 50), 1) << "an earlier owner tells first what it knows";
  EXPECT_EQ(put("b", "j-1", 2, 3), 1) << "the owner since has the higher fence, if fewer changes";
  EXPECT_EQ(put("a", "j-1", 1, 51), static_cast<int>(PutAnswer::lost));
}

// An owner that has nothing to write is never refused: it must learn from its heartbeat.
TEST_F(Members, MemberWhoseJobAHigherFenceOverwritesLearnsThatItLostIt) {
  auto& a = add("a");
  add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);

  EXPECT_EQ(put("b", "j-1", 2), 1) << "Redis had lost the takeover";

  ASSERT_TRUE(a.members->beat());
  EXPECT_EQ(a.lost, (std::vector<LostJob>{{{"j-1"}, 2}}));
  EXPECT_EQ(ask({"SISMEMBER", "lightshaft:owned:a", "j-1"}).number, 0);
  EXPECT_EQ(put("b", "j-1", 2, 2), 1);
  ASSERT_TRUE(a.members->beat());
  EXPECT_EQ(a.lost.size(), 1u) << "told once";
}

TEST_F(Members, EqualJobOfAnotherMemberIsNotOverwritten) {
  add("a");
  add("b");
  ASSERT_EQ(put("a", "j-1", 1), 1);

  EXPECT_EQ(put("b", "j-1", 1, 9), static_cast<int>(PutAnswer::lost));
  EXPECT_EQ(field("j-1", "owner"), "a");
}

TEST_F(Members, ReportTheOwnerOfAJobAndWhetherItIsAlive) {
  auto& a = add("a");
  auto& b = add("b");
  a.members->announce("http://here:1", "here:2");
  ASSERT_TRUE(a.members->beat());
  ASSERT_EQ(put("a", "j-1", 1), 1);

  const auto owner = b.members->owner_of({"j-1"}).value();
  ASSERT_TRUE(owner);
  EXPECT_EQ(owner->http, "http://here:1");
  EXPECT_EQ(owner->grpc, "here:2");
  EXPECT_TRUE(owner->alive);
  lease_ends("a");
  EXPECT_FALSE(b.members->owner_of({"j-1"}).value()->alive);
  EXPECT_FALSE(b.members->owner_of({"j-2"}).value());
}

TEST_F(Members, StartNumbersAreUnique) {
  auto &a = add("a"), &b = add("b");

  EXPECT_EQ(a.members->unique_start(7).value(), 8u);
  EXPECT_EQ(b.members->unique_start(0).value(), 9u);
  redis_.kill();
  redis_.start();
  ASSERT_TRUE(b.members->beat()) << "on a new connection it tells the number it has";
  auto& c = add("c");
  EXPECT_EQ(c.members->unique_start(0).value(), 10u);
}

}  // namespace
}  // namespace ls::coordinator
