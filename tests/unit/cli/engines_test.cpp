#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "cli/scale/child_command.h"
#include "cli/scale/engines.h"
#include "cli/scale/farm_up.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using State = EngineWorker::State;

TEST(Squeue, TellsWorkersThatWaitRunAndNeverWill) {
  const auto workers = parse_squeue(
      "12_1|RUNNING|3:07|4|None\n"
      "12_2|PENDING|0:00|4|Resources\n"
      "13_1|PENDING|0:00|2|launch failed requeued held\n"
      "14_1|RUNNING|1-02:00:05|1|None\n"
      "15_1|PENDING|0:00|1|BeginTime\n");

  ASSERT_TRUE(workers);
  ASSERT_EQ(workers->size(), 5u);
  EXPECT_EQ((*workers)[0].id, "12_1");
  EXPECT_EQ((*workers)[0].state, State::running);
  EXPECT_DOUBLE_EQ((*workers)[0].seconds, 187);
  EXPECT_EQ((*workers)[0].cores, 4);
  EXPECT_EQ((*workers)[1].state, State::waiting);
  EXPECT_EQ((*workers)[2].state, State::stuck);
  EXPECT_DOUBLE_EQ((*workers)[3].seconds, 93605);
  EXPECT_EQ((*workers)[4].state, State::stuck);
}

TEST(Squeue, AnAnswerThatItDoesNotKnowIsNotTakenForNoWorkers) {
  for (const char* line :
       {"slurm_load_jobs error\n", "1|RUNNING\n", "1|RUNNING|soon|1|None\n", "1|RUNNING|1:00|x|None\n"})
    EXPECT_FALSE(parse_squeue(line)) << line;
}

struct MachinesFile : testing::Test {
  std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "machines";
  auto read(const std::string& text) {
    std::ofstream(file) << text;
    return read_machines(file);
  }
};

TEST_F(MachinesFile, NamesOneMachineALine) {
  const auto machines = read("# the lab\nnode1\n  user@node2.example.org  # by the window\n\n");

  ASSERT_TRUE(machines);
  EXPECT_THAT(*machines, ElementsAre("node1", "user@node2.example.org"));
}

TEST_F(MachinesFile, RefusesWhatSshWouldTakeForAnOptionOrAShell) {
  for (const char* line : {"-oProxyCommand=x", "node 1", "node;x", "$(x)", "../x"}) {
    const auto machines = read("node1\n" + std::string(line) + "\n");
    ASSERT_FALSE(machines) << line;
    EXPECT_THAT(machines.error().message, HasSubstr("machines:2: error:"));
  }
}

TEST_F(MachinesFile, RefusesAMachineThatIsNamedTwiceAndAnEmptyList) {
  EXPECT_THAT(read("a\na\n").error().message, HasSubstr("'a' is named twice"));
  EXPECT_THAT(read("# none\n").error().message, HasSubstr("names no machines"));
}

TEST(ChildCommand, PassesInputAndTellsOutputAndCode) {
  const auto done = run_command({"sh", "-c", "cat; echo trouble >&2; exit 3"}, "words", 60);

  ASSERT_TRUE(done);
  EXPECT_EQ(done->out, "words");
  EXPECT_EQ(done->err, "trouble\n");
  EXPECT_EQ(done->code, 3);
}

TEST(ChildCommand, KeepsOurVariablesToItself) {
  ::setenv("LIGHTSHAFT_TOKEN", "secret", 1);
  const auto done = run_command({"env"}, "", 60);
  ::unsetenv("LIGHTSHAFT_TOKEN");

  ASSERT_TRUE(done);
  EXPECT_THAT(done->out, HasSubstr("PATH="));
  EXPECT_THAT(done->out, testing::Not(HasSubstr("LIGHTSHAFT_TOKEN")));
}

TEST(ChildCommand, ReadsMoreThanAPipeHolds) {
  const std::string much(1 << 20, 'x');
  const auto done = run_command({"cat"}, much, 60);

  ASSERT_TRUE(done);
  EXPECT_EQ(done->out, much);
}

TEST(ChildCommand, EndsAProgramThatTakesTooLong) {
  const auto file = std::filesystem::temp_directory_path() / fmt::format("lightshaft-sleeps-{}", ::getpid());

  const auto done = run_command({"sh", "-c", "echo $$ > " + file.string() + "; exec sleep 1000"}, "", 2);

  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, Errc::unavailable);
  pid_t program = 0;
  ASSERT_TRUE(std::ifstream(file) >> program) << "the shell was not started in time";
  std::filesystem::remove(file);
  EXPECT_EQ(::kill(program, 0), -1) << "it still runs";
}

