// Options shared by `render` and `submit`: the request for a job.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/job/settings.h"

namespace ls::cli {

// Numbers are kept as text until parse(), so that it can compose the error messages.
struct JobOptions {
  std::string spp, target_error, time, seed, size, integrator, priority, frames;
  std::string max_workers, max_units, memory;
  std::vector<std::string> aov, defines, tags;
  bool float_output = false;
  bool denoise = false;
  bool strict = false;

  void add_to(CLI::App& app);
  // invalid_argument: names the option, the given text and what is allowed.
  Result<JobSpec> parse() const;
};

// Parses a whole number such as in "--spp 64". `what` is the option's name, for the message.
Result<std::uint64_t> parse_whole(const std::string& what, const std::string& text, std::uint64_t least,
                                  std::uint64_t most);
Result<std::uint64_t> parse_bytes(const std::string& what, const std::string& text);  // "8G": powers of 1024
Result<double> parse_positive(const std::string& what, const std::string& text, double most);
Result<FrameSize> parse_size(const std::string& text);             // "640x360"
Result<std::pair<int, int>> parse_pixel(const std::string& text);  // "12,34"
Result<std::map<std::string, std::string>> parse_defines(
    const std::vector<std::string>& defines);  // "name=value"

}  // namespace ls::cli
