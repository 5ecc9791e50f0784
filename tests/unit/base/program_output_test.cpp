// What other programs write to our log, and what they inherit.
#include "core/base/program_output.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/base/spawn.h"

namespace ls {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TimePoint at(int second) { return TimePoint{} + std::chrono::seconds(second); }

TEST(OutputLines, AreCompleteAndClean) {
  LineBudget budget;
  OutputLines lines(budget);

  EXPECT_THAT(lines.take("one\ntwo", at(1)), ElementsAre("one"));
  EXPECT_THAT(lines.take("\n\n\r\nth\x1b[31mree\n", at(1)), ElementsAre("two", "th [31mree"));
  EXPECT_THAT(lines.take("last", at(1)), IsEmpty());
  EXPECT_THAT(lines.end(at(1)), ElementsAre("last"));
  EXPECT_EQ(lines.last(), "last");
}

TEST(OutputLines, AreTruncatedToTheLimit) {
  LineBudget budget;
  OutputLines lines(budget);
  const std::string whole(OutputLines::kLineBytes, 'a');

  EXPECT_THAT(lines.take(whole + "\n", at(1)), ElementsAre(whole));
  EXPECT_THAT(lines.take(whole + "b", at(1)), IsEmpty());
  EXPECT_THAT(lines.take("c\nd\n", at(1)), ElementsAre(whole + " ...", "d"));
}

TEST(OutputLines, AreLimitedAndCountTheOmittedOnes) {
  LineBudget budget;
  OutputLines lines(budget);
  std::string many;
  for (int i = 0; i < LineBudget::kBurst + 50; ++i) many += "x\n";

  EXPECT_THAT(lines.take(many, at(1)), SizeIs(static_cast<std::size_t>(LineBudget::kBurst)));
  EXPECT_TRUE(lines.leaves_out());
  EXPECT_THAT(lines.take("y\n", at(2)), IsEmpty());
  // A line more every 1 / kPerSecond seconds
  EXPECT_THAT(lines.take("z\nz\n", at(12)),
              ElementsAre("(51 lines are left out here: it wrote too many)", "z"));
  EXPECT_THAT(lines.end(at(12)), ElementsAre("(1 lines are left out here: it wrote too many)"));
}

TEST(LineBudget, SuccessiveProgramsShareTheBudgetAndNeverExceedItsBurst) {
  LineBudget budget;
  const auto spend_all = [&](int second) {
    int spent = 0;
    while (budget.spend(at(second))) ++spent;
    return spent;
  };

  EXPECT_EQ(spend_all(1), 200);
  EXPECT_EQ(spend_all(1), 0);
  EXPECT_EQ(spend_all(101), 10);
  EXPECT_EQ(spend_all(1'000'000), 200);
}

// The tests below run the shell as a helper.
std::string script(const std::string& text) {
  std::string name = (std::filesystem::temp_directory_path() / "lightshaft-helper-XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  ::close(fd);
  std::ofstream(name) << "#!/bin/sh\n" << text << "\n";
  std::filesystem::permissions(name, std::filesystem::perms::owner_all);
  return name;
}

HelperEnd run(const std::string& text, const std::atomic<bool>* stop = nullptr) {
  const Descriptor shared(::open("/dev/null", O_RDWR | O_CLOEXEC));
  const std::string program = script(text);
  const auto end = run_helper(program, {}, shared.fd, stop);
  std::filesystem::remove(program);
  EXPECT_TRUE(end) << end.error().message;
  return end.value_or(HelperEnd{});
}

TEST(Helper, ReportsItsEndAndItsLastOutput) {
  const HelperEnd end = run("echo first; echo 'out of \033[31mpaper' >&2; exit 3");

  ASSERT_TRUE(WIFEXITED(end.status));
  EXPECT_EQ(WEXITSTATUS(end.status), 3);
  EXPECT_EQ(end.last_line, "out of  [31mpaper");
}

TEST(Helper, EndsAlthoughItsOutputStaysOpen) {
  // The process in the background keeps the pipe open until this test's own end.
  const HelperEnd end = run("sleep 600 & echo $!");

  EXPECT_TRUE(WIFEXITED(end.status));
  ::kill(std::stoi(end.last_line), SIGKILL);
}

TEST(Helper, EndsAfterItHasClosedItsOutput) {
  const HelperEnd end = run("exec >&- 2>&-; exit 4");

  EXPECT_EQ(WEXITSTATUS(end.status), 4);
}

TEST(Helper, IsKilledOnStop) {
  const std::atomic<bool> stop{true};
  const HelperEnd end = run("while :; do :; done", &stop);

  ASSERT_TRUE(WIFSIGNALED(end.status));
  EXPECT_EQ(WTERMSIG(end.status), SIGKILL);
}

TEST(Helper, HasNoTerminal) {
  // Fields of /proc/PID/stat: 7 terminal (0: none)
  const HelperEnd end = run("read -r a b c d e f g rest < /proc/$$/stat; echo $g");

  EXPECT_EQ(end.last_line, "0");
}

// The process has a terminal, as the leader of its session or not.
TEST(Helper, HasNoTerminalEvenIfItsParentHasOne) {
  for (const bool leads : {true, false}) {
    const Descriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
    ASSERT_EQ(::grantpt(master.fd), 0);
    ASSERT_EQ(::unlockpt(master.fd), 0);
    const pid_t leader = ::fork();
    if (leader == 0) {
      ::setsid();
      ::open(::ptsname(master.fd), O_RDWR);  // becomes the terminal of the session
      const pid_t parent = leads ? 0 : ::fork();
      if (parent > 0) {
        int status = 1;
        ::waitpid(parent, &status, 0);
        ::_exit(WEXITSTATUS(status));
      }
      const Descriptor shared(::open("/dev/null", O_RDWR | O_CLOEXEC));
      const std::string program = script("read -r a b c d e f g rest < /proc/$$/stat; echo $g");
      const auto end = run_helper(program, {}, shared.fd);
      std::filesystem::remove(program);
      ::_exit(end && end->last_line == "0" ? 0 : 1);
    }
    int status = 1;
    ::waitpid(leader, &status, 0);
    EXPECT_EQ(status, 0) << (leads ? "of a leader" : "of another process");
  }
}

TEST(Helper, WritesToAPipeOnly) {
  EXPECT_THAT(run("readlink /proc/$$/fd/1").last_line, HasSubstr("pipe:"));
  EXPECT_THAT(run("readlink /proc/$$/fd/2").last_line, HasSubstr("pipe:"));
}

TEST(Spawn, GivesNoProgramATerminal) {
  const Descriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_EQ(::grantpt(master.fd), 0);
  ASSERT_EQ(::unlockpt(master.fd), 0);
  const Descriptor terminal(::open(::ptsname(master.fd), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_GE(terminal.fd, 0);

  const auto pid =
      spawn({"/bin/true", {"true"}, {kDevNull, kDevNull, terminal.fd}, [](auto) { return false; }});

  ASSERT_FALSE(pid);
  EXPECT_THAT(pid.error().message, EndsWith("it would inherit a terminal"));
}

}  // namespace
}  // namespace ls
