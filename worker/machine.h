// Properties of the machine that the worker runs on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace ls::worker {

std::string host_name();
int usable_cpus();  // number of CPUs on which this process may run
// Returns the default folder of the cache: in $XDG_CACHE_HOME if that is set, else in ~/.cache, else in the
// system's temporary folder.
std::filesystem::path default_cache();
// The limit of open files that a worker requests from the system. It is large because each blob in use is an
// open file.
inline constexpr std::uint64_t kWantedFiles = 65536;
void raise_file_limit();  // raises the limit of open files to kWantedFiles, or as far as this user is allowed

}  // namespace ls::worker