TEST(ChildCommand, EndsAProgramThatPrintsTooMuch) {
  const auto done = run_command({"cat", "/dev/zero"}, "", 600);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, Errc::resource_exhausted);
  EXPECT_THAT(done.error().message, HasSubstr("cat printed more than 64 MiB"));
}

TEST(ChildCommand, NamesAProgramThatIsNotThere) {
  const auto done = run_command({"no-such-program-here"}, "", 60);

  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().code, Errc::not_found);
}

// ---- Docker ----

TEST(DockerPs, TellsContainersThatRunFromThoseThatHaveEndedAndThoseThatNeverStarted) {
  const auto found = parse_docker_ps(
      "aa|running|1000|4\n"
      "bb|exited|900|4\n"
      "cc|created|990|2\n"
      "dd|paused|1100|1\n",
      1060);

  ASSERT_TRUE(found);
  ASSERT_EQ(found->workers.size(), 3u);
  EXPECT_EQ(found->workers[0].id, "aa");
  EXPECT_EQ(found->workers[0].state, State::running);
  EXPECT_DOUBLE_EQ(found->workers[0].seconds, 60);
  EXPECT_EQ(found->workers[0].cores, 4);
  EXPECT_EQ(found->workers[1].state, State::stuck);
  EXPECT_DOUBLE_EQ(found->workers[2].seconds, 0) << "a clock that was set back gives no time back";
  EXPECT_THAT(found->ended, ElementsAre("bb"));
}

TEST(DockerPs, AnAnswerThatItDoesNotKnowIsNotTakenForNoWorkers) {
  for (const char* line :
       {"error\n", "aa|running\n", "aa|running|soon|1\n", "|running|1|1\n", "aa|running|1|0\n"})
    EXPECT_FALSE(parse_docker_ps(line, 0)) << line;
}

// ---- Kubernetes ----

json deployment() {
  return {{"kind", "Deployment"},
          {"spec",
           {{"replicas", 0},
            {"template",
             {{"metadata", {{"labels", {{"app", "lightshaft"}}}}},
              {"spec",
               {{"securityContext", {{"runAsUser", 10001}}},
                {"containers",
                 {{{"name", "worker"},
                   {"image", "i"},
                   {"args", {"--coordinator", "c:1"}},
                   {"resources", {{"requests", {{"cpu", "3500m"}}}}}}}}}}}}}}};
}

TEST(PodLike, IsTheDeploymentsWithItsNameAndAnEnd) {
  const auto pod = pod_like(
      deployment(), {.farm = "f", .threads = 4, .drain_seconds = 30, .minutes = 2, .worker_options = {"--x"}},
      "1a");

  ASSERT_TRUE(pod) << pod.error().message;
  const json& spec = (*pod)["spec"];
  EXPECT_EQ((*pod)["kind"], "Pod");
  EXPECT_EQ((*pod)["metadata"]["labels"],
            (json{{"app", "lightshaft"}, {"lightshaft.io/farm", "f"}, {"lightshaft.io/worker", "1a"}}));
  EXPECT_EQ(spec["containers"][0]["args"], (json{"--coordinator", "c:1", "--x", "--name", "f-1a"}));
  EXPECT_EQ(spec["securityContext"]["runAsUser"], 10001);
  EXPECT_EQ(spec["terminationGracePeriodSeconds"], 30);
  EXPECT_EQ(spec["activeDeadlineSeconds"], 120);
  EXPECT_EQ(spec["restartPolicy"], "Never");
}

TEST(PodLike, RefusesOtherCoresThanTheScalerCountsAndWhatHasNoPod) {
  EXPECT_THAT(pod_like(deployment(), {.farm = "f", .threads = 1}, "1").error().message,
              HasSubstr("say --threads 4"));
  for (const json& none :
       {json(), json::object(), json{{"spec", 1}}, json{{"spec", {{"template", {{"spec", 2}}}}}}})
    EXPECT_THAT(pod_like(none, {.farm = "f"}, "1").error().message, HasSubstr("no template of a pod"))
        << none;
}

json pod(const char* id, const char* phase, json status = json::object()) {
  status["phase"] = phase;
  return {{"metadata", {{"labels", {{"lightshaft.io/worker", id}}}}},
          {"spec", {{"containers", {{{"resources", {{"requests", {{"cpu", "2"}}}}}}}}}},
          {"status", std::move(status)}};
}

