// The report of a local render: the coordinator's report, with additions that only this process can measure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/error.h"

namespace ls::cli {

struct LocalFacts {
  double load_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
  int threads = 1;
  bool interrupted = false;
  // Instructions of the whole process; an error: why they were not counted
  Result<std::uint64_t> instructions = 0;
};
Result<std::string> local_report(const std::string& report, const LocalFacts& facts);

// Returns one line with the main results of the report.
std::string report_summary(const std::string& report);
// Prints numeric health problems to stderr; usually nothing.
void print_report_health(const std::string& report);
// Returns the digest of the pixels; empty: the report has none
std::string pixels_digest(const std::string& report);

std::uint64_t peak_rss_bytes();  // the larger peak: of this process, or of any ended child process

}  // namespace ls::cli
