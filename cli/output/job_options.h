// Adds and parses options of commands. JobOptions has the options that describe the requested job.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "core/job/settings.h"

namespace ls::cli {

// Adds an option whose value the help shows as `type`.
template <class T>
CLI::Option* add_option(CLI::App& app, const std::string& name, T& value, const std::string& type,
                        const std::string& help) {
  return app.add_option(name, value, help)->type_name(type);
}
// Adds --view of the commands that write an image or a video.
inline void add_view(CLI::App& app, std::string& view) {
  add_option(
      app, "--view", view, "VIEW",
      "show the colours of a PNG or video in a view of OpenColorIO, for example \"sRGB - Display/ACES 1.0 - "
      "SDR Video\"; default: sRGB");
}

// The options of a job's settings. Their names, help, ranges and the commands that have them are in
// core/job/describe.h.
class JobOptions {
 public:
  enum class Command { render, submit, again, merge };

  void add_to(CLI::App& app, Command command);
  // invalid_argument: the message has the option, the given text and the allowed values.
  Result<JobSpec> parse() const;
  // Returns the names of the settings that the user gave.
  std::set<std::string_view> given() const;

  bool strict = false;

 private:
  // The value of an option as it was given. Numbers are kept as text, so that messages about them name the
  // option.
  struct Given {
    std::string text;
    std::vector<std::string> list;  // of an option that may be given several times
    bool flag = false;
  };
  std::map<std::string_view, Given> given_;  // by the name of the setting
};

void add_defines(CLI::App& app, std::vector<std::string>& defines);  // adds -D NAME=VALUE

// The options of a job that change its scene: --techniques and --mix. An empty text changes nothing.
struct SceneChanges {
  std::string techniques, mix;
};
void add_scene_changes(CLI::App& app, SceneChanges& changes);
Result<void> change_scene(const SceneChanges& changes, Scene& scene);

// Parses a whole number, as in "--threads 4". `what` is the option's name, for the message.
Result<std::uint64_t> parse_whole(const std::string& what, const std::string& text, std::uint64_t least,
                                  std::uint64_t most);
// Parses the value of --frame, the number of a frame.
Result<std::uint32_t> parse_frame(const std::string& text);
Result<double> parse_positive(const std::string& what, const std::string& text, double most);
Result<FrameSize> parse_size(const std::string& text);             // parses, for example, "640x360"
Result<std::pair<int, int>> parse_pixel(const std::string& text);  // parses, for example, "12,34"
Result<std::map<std::string, std::string>> parse_defines(
    const std::vector<std::string>& defines);  // each is "NAME=VALUE"
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
