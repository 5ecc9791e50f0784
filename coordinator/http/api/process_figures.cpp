#include "coordinator/http/api/process_figures.h"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace ls::http {
namespace {

std::uint64_t status_figure(const std::string& name) {
  std::ifstream in("/proc/self/status");
  std::string word;
  std::uint64_t value = 0;
  while (in >> word)
    if (word == name) return in >> value ? value : 0;
  return 0;
}

std::uint64_t files_in(const char* folder) {
  std::error_code failed;
  std::uint64_t count = 0;
  for (std::filesystem::directory_iterator at(folder, failed), end; !failed && at != end;
       at.increment(failed))
    ++count;
  return failed || count == 0 ? 0 : count - 1;  // without the descriptor that this iteration opens
}

}  // namespace

ProcessFigures process_figures() {
  ProcessFigures p;
  p.resident_bytes = status_figure("VmRSS:") * 1024;
  p.threads = status_figure("Threads:");
  p.open_files = files_in("/proc/self/fd");
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0)
    for (const timeval& part : {usage.ru_utime, usage.ru_stime})
      p.cpu_seconds += static_cast<double>(part.tv_sec) + 1e-6 * static_cast<double>(part.tv_usec);
  return p;
}

}  // namespace ls::http
