// Code that the engines for Docker and Kubernetes share: names of workers, and logs of ended workers.
#pragma once

#include <string>

namespace ls::cli {

std::string new_worker_id();  // eight random hexadecimal digits

// Writes FOLDER/NAME.log. A log that cannot be written is lost: it keeps no worker from being removed.
void keep_log(const std::string& folder, const std::string& name, const std::string& text);

}  // namespace ls::cli
