// Adds and parses options of commands. JobOptions has the options that `render` and `submit` share: they
// describe the requested job.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/job/settings.h"

namespace ls::cli {

// Adds an option whose value the help shows as `type`.
template <class T>
CLI::Option* add_option(CLI::App& app, const std::string& name, T& value, const std::string& type,
                        const std::string& help) {
  return app.add_option(name, value, help)->type_name(type);
}

// Values of the options. Numbers are kept as text here; parse() converts them, and its error messages name
// the option.
struct JobOptions {
  std::string spp, target_error, target_layer, time, seed, size, integrator, priority, frames;
  std::string max_workers, max_units, memory, numeric_class;
  std::vector<std::string> aov, defines, tags, after;
  bool float_output = false;
  bool denoise = false;
  bool strict = false;

  void add_to(CLI::App& app);
  // invalid_argument: the message has the option, the given text and the allowed values.
  Result<JobSpec> parse() const;
};

void add_defines(CLI::App& app, std::vector<std::string>& defines);  // adds -D name=value

// Parses a whole number, as in "--spp 64". `what` is the option's name, for the message.
Result<std::uint64_t> parse_whole(const std::string& what, const std::string& text, std::uint64_t least,
                                  std::uint64_t most);
// Parses the value of --frame, the number of a frame.
Result<std::uint32_t> parse_frame(const std::string& text);
// Parses a number of bytes, such as "8G"; the units are powers of 1024.
Result<std::uint64_t> parse_bytes(const std::string& what, const std::string& text);
Result<double> parse_positive(const std::string& what, const std::string& text, double most);
Result<FrameSize> parse_size(const std::string& text);             // parses, for example, "640x360"
Result<std::pair<int, int>> parse_pixel(const std::string& text);  // parses, for example, "12,34"
Result<std::map<std::string, std::string>> parse_defines(
    const std::vector<std::string>& defines);  // each is "name=value"

// Parses the value of an option into `field` if the option was given, that is, if `text` is not empty.
template <class T, class Parse>
Result<void> take(const std::string& text, T& field, const Parse& parse) {
  if (text.empty()) return {};
  auto value = parse(text);
  if (!value) return tl::unexpected(value.error());
  field = std::move(*value);
  return {};
}
// whole() and positive() return a function for the parameter `parse` of take(), which calls parse_whole() or
// parse_positive().
inline auto whole(const char* what, std::uint64_t least, std::uint64_t most) {
  return [=](const std::string& text) { return parse_whole(what, text, least, most); };
}
inline auto positive(const char* what, double most) {
  return [=](const std::string& text) { return parse_positive(what, text, most); };
}

}  // namespace ls::cli
