// The spans that the coordinator records of a job.
#include <gmock/gmock.h>

#include "coordinator/service/state/job_trace.h"
#include "tests/support/eventually.h"
#include "tests/support/span_collector.h"
#include "tests/unit/service/fake_farm.h"

namespace ls::coordinator {
namespace {

using test::CollectedSpan;
using test::SpanCollector;
using ::testing::IsSupersetOf;

constexpr const char* kParent = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";

class TraceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ::testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<Coordinator> open(trace::Sampler sampler = {}) {
    Coordinator::Options options;
    options.data = folder_;
    options.tracer = collector_.tracer(std::make_shared<SystemClock>(), sampler);
    auto opened = Coordinator::open(std::move(options));
    EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
    return std::move(*opened);
  }
  JobId submit_below(Coordinator& coordinator, const std::string& traceparent) {
    SubmitRequest request{"test.xml", kSceneText, {}, {}};
    request.traceparent = traceparent;
    return coordinator.submit(request).value_or(JobId{});
  }

  SpanCollector collector_;
  std::filesystem::path folder_;
};

const CollectedSpan* find(const std::vector<CollectedSpan>& spans, const std::string& id) {
  for (const CollectedSpan& span : spans)
    if (span.id == id) return &span;
  return nullptr;
}

// All spans are descendants of the span `job` and lie within the times of their parents. A lease that has
// lost units is an exception: the fake workers still send results of units that others have now, and their
// spans end after the lease's.
void expect_a_tree(const std::vector<CollectedSpan>& spans) {
  std::set<std::string> ids;
  int roots = 0;
  for (const CollectedSpan& span : spans) {
    EXPECT_TRUE(ids.insert(span.id).second) << span.name << " twice";
    EXPECT_EQ(span.trace, spans.front().trace);
    EXPECT_LE(span.start_ns, span.end_ns) << span.name;
    if (span.name == "job") {
      ++roots;
      continue;
    }
    const CollectedSpan* parent = find(spans, span.parent);
    ASSERT_TRUE(parent) << span.name << " has no parent";
    EXPECT_LE(parent->start_ns, span.start_ns) << span.name << " in " << parent->name;
    const bool lost = parent->json.dump().find("lightshaft.lost") != std::string::npos;
    EXPECT_TRUE(lost || parent->end_ns >= span.end_ns) << span.name << " in " << parent->name;
  }
  EXPECT_EQ(roots, 1);
}

std::map<std::string, int> counts(const std::vector<CollectedSpan>& spans) {
  std::map<std::string, int> all;
  for (const CollectedSpan& span : spans) ++all[span.name];
  return all;
}

TEST_F(TraceTest, SpansOfAJobFormATree) {
  int results = 0;
  std::set<UnitKey> units;
  {
    const auto coordinator = open();
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 2);
    farm.tamper = [&](UnitResult r) {
      units.insert(r.unit);
      return std::vector{std::move(r)};
    };
    ASSERT_TRUE(farm.finish(job));
    results = farm.results_sent;
  }

  const auto spans = collector_.spans();
  expect_a_tree(spans);
  auto count = counts(spans);
  EXPECT_EQ(count["admit scene"], 1);
  EXPECT_GE(count["lease"], 1);
  // A duplicate that arrives after its unit is done is not verified.
  EXPECT_LE(count["check partial"], results);
  EXPECT_GE(count["check partial"], static_cast<int>(units.size()));
  EXPECT_EQ(count["store partial"], count["check partial"]);
  EXPECT_EQ(count["fold"], static_cast<int>(units.size()));
  EXPECT_EQ(count["write image"], 1);
  const auto root = collector_.named("job").at(0);
  EXPECT_EQ(root.parent, "");
  std::vector<std::string> events;
  for (const auto& event : root.json["events"]) events.push_back(event["name"]);
  EXPECT_THAT(events, ::testing::ElementsAre("running", "done"));
}

