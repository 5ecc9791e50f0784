// Properties of the machine that the worker runs on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace ls::worker {

std::string host_name();
int usable_cpus();  // number of CPUs on which this process may run
// Memory of the machine, or the limit of our control group if that is lower.
std::uint64_t usable_memory_bytes();
// Returns the cache's default folder, in XDG_CACHE_HOME or ~/.cache or else in the system's temporary folder.
std::filesystem::path default_cache();
void raise_file_limit();  // raises the limit of open files, because each blob in use is an open file

}  // namespace ls::worker
