#include "core/base/failpoint.h"

#include <signal.h>

#include <atomic>
#include <charconv>
#include <cstdlib>
#include <string>

namespace ls {
namespace {

struct Target {
  std::string name;
  std::atomic<long> left{1};

  Target() {
    const char* text = std::getenv("LIGHTSHAFT_KILL_AT");
    if (!text) return;
    name = text;
    const auto colon = name.find(':');
    if (colon == std::string::npos) return;
    long count = 1;
    std::from_chars(name.data() + colon + 1, name.data() + name.size(), count);
    left = count;
    name.resize(colon);
  }
};

}  // namespace

void failpoint(std::string_view name) {
  static Target target;
  if (target.name.empty() || target.name != name || --target.left != 0) return;
  ::raise(SIGKILL);
}

}  // namespace ls