TEST_F(TraceTest, JobIsPartOfItsSubmittersTrace) {
  {
    const auto coordinator = open();
    const JobId job = submit_below(*coordinator, kParent);
    ASSERT_TRUE(finish(*coordinator, job));
  }
  const auto root = collector_.named("job").at(0);
  EXPECT_EQ(root.trace, "0af7651916cd43dd8448eb211c80319c");
  EXPECT_EQ(root.parent, "b7ad6b7169203331");
}

TEST_F(TraceTest, NewCoordinatorContinuesTheTrace) {
  JobId job;
  std::string trace;
  for (const std::string parent : {"", kParent}) {
    collector_.requests.clear();
    std::string lease;
    {
      const auto coordinator = open();
      job = submit_below(*coordinator, parent);
      FakeFarm farm(*coordinator, 1);
      farm.stop_after = 3;
      farm.finish(job);
    }
    const std::size_t before = collector_.spans().size();
    trace = collector_.spans().back().trace;
    {
      const auto coordinator = open();
      ASSERT_TRUE(finish(*coordinator, job));
    }
    auto spans = collector_.spans();
    ASSERT_GT(spans.size(), before);
    for (std::size_t i = before; i < spans.size(); ++i) EXPECT_EQ(spans[i].trace, trace);
    std::erase_if(spans, [&](const CollectedSpan& span) { return span.trace != trace; });
    // The parent of the first process's spans is the job's span, which only the second process recorded.
    const auto root = std::find_if(spans.begin(), spans.end(), [](const auto& s) { return s.name == "job"; });
    ASSERT_NE(root, spans.end());
    const auto admission =
        std::find_if(spans.begin(), spans.end(), [](const auto& s) { return s.name == "admit scene"; });
    EXPECT_EQ(admission->parent, root->id);
    EXPECT_LE(root->start_ns, admission->start_ns);
    EXPECT_EQ(root->json["events"][0]["name"], "restored");
  }
}

// The worker sends a result of a lease from before the coordinator's restart, and reports since when it has
// had the unit.
TEST_F(TraceTest, LeaseFromBeforeTheRestartIsRecordedFromItsWorkersReport) {
  std::vector<UnitResult> kept;
  JobId job;
  {
    auto coordinator = open();
    job = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);
    farm.tamper = [&](UnitResult r) {
      kept.push_back(std::move(r));
      return std::vector<UnitResult>{};
    };
    farm.run([&] { return !kept.empty(); });
    coordinator.reset();  // it is destroyed before it notices that the worker has disconnected
  }
  const std::int64_t held = system_unix_ns();
  {
    const auto coordinator = open();
    FakeFarm farm(*coordinator, 1);
    UnitResult result = kept.front();
    result.held_unix_ns = static_cast<std::uint64_t>(held);
    farm.sessions().front()->receive(std::move(result));
    ASSERT_TRUE(farm.finish(job));
  }
  const auto former = collector_.named("lease");
  const auto it =
      std::find_if(former.begin(), former.end(), [&](const auto& s) { return s.start_ns == held; });
  ASSERT_NE(it, former.end());
  auto spans = collector_.spans();
  expect_a_tree(spans);
}

TEST_F(TraceTest, WorkerCannotMoveALeaseToAnotherJob) {
  {
    const auto coordinator = open();
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);
    farm.tamper = [](UnitResult r) {
      r.held_unix_ns = r.unit.tile % 2 == 0 ? 1 : ~std::uint64_t{0};
      return std::vector{std::move(r)};
    };
    ASSERT_TRUE(farm.finish(job));
  }
  expect_a_tree(collector_.spans());
}

TEST_F(TraceTest, ExtendedJobGetsAnotherSpanOfTheSameTrace) {
  {
    const auto coordinator = open();
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);
    ASSERT_TRUE(farm.finish(job));
    ASSERT_TRUE(extend(*coordinator, job, 32));
    ASSERT_TRUE(farm.finish(job));
  }
  const auto jobs = collector_.named("job");
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0].trace, jobs[1].trace);
  EXPECT_NE(jobs[0].id, jobs[1].id);
  EXPECT_LE(jobs[0].end_ns, jobs[1].start_ns);
  for (const CollectedSpan& span : collector_.named("fold")) {
    const CollectedSpan& parent = span.parent == jobs[0].id ? jobs[0] : jobs[1];
    EXPECT_EQ(span.parent, parent.id);
    EXPECT_LE(parent.start_ns, span.start_ns);
    EXPECT_GE(parent.end_ns, span.end_ns);
  }
}

