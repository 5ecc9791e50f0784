// Code that the engines for Docker and Kubernetes share: names of workers, and logs of ended workers.
#pragma once

#include <string>

namespace ls::cli {

std::string new_worker_id();  // eight random hexadecimal digits

// Writes FOLDER/NAME.log. If that fails, the log is lost: a worker is removed all the same.
void keep_log(const std::string& folder, const std::string& name, const std::string& text);

}  // namespace ls::cli
