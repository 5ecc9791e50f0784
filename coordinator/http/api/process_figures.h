// Resources used by this process, according to Linux.
#pragma once

#include <cstdint>

namespace ls::http {

struct ProcessFigures {  // a value that could not be read is 0
  std::uint64_t resident_bytes = 0;
  std::uint64_t open_files = 0;
  std::uint64_t threads = 0;
  double cpu_seconds = 0;
};
ProcessFigures process_figures();

}  // namespace ls::http
