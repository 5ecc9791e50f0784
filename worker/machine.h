// What a worker finds out about the machine that it runs on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace ls::worker {

std::string host_name();
int usable_cpus();                      // that this process may run on
std::uint64_t usable_memory_bytes();    // of the machine, or of our control group if that is less
std::filesystem::path default_cache();  // XDG_CACHE_HOME or ~/.cache, or the system's temporary folder
void raise_file_limit();                // an open file for each blob in use

}  // namespace ls::worker
