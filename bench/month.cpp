// Thirty days of a farm in simulated time (tests/unit/domain/month.h), with the real state machine: every
// hour looks at the sizes of all that it keeps, every day says them. Ends with 1 when an invariant does not
// hold or something has grown: when the largest size of the last ten days is above that of the first ten by a
// quarter and 32.
//   month [--days N] [--seed S]
#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <string>

#include "tests/unit/domain/month.h"

namespace {

std::uint64_t resident_kib() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t whole = 0, resident = 0;
  in >> whole >> resident;
  return resident * 4;
}

using Sizes = std::vector<std::pair<std::string, std::size_t>>;

std::size_t allocated_kib() { return mallinfo2().uordblks >> 10; }  // of simulation and coordinators together

void raise(std::map<std::string, std::size_t>& most, const Sizes& sizes) {
  for (const auto& [what, size] : sizes) most[what] = std::max(most[what], size);
}

void print(int day, const ls::coordinator::Month::Counts& c, const std::map<std::string, std::size_t>& most) {
  fmt::print("| {} | {} | {} | {} | {} | {} | {} + {} | {} | {} |", day, c.events, c.ended, c.units,
             c.workers, c.failures, c.restarts, c.takeovers, c.audits, c.quarantined);
  for (const char* what :
       {"jobs", "units", "leases", "workers", "of workers", "names", "shares", "allocated KiB"})
    fmt::print(" {} |", most.at(what));
  fmt::print(" {} |\n", resident_kib());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  int days = 30;
  std::uint64_t seed = 1;
  CLI::App app("Thirty days of a farm in simulated time.");
  app.add_option("--days", days)->check(CLI::Range(3, 3650));
  app.add_option("--seed", seed);
  CLI11_PARSE(app, argc, argv);
  ls::coordinator::Month month(seed);
  std::map<std::string, std::size_t> early, late;
  fmt::print(
      "| day | events | jobs ended | units | workers so far | crashes | restarts + jobs taken over | results "
      "rendered "
      "again | quarantined | jobs | units kept | leases | workers | of workers | names | shares | allocated "
      "KiB | "
      "resident "
      "KiB |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (int day = 1; day <= days; ++day) {
    std::map<std::string, std::size_t> most;
    for (int hour = 0; hour < 24; ++hour) {
      if (const std::string wrong = month.hour(); !wrong.empty()) return fmt::print("wrong: {}\n", wrong), 1;
      raise(most, month.sizes());
      raise(most, {{"allocated KiB", allocated_kib()}});
    }
    const Sizes sizes(most.begin(), most.end());
    if (day <= days / 3) raise(early, sizes);
    if (day > days - days / 3) raise(late, sizes);
    if (day == 1 || day % 3 == 0) print(day, month.counts(), most);
  }
  bool grown = false;
  for (const auto& [what, size] : late) {
    if (what == "quarantined" || size <= early[what] * 5 / 4 + 32) continue;
    grown = true;
    fmt::print("grown: {}: {} at most at first, {} in the end\n", what, early[what], size);
  }
  return grown ? 1 : 0;
}
