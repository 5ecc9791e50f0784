// The report of a local render: the coordinator's, with what only this process knows.
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
  Result<std::uint64_t> instructions = 0;  // of the whole process; an error: why they were not counted
};
Result<std::string> local_report(const std::string& report, const LocalFacts& facts);

// What a person wants to know at the end, one line.
std::string report_summary(const std::string& report);
// What is wrong with its numbers, to stderr; nothing, as a rule.
void say_report_health(const std::string& report);
std::string pixels_digest(const std::string& report);  // empty if there is none

std::uint64_t peak_rss_bytes();  // of this process and its ended children, the larger

}  // namespace ls::cli