TEST_F(TraceTest, SpanOfACancelledJobEnds) {
  {
    const auto coordinator = open();
    const JobId job = submit(*coordinator);
    FakeFarm farm(*coordinator, 1);
    ASSERT_TRUE(coordinator->cancel(job));
  }
  expect_a_tree(collector_.spans());
  const auto root = collector_.named("job").at(0);
  EXPECT_NE(root.json["attributes"].dump().find("cancelled"), std::string::npos);
}

// Workers get a traceparent only from a coordinator whose tracer samples the job.
TEST_F(TraceTest, WorkersGetALeasesSpanOnlyIfTheJobIsTraced) {
  const auto told = [&](Coordinator& coordinator) {
    const auto mail = std::make_shared<Mailbox>();
    WorkerHello hello;
    hello.name = "w";
    hello.numeric_class = sha256("class");
    const auto session = coordinator.connect(hello, std::make_shared<MailSink>(mail, 0));
    const JobId job = submit(coordinator);
    std::optional<trace::SpanContext> context;
    for (bool assigned = false; !assigned;) {
      const auto letter = mail->take();
      if (!letter) break;
      if (const auto* assign = std::get_if<AssignLease>(&letter->second))
        context = assign->trace, assigned = true;
    }
    EXPECT_TRUE(coordinator.cancel(job));
    return context;
  };
  EXPECT_FALSE(told(*open_at(folder_)));
  EXPECT_FALSE(told(*open({0, true})));
  EXPECT_TRUE(told(*open()));
}

// A traced job whose spans the test begins and ends itself.
struct TracedJob {
  explicit TracedJob(StoredJob job = {}) : stored(std::move(job)) {
    stored.id = {"j"};
    spans = JobTrace::begin({tracer, "t"}, stored);
  }
  Lease lend(const std::string& lease, const std::string& worker, TileIndex tile = 0) {
    Lease lent{{lease}, stored.id, {LeaseUnit{tile, 0, {}, {0, 1}}}};
    contexts.push_back(spans->lease_begins(lent, {worker}, worker, clock->now()));
    return lent;
  }
  void result(const Lease& lease, const std::string& worker, bool failed) {
    UnitResult r;
    r.unit = {stored.id, lease.units[0].tile, 0};
    r.lease = lease.id;
    spans->result(r, {worker}, clock->now(), 0, clock->now(), failed);
  }
  // Ends the job. Returns the value of the attribute in each lease's span, by the lease's id.
  std::map<std::string, std::string> end(const std::string& attribute) {
    spans->end(stored, clock->now());
    tracer.reset();
    spans.reset();
    std::map<std::string, std::string> values;
    for (const CollectedSpan& span : collector.named("lease")) {
      std::string id, value;
      for (const auto& one : span.json["attributes"]) {
        if (one["key"] == "lightshaft.lease") id = one["value"]["stringValue"].get<std::string>();
        if (one["key"] == attribute) value = one["value"].front().get<std::string>();
      }
      EXPECT_TRUE(values.emplace(id, value).second) << id << " twice";
    }
    return values;
  }

  SpanCollector collector;
  std::shared_ptr<FakeClock> clock = std::make_shared<FakeClock>();
  std::shared_ptr<trace::Tracer> tracer = collector.tracer(clock);
  StoredJob stored;
  std::unique_ptr<JobTrace> spans;
  std::vector<trace::SpanContext> contexts;
};

TEST(JobTrace, RefusedResultEndsNoLeaseOfAnotherWorker) {
  TracedJob job;
  const Lease a = job.lend("t-1", "a"), b = job.lend("t-2", "b");
  job.result(a, "a", true);
  job.spans->units_freed({job.stored.id, a.id, {"a"}, {UnitKey{job.stored.id, 0, 0}}, FreedCause::failed},
                         job.clock->now());
  job.result(b, "b", false);

  const auto lost = job.end("lightshaft.lost");
  EXPECT_EQ(lost.at("t-1"), to_string(FreedCause::failed));
  EXPECT_EQ(lost.at("t-2"), "");
}

