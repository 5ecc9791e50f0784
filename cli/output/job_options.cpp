#include "cli/output/job_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>
#include <type_traits>

#include "core/base/parse_number.h"
#include "core/job/describe.h"
#include "core/job/spec_draft.h"
#include "core/scene/analysis/light_groups.h"

namespace ls::cli {
namespace {

using job::Form;
using job::Setting;

constexpr std::string_view kDefineOption = "-D,--define", kDefinePlaceholder = "NAME=VALUE";

// Returns the text of a value as option `what`, or the error that says what is wrong with it.
template <class T>
Result<T> parse_as(const Setting& setting, std::string_view text, T value = {}) {
  if (const std::string problem = job::read(setting, Form::option, text, value); !problem.empty())
    return bad_argument(fmt::format("{} {}", setting.option, problem));
  return value;
}

bool has(JobOptions::Command command, const Setting& s) {
  if (s.option.empty()) return false;
  switch (command) {
    case JobOptions::Command::submit:
      return true;
    case JobOptions::Command::render:
      return s.render;
    case JobOptions::Command::again:
      return s.again;
    case JobOptions::Command::merge:
      return s.merge;
  }
  return false;
}

// Returns the sentence about the setting as help texts are written: without a capital and a full stop.
std::string help_of(const Setting& s) {
  std::string help(s.doc.substr(0, s.doc.size() - 1));
  help[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(help[0])));
  return s.choices ? fmt::format("{}: {}", help, s.choices()) : help;
}

// Returns the value that a new job has without the option; empty: none, or the one of an earlier job.
template <class T>
std::string default_of(JobOptions::Command command, const Setting& s, const T& value) {
  if constexpr (job::kIsWhole<T>) return fmt::to_string(value);
  return command == JobOptions::Command::again ? "" : std::string(s.absent);
}

}  // namespace

Result<std::uint64_t> parse_whole(const std::string& what, const std::string& text, std::uint64_t least,
                                  std::uint64_t most) {
  return parse_as<std::uint64_t>({.range = {static_cast<std::int64_t>(least), most}, .option = what}, text);
}

Result<std::uint32_t> parse_frame(const std::string& text) {
  return parse_as<std::uint32_t>({.range = {0, kMaxFrameNumber}, .option = "--frame"}, text);
}

Result<double> parse_positive(const std::string& what, const std::string& text, double most) {
  return parse_as<double>({.range = {0, static_cast<std::uint64_t>(most)}, .option = what}, text);
}

Result<FrameSize> parse_size(const std::string& text) {
  return parse_as<FrameSize>({.option = "--size"}, text);
}

Result<std::pair<int, int>> parse_pixel(const std::string& text) {
  const std::size_t comma = std::min(text.find(','), text.size());
  const auto x = parse_number<int>(std::string_view(text).substr(0, comma)),
             y = parse_number<int>(std::string_view(text).substr(std::min(comma + 1, text.size())));
  if (!x || !y || *x < 0 || *y < 0)
    return bad_argument(fmt::format("--pixel '{}': write it as X,Y, counted from 0 at the top left", text));
  return std::pair(*x, *y);
}

Result<std::map<std::string, std::string>> parse_defines(const std::vector<std::string>& defines) {
  std::map<std::string, std::string> values;
  for (const std::string& define : defines) {
    auto with_this = parse_as(Setting{.option = kDefineOption}, define, std::move(values));
    if (!with_this) return with_this;
    values = std::move(*with_this);
  }
  return values;
}

void add_defines(CLI::App& app, std::vector<std::string>& defines) {
  add_option(app, std::string(kDefineOption), defines, std::string(kDefinePlaceholder),
             "sets the scene's $NAME")
      ->allow_extra_args(false);
}

void add_scene_changes(CLI::App& app, SceneChanges& changes) {
  add_option(app, "--techniques", changes.techniques, "-NAME,+NAME", "as given to the job");
  add_option(app, "--mix", changes.mix, "GROUP=FACTOR,...", "as given to the job");
}

Result<void> change_scene(const SceneChanges& changes, Scene& scene) {
  std::optional<TechniqueChoice> choice;
  std::optional<LightMix> mix;
  const auto parse = [](const std::string& text) -> Result<TechniqueChoice> {
    if (const auto parsed = parse_technique_choice(text)) return *parsed;
    return bad_argument("--techniques " +
                        job::must_be(job::allowed<TechniqueChoice>({}, job::Form::option), text));
  };
  if (auto ok = take(changes.techniques, choice, parse); !ok) return ok;
  const auto parse_mix = [](const std::string& text) -> Result<LightMix> {
    auto parsed = parse_light_mix(text);
    if (!parsed) parsed.error().message = "--mix: " + parsed.error().message;
    return parsed;
  };
  if (auto ok = take(changes.mix, mix, parse_mix); !ok) return ok;
  if (choice) scene.integrator = with_choice(scene.integrator, *choice);
  return mix ? scene::multiply_light(*mix, scene) : Result<void>();
}

void JobOptions::add_to(CLI::App& app, Command command) {
  const JobSpec any;
  job::for_each_setting(any, [&]<class T>(const Setting& s, const T& value) {
    if (!has(command, s)) return;
    Given& given = given_[s.name];
    const std::string option(s.option), placeholder(s.placeholder),
        help = help_of(command == Command::again ? job::described_for_again(s) : s);
    if constexpr (std::is_same_v<T, bool>)
      app.add_flag(option, given.flag, help);
    else if constexpr (std::is_same_v<T, job::Names>)
      add_option(app, option, given.list, placeholder, help)->delimiter(',')->allow_extra_args(false);
    else if constexpr (std::is_same_v<T, job::Defines>)
      add_option(app, option, given.list, placeholder, help)->allow_extra_args(false);
    else
      add_option(app, option, given.text, placeholder, help)->default_str(default_of(command, s, value));
  });
  if (command == Command::render || command == Command::submit)
    app.add_flag("--strict", strict, "warnings of the scene are errors");
}

std::set<std::string_view> JobOptions::given() const {
  std::set<std::string_view> names;
  for (const auto& [name, given] : given_)
    if (given.flag || !given.text.empty() || !given.list.empty()) names.insert(name);
  return names;
}

Result<JobSpec> JobOptions::parse() const {
  job::SpecDraft draft(Form::option);
  for (const std::string_view name : given()) {
    const Given& given = given_.at(name);
    // Only definitions are added one by one: their values may contain commas.
    std::vector<std::string> texts = given.list;
    if (name != "defines") texts = {fmt::format("{}", fmt::join(given.list, ","))};
    if (given.flag) texts = {"true"};
    if (!given.text.empty()) texts = {given.text};
    for (const std::string& text : texts)
      if (const auto known = draft.add(name, text); !known) return tl::unexpected(known.error());
  }
  auto spec = draft.finish();
  if (spec)
    if (auto ok = job::check_spec(*spec, Form::option); !ok) return tl::unexpected(ok.error());
  return spec;
}

}  // namespace ls::cli
