// Tests which findings `lightshaft doctor` makes from observed facts.
#include <gmock/gmock.h>

#include "cli/doctor/findings.h"

namespace ls::cli {
namespace {

using ::testing::HasSubstr;

MachineFacts good_machine() {
  MachineFacts facts;
  facts.processor_target = "x86-64-v3";
  facts.processor_fits = true;
  facts.numeric_class = "abc";
  facts.memory_bytes = std::uint64_t{16} << 30;
  facts.cpus = 8;
  facts.file_limit = 1'048'576;
  facts.sandbox = Sandboxed{true, true};
  facts.vdb_program = "/usr/lib/lightshaft/lightshaft-vdb";
  facts.vdb_found = true;
  facts.denoiser = "Open Image Denoise 2.3.0";
  facts.redis_server = "/usr/bin/redis-server";
  facts.python = {"/usr/bin/python3", "/usr/share/lightshaft/lightshaft_command"};
  facts.folders = {{"cache", "/var/cache/lightshaft", true, std::uint64_t{100} << 30}};
  return facts;
}

FarmFacts good_farm() {
  FarmFacts facts;
  facts.url = "https://farm.example:8080";
  facts.has_token = facts.is_coordinator = true;
  facts.asked_at = 1000.25;
  facts.answered_at = 1000.5;
  facts.date = 1000;
  facts.session_status = 200;
  facts.role = "admin";
  facts.version = "1.0";
  facts.stuck_jobs.emplace();
  facts.workers_address = "farm.example:50051";
  facts.workers = {{"w1", "connected", "1.0", "abc", false}};
  return facts;
}

std::vector<Finding> judge(const FarmFacts& facts) { return judge_farm(facts, "1.0", "abc"); }

// Returns the worst finding with this name.
Finding find(const std::vector<Finding>& findings, const std::string& name) {
  Finding found{"none", {}, Status::ok, {}, {}};
  for (const Finding& each : findings)
    if (each.name == name && (found.name == "none" || each.status > found.status)) found = each;
  EXPECT_EQ(found.name, name) << "no such finding";
  return found;
}

TEST(Doctor, ReportsNoProblemsOnAGoodMachineAndFarm) {
  EXPECT_EQ(worst(judge_machine(good_machine())), Status::ok);
  EXPECT_EQ(worst(judge(good_farm())), Status::ok);
}

struct MachineFault {
  const char* name;
  Status status;
  void (*damage)(MachineFacts&);
};
class MachineFaults : public ::testing::TestWithParam<MachineFault> {};

TEST_P(MachineFaults, AreReportedOneByOneWithAdvice) {
  MachineFacts facts = good_machine();
  GetParam().damage(facts);

  const auto findings = judge_machine(facts);

  const Finding found = find(findings, GetParam().name);
  EXPECT_EQ(found.status, GetParam().status);
  EXPECT_FALSE(found.what.empty());
  EXPECT_FALSE(found.advice.empty());
  for (const Finding& each : findings)
    if (each.name != GetParam().name) EXPECT_EQ(each.status, Status::ok) << each.name;
}

INSTANTIATE_TEST_SUITE_P(
    All, MachineFaults,
    ::testing::Values(
        MachineFault{"processor", Status::problem, [](MachineFacts& f) { f.processor_fits = false; }},
        MachineFault{"memory", Status::warning, [](MachineFacts& f) { f.memory_bytes = (2ull << 30) - 1; }},
        MachineFault{"cores", Status::warning, [](MachineFacts& f) { f.cpu_quota = 2; }},
        MachineFault{"open-files", Status::warning, [](MachineFacts& f) { f.file_limit = 65535; }},
        MachineFault{"sandbox", Status::warning, [](MachineFacts& f) { f.sandbox.reset(); }},
        MachineFault{"sandbox", Status::warning, [](MachineFacts& f) { f.sandbox->calls = false; }},
        MachineFault{"sandbox", Status::warning, [](MachineFacts& f) { f.sandbox->files = false; }},
        MachineFault{"openvdb", Status::problem, [](MachineFacts& f) { f.vdb_found = false; }},
        MachineFault{"denoiser", Status::warning,
                     [](MachineFacts& f) { f.denoiser = "", f.denoiser_trouble = "none"; }},
        MachineFault{"python", Status::warning, [](MachineFacts& f) { f.python.interpreter.clear(); }},
        MachineFault{"python", Status::warning, [](MachineFacts& f) { f.python.part.clear(); }},
        MachineFault{"python", Status::warning, [](MachineFacts& f) { f.python.makes_scene = true; }},
        MachineFault{"cache", Status::problem, [](MachineFacts& f) { f.folders[0].usable = false; }},
        MachineFault{"cache", Status::warning,
                     [](MachineFacts& f) { f.folders[0].free_bytes = (1ull << 30) - 1; }},
        MachineFault{"cache", Status::problem,
                     [](MachineFacts& f) { f.folders[0].free_bytes = (64ull << 20) - 1; }}));

struct FarmFault {
  const char* name;
  Status status;
  const char* words;
  void (*damage)(FarmFacts&);
};
class FarmFaults : public ::testing::TestWithParam<FarmFault> {};

TEST_P(FarmFaults, AreReportedWithAdviceAndAddress) {
  FarmFacts facts = good_farm();
  GetParam().damage(facts);

  const Finding found = find(judge(facts), GetParam().name);

  EXPECT_EQ(found.status, GetParam().status);
  EXPECT_THAT(found.what + " " + found.advice, HasSubstr(GetParam().words));
  EXPECT_FALSE(found.advice.empty());
  EXPECT_EQ(found.subject, facts.url);
}

INSTANTIATE_TEST_SUITE_P(
    All, FarmFaults,
    ::testing::Values(
        FarmFault{"farm", Status::problem, "firewall",
                  [](FarmFacts& f) { f.trouble = "refused", f.is_coordinator = false; }},
        FarmFault{"farm", Status::problem, "--ca",
                  [](FarmFacts& f) { f.trouble = "SSL certificate problem", f.is_coordinator = false; }},
        FarmFault{"farm", Status::problem, "--http", [](FarmFacts& f) { f.is_coordinator = false; }},
        FarmFault{"farm", Status::problem, "disk is full",
                  [](FarmFacts& f) { f.not_ready = "disk is full"; }},
        FarmFault{"farm", Status::warning, "Redis", [](FarmFacts& f) { f.remark = "ready, but: Redis"; }},
        FarmFault{"tls", Status::warning, "--tls", [](FarmFacts& f) { f.url = "http://farm.example"; }},
        FarmFault{"clock", Status::warning, "no header Date", [](FarmFacts& f) { f.date.reset(); }},
        FarmFault{"clock", Status::warning, "ahead", [](FarmFacts& f) { f.date = 1062; }},
        FarmFault{"clock", Status::problem, "ahead", [](FarmFacts& f) { f.date = 1902; }},
        FarmFault{"clock", Status::problem, "behind", [](FarmFacts& f) { f.date = 98; }},
        FarmFault{"token", Status::problem, "--token-file",
                  [](FarmFacts& f) { f.has_token = false, f.role = ""; }},
        FarmFault{"token", Status::problem, "does not know",
                  [](FarmFacts& f) { f.session_status = 401, f.role = ""; }},
        FarmFault{"token", Status::problem, "role submit",
                  [](FarmFacts& f) { f.session_status = 403, f.role = "", f.session_trouble = "no"; }},
        FarmFault{"version", Status::warning, "0.9", [](FarmFacts& f) { f.version = "0.9"; }},
        FarmFault{"version", Status::warning, "does not tell", [](FarmFacts& f) { f.version = ""; }},
        FarmFault{"workers-port", Status::warning, "let port 50051 pass",
                  [](FarmFacts& f) { f.workers_trouble = "Connection refused"; }},
        FarmFault{"workers", Status::warning, "none", [](FarmFacts& f) { f.workers->at(0).state = "lost"; }},
        FarmFault{"jobs", Status::warning, "1 unfinished job makes no progress; j-7: lacks a tag",
                  [](FarmFacts& f) {
                    f.stuck_jobs = std::vector{StuckJob{"j-7", "lacks a tag"}};
                  }},
        FarmFault{"workers", Status::warning, "w1", [](FarmFacts& f) { f.workers->at(0).state = "sick"; }},
        FarmFault{"workers", Status::warning, "--fake", [](FarmFacts& f) { f.workers->at(0).fake = true; }},
        FarmFault{"worker-versions", Status::warning, "w1",
                  [](FarmFacts& f) { f.workers->at(0).version = "0.9"; }},
        FarmFault{"numeric-class", Status::warning, "other bits",
                  [](FarmFacts& f) { f.workers->at(0).numeric_class = "def"; }},
        FarmFault{"numeric-class", Status::warning, "2 numeric classes", [](FarmFacts& f) {
                    f.workers->push_back({"w2", "connected", "1.0", "def", false});
                  }}));

// At some time between request and answer, the coordinator's clock was in [date, date + 1).
TEST(ClockLead, IsTheSmallestThatTheAnswerAllows) {
  EXPECT_EQ(clock_lead(1000, 1000, 1000), 0);
  EXPECT_EQ(clock_lead(1000.75, 1000.75, 1000), 0);
  EXPECT_EQ(clock_lead(1000, 1004, 1003), 0) << "a slow answer hides a difference of seconds";
  EXPECT_EQ(clock_lead(1000, 1000.5, 1010), 9.5);
  EXPECT_EQ(clock_lead(1000.5, 1001, 990), -9.5);
}

TEST(ClockLead, OneMinuteIsTolerated) {
  FarmFacts facts = good_farm();

  facts.date = 1060;  // at least 59.5 s ahead
  EXPECT_EQ(find(judge(facts), "clock").status, Status::ok);
  facts.date = 1061;  // at least 60.5 s ahead
  EXPECT_EQ(find(judge(facts), "clock").status, Status::warning);
}

TEST(Doctor, NumPyIsOptionalWhereTheFirstSceneIsReady) {
  MachineFacts facts = good_machine();
  EXPECT_FALSE(facts.python.numpy);
  EXPECT_EQ(find(judge_machine(facts), "python").status, Status::ok);
  facts.python.makes_scene = facts.python.numpy = true;
  EXPECT_EQ(find(judge_machine(facts), "python").status, Status::ok);
}

TEST(Doctor, PortForWorkersOfTheCoordinatorsMachineAloneIsNotTried) {
  FarmFacts facts = good_farm();
  facts.workers_address = "127.0.0.1:50051";

  const Finding found = find(judge(facts), "workers-port");

  EXPECT_EQ(found.status, Status::ok);
  EXPECT_THAT(found.what, HasSubstr("its own machine alone"));
}

TEST(Doctor, TellsWhetherThePortForJoiningIsReached) {
  const JoiningFacts open{"farm.example:50052", {}}, closed{"farm.example:50052", "Connection refused"};

  EXPECT_EQ(judge_joining(open).status, Status::ok);
  const Finding found = judge_joining(closed);
  EXPECT_EQ(found.status, Status::problem);
  EXPECT_EQ(found.subject, "farm.example:50052");
  EXPECT_THAT(found.what, HasSubstr("Connection refused"));
  EXPECT_THAT(found.advice, HasSubstr("firewall"));
}

TEST(Doctor, RequiresNoTlsForThisMachine) {
  FarmFacts facts = good_farm();
  for (const char* url : {"http://localhost:8080", "http://127.0.0.1:1", "http://[::1]:8080"}) {
    facts.url = url;
    EXPECT_EQ(find(judge(facts), "tls").status, Status::ok) << url;
  }
}

}  // namespace
}  // namespace ls::cli