TEST(JobTrace, WorkerCannotChangeTheLeaseOfAnother) {
  TracedJob job;
  const Lease a = job.lend("t-1", "a", 0);
  job.result(a, "liar", true);
  EXPECT_EQ(job.end("lightshaft.results"), (std::map<std::string, std::string>{{"t-1", "0"}}));
  for (const CollectedSpan& span : job.collector.named("check partial"))
    EXPECT_EQ(span.parent, job.collector.named("job").at(0).id);
}

// Both farms count their jobs and leases from 1.
TEST(JobTrace, TwoFarmsInOneTraceHaveSeparateSpans) {
  StoredJob one;
  one.traceparent = kParent;
  one.submitted_unix = 1'700'000'000.25;
  StoredJob later = one, another_scene = one;
  later.submitted_unix += 1;
  another_scene.scene = sha256("another scene");

  std::set<std::string> jobs, leases;
  for (const StoredJob& stored : {one, later, another_scene}) {
    TracedJob job(stored);
    job.lend("t-1", "a");
    jobs.insert(to_traceparent(*JobTrace::context_of({job.tracer, "t"}, job.stored)));
    leases.insert(to_traceparent(job.contexts.at(0)));
  }
  EXPECT_EQ(jobs.size(), 3u);
  EXPECT_EQ(leases.size(), 3u);
}

TEST_F(TraceTest, ResubmittedJobBelongsToTheTraceOfThatRequest) {
  {
    const auto coordinator = open();
    const JobId first = submit_below(*coordinator, "");
    const auto second = coordinator->submit_again(first, {}, "", kParent);
    ASSERT_TRUE(second);
    EXPECT_EQ(hex(coordinator->trace_of(*second)->trace), "0af7651916cd43dd8448eb211c80319c");
    EXPECT_TRUE(coordinator->cancel(first));
    EXPECT_TRUE(coordinator->cancel(*second));
  }
  std::set<std::string> parents;
  for (const CollectedSpan& span : collector_.named("job")) parents.insert(span.parent);
  EXPECT_EQ(parents, (std::set<std::string>{"", "b7ad6b7169203331"}));
}

// A job whose units are all done, but whose final image cannot be written, since a folder has its name.
class TraceOfAnUnwrittenImage : public TraceTest {
 protected:
  JobId render(Coordinator& coordinator) {
    const JobId job = submit(coordinator);
    std::filesystem::create_directories(image(job) / "in the way");
    FakeFarm farm(coordinator, 1);
    EXPECT_TRUE(farm.run([&] {
      return coordinator.job(job)->error.find("the final image cannot be written") != std::string::npos;
    }));
    return job;
  }
  std::filesystem::path image(const JobId& job) const { return folder_ / "jobs" / job.value / "image.exr"; }
};

TEST_F(TraceOfAnUnwrittenImage, RemovedJobEndsItsSpan) {
  {
    const auto coordinator = open();
    const JobId job = render(*coordinator);
    ASSERT_TRUE(coordinator->remove(job));
  }
  expect_a_tree(collector_.spans());
}

TEST_F(TraceOfAnUnwrittenImage, JobThatEndsAfterARestartKeepsItsSpan) {
  JobId job;
  {
    const auto coordinator = open();
    job = render(*coordinator);
    ASSERT_TRUE(set_priority(*coordinator, job, 3)) << "this stores the job's record";
  }
  std::filesystem::remove_all(image(job));
  {
    const auto coordinator = open();
    ASSERT_TRUE(test::eventually([&] { return coordinator->job(job)->state == JobState::done; }));
  }
  const auto roots = collector_.named("job");
  ASSERT_EQ(roots.size(), 1u);
  for (const CollectedSpan& span : collector_.named("fold")) EXPECT_EQ(span.parent, roots[0].id);
}

}  // namespace
}  // namespace ls::coordinator
