// Properties of the machine that the worker runs on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace ls::worker {

std::string host_name();
int usable_cpus();                      // available to this process
std::uint64_t usable_memory_bytes();    // of the machine, or of our control group if less
std::filesystem::path default_cache();  // XDG_CACHE_HOME or ~/.cache, or else the system's temporary folder
void raise_file_limit();                // for one open file per blob in use

}  // namespace ls::worker
