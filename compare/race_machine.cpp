#include "compare/race_machine.h"

#include <fmt/format.h>
#include <sched.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>

#include "common/base/safe_text.h"

namespace ls::race {
namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  std::string line;
  while (std::getline(file, line))
    if (line.starts_with("model name"))
      if (const auto at = line.find(": "); at != std::string::npos) return plain_text(line.substr(at + 2));
  return "a processor that does not tell its name";
}

}  // namespace

Result<void> use_cores(int count) {
  cpu_set_t all, some;
  CPU_ZERO(&some);
  if (::sched_getaffinity(0, sizeof all, &all) != 0)
    return fail(Errc::internal, fmt::format("sched_getaffinity: {}", std::strerror(errno)));
  const int there = CPU_COUNT(&all);
  if (count > there)
    return fail(
        Errc::resource_exhausted,
        fmt::format("--threads {}: there are {} cores, and a race with more threads than cores is none",
                    count, there));
  for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&some) < count; ++cpu)
    if (CPU_ISSET(cpu, &all)) CPU_SET(cpu, &some);
  if (::sched_setaffinity(0, sizeof some, &some) != 0)
    return fail(Errc::internal, fmt::format("sched_setaffinity: {}", std::strerror(errno)));
  return {};
}

std::string machine_words(int cores) {
  return fmt::format("{}, {} of {} cores", processor(), cores, ::sysconf(_SC_NPROCESSORS_ONLN));
}

double load_average() {
  double load = 0;
  return ::getloadavg(&load, 1) == 1 ? load : -1;
}

// Reads the times since boot, summed over all cores. The first line of /proc/stat has them in clock ticks:
// "cpu user nice system idle iowait irq softirq steal ..." (proc(5)).
Others::Times Others::taken() {
  constexpr int kFields = 8, kIdle = 3, kWaiting = 4;
  std::ifstream file("/proc/stat");
  std::string name;
  file >> name;
  Times times;
  const auto tick = static_cast<double>(::sysconf(_SC_CLK_TCK));
  for (int i = 0; i < kFields; ++i) {
    double ticks = 0;
    file >> ticks;
    times.total += ticks / tick;
    if (i != kIdle && i != kWaiting) times.busy += ticks / tick;
  }
  if (!file || name != "cpu") return {};
  times.own = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;  // user and system time of this process
  return times;
}

double Others::share() const {
  const Times end = taken();
  const double total = end.total - start_.total;
  if (!(start_.total > 0) || !(total > 0)) return -1;
  return std::clamp((end.busy - start_.busy - (end.own - start_.own)) / total, 0., 1.);
}

}  // namespace ls::race
