#include "tests/property/watch.h"

#include <fmt/format.h>
#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>

#include "formats/reader/xml_write.h"
#include "tests/property/random_scene.h"

namespace ls::test {
namespace {

constexpr int kPatienceSeconds = 60;  // of processor time, for one scene
const char* volatile current = nullptr;
volatile std::size_t current_size = 0;

extern "C" void tell(int signal) {
  const char* text = current;
  for (std::size_t done = 0, n = current_size; text && done < n;) {
    const ssize_t step = ::write(2, text + done, n - done);
    if (step <= 0) break;
    done += static_cast<std::size_t>(step);
  }
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

void install() {
  static const bool once = [] {
    for (const int s : {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS, SIGVTALRM}) ::signal(s, tell);
    return true;
  }();
  static_cast<void>(once);
}

void set_timer(int seconds) {
  itimerval timer{};
  timer.it_value.tv_sec = seconds;
  ::setitimer(ITIMER_VIRTUAL, &timer, nullptr);
}

std::uint64_t from_environment(const char* name, std::uint64_t usual) {
  const char* text = std::getenv(name);
  return text ? std::strtoull(text, nullptr, 10) : usual;
}

}  // namespace

SceneRange scenes_to_try(std::uint64_t usual) {
  return {from_environment("LIGHTSHAFT_FIRST_SCENE", 0), from_environment("LIGHTSHAFT_SCENES", usual)};
}

Watch::Watch(std::string text) : text_(std::move(text)) {
  install();
  current_size = text_.size();
  current = text_.data();
  set_timer(kPatienceSeconds);
}

Watch::~Watch() {
  set_timer(0);
  current = nullptr;
}

std::string told(const RandomScene& s) {
  return fmt::format("\nscene {} (wild {}, calm {}):\n{}\n", s.seed, s.choice.wild, s.choice.calm,
                     write_xml(s.scene));
}

}  // namespace ls::test