TEST(Pods, AreReadFromTheAnswerOfKubectl) {
  const json pulls{{"containerStatuses", {{{"state", {{"waiting", {{"reason", "ImagePullBackOff"}}}}}}}}};
  const auto found =
      parse_pods({{"items",
                   {pod("a", "Pending"), pod("b", "Running", {{"startTime", "1970-01-02T00:00:05Z"}}),
                    pod("c", "Failed"), pod("d", "Succeeded"), pod("e", "Pending", pulls)}}},
                 86465);

  ASSERT_TRUE(found);
  ASSERT_EQ(found->workers.size(), 3u);
  EXPECT_EQ(found->workers[0].state, State::waiting);
  EXPECT_EQ(found->workers[1].state, State::running);
  EXPECT_DOUBLE_EQ(found->workers[1].seconds, 60);
  EXPECT_EQ(found->workers[1].cores, 2);
  EXPECT_EQ(found->workers[2].state, State::stuck);
  EXPECT_THAT(found->ended, ElementsAre("c", "d"));
}

TEST(Pods, AnAnswerThatIsNoListIsNotTakenForNoWorkers) {
  for (const json& answer : {json(), json::object(), json{{"items", 3}}, json{{"items", {1}}},
                             json{{"items", {{{"metadata", {{"labels", {{"lightshaft.io/worker", 7}}}}}}}}}})
    EXPECT_FALSE(parse_pods(answer, 0)) << answer;
}

// ---- Demand ----

json job(const char* state, json eta, json more) {
  return {{"state", state}, {"eta_seconds", std::move(eta)}, {"eta_with_more", std::move(more)}};
}
json job_of(const char* id, const char* owner, double spent, double queued) {
  return {{"id", id},
          {"owner", owner},
          {"state", "running"},
          {"core_seconds", spent},
          {"queued_core_seconds", queued}};
}
json worker(const char* name, const char* state, json job) {
  return {{"name", name}, {"state", state}, {"threads", 4}, {"job", std::move(job)}};
}
const OurWorkers kOurs{"f", "an engine"};

TEST(Demand, IsReadFromTheCoordinatorsAnswers) {
  const json jobs{{"jobs",
                   {job_of("j-1", "", 0, 100), job_of("j-2", "", 0, 23.5), job("paused", 9, nullptr),
                    job("done", nullptr, nullptr)}}};
  const json workers{{"workers",
                      {worker("f-1", "connected", "j-1"), worker("f-2", "connected", nullptr),
                       worker("f-3", "lost", nullptr), worker("desk", "connected", nullptr)}}};
  Spending spending;

  const Demand d = demand_of(jobs, workers, kOurs, spending);

  EXPECT_EQ(d.open_jobs, 2);
  EXPECT_EQ(d.unpaid_jobs, 0);
  EXPECT_DOUBLE_EQ(d.queued_core_seconds, 123.5);
  EXPECT_TRUE(d.more_helps);
  EXPECT_EQ(d.other_threads, 4);
  EXPECT_THAT(d.joined, ElementsAre("f-1", "f-2"));
  EXPECT_THAT(d.idle, ElementsAre("f-2"));
}

TEST(Demand, MoreWorkersDoNotHelpIfNoForecastSaysSo) {
  const auto helps = [](const json& jobs) {
    Spending spending;
    return demand_of({{"jobs", jobs}}, json::object(), kOurs, spending).more_helps;
  };

  EXPECT_FALSE(helps(json::array({job("running", 5, nullptr)})));
  EXPECT_TRUE(helps({job("running", 5, nullptr), job("queued", nullptr, nullptr)}));
  EXPECT_TRUE(helps(json::array({job("queued", nullptr, nullptr)})));
}

TEST(Demand, LeavesOutJobsWhoseBudgetIsUsedUpAndAsksForNoMoreThanBudgetsPay) {
  Spending spending({.job = 100, .user = std::nullopt, .users = {{"ann", 150}}});
  demand_of({{"jobs", json::array()}}, json::object(), kOurs, spending);

  const Demand d = demand_of({{"jobs",
                               {job_of("j-1", "bob", 100, 5000),    // used up
                                job_of("j-2", "bob", 40, 5000),     // 60 are left of the job's budget
                                job_of("j-3", "ann", 30, 5000),     // 70 are left of the job's budget;
                                job_of("j-4", "ann", 10, 5000)}}},  // 110 are left of ann's budget
                             json::object(), kOurs, spending);

  EXPECT_EQ(d.open_jobs, 3);
  EXPECT_EQ(d.unpaid_jobs, 1);
  EXPECT_DOUBLE_EQ(d.queued_core_seconds, 60 + 110);
}

}  // namespace
}  // namespace ls::cli
