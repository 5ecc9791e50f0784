#include "compare/adapter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/base/plain_text.h"

namespace ls::race {
namespace {

using nlohmann::json;

constexpr std::uintmax_t kMostBytes = 1 << 20;
constexpr std::size_t kMostArguments = 256;
constexpr double kDefaultExtraSeconds = 300, kMostExtraSeconds = 1e6;
constexpr double kMostSpp = 1e12;
// The difference that is accepted between the program's clock and ours, as a ratio and in seconds.
constexpr double kClockRatio = 1.02, kClockSeconds = .05;

const std::set<std::string> kKeys = {"name", "command", "first_spp", "most_seconds", "scenes", "about"};
const std::set<std::string> kPlaceholders = {"scene",  "image",   "folder", "times", "spp",
                                             "time",   "clock",   "seed",   "size",  "width",
                                             "height", "threads", "adapter"};

tl::unexpected<Error> wrong_key(const std::filesystem::path& file, const std::string& what) {
  return fail(Errc::invalid_argument, fmt::format("{}: {}", file.string(), what));
}

// Returns the names in braces; an error for text that looks like a placeholder but is unknown.
Result<std::set<std::string>> placeholders(const std::vector<std::string>& command,
                                           const std::filesystem::path& file) {
  std::set<std::string> found;
  for (const std::string& word : command)
    for (auto at = word.find('{'); at != std::string::npos; at = word.find('{', at + 1)) {
      const auto end = word.find('}', at);
      if (end == std::string::npos)
        return wrong_key(file,
                         fmt::format("'command' has '{}', a brace that is not closed", plain_text(word)));
      const std::string name = word.substr(at + 1, end - at - 1);
      if (!kPlaceholders.contains(name))
        return wrong_key(file, fmt::format("'command' has {{{}}}; there are {{{}}}", plain_text(name),
                                           fmt::join(kPlaceholders, "}, {")));
      found.insert(name);
    }
  return found;
}

Result<void> check_command(Adapter& adapter, const std::filesystem::path& file) {
  const auto used = placeholders(adapter.command, file);
  if (!used) return tl::unexpected(used.error());
  const auto has = [&](const char* name) { return used->contains(name); };
  if (!has("scene")) return wrong_key(file, "'command' needs {scene}, or every race is the same");
  if (has("spp") == has("time"))
    return wrong_key(
        file,
        "'command' needs either {spp} (one picture of so many samples) or {time} (pictures for so "
        "many seconds)");
  adapter.lists = has("time");
  if (adapter.lists && !has("folder"))
    return wrong_key(file, "'command' has {time} and so needs {folder}, where its pictures go");
  if (!adapter.lists && !has("image"))
    return wrong_key(file, "'command' has {spp} and so needs {image}, the EXR to write");
  return {};
}

bool texts(const json& j) {
  return j.is_array() && std::all_of(j.begin(), j.end(), [](const json& v) { return v.is_string(); });
}

std::optional<double> number(const json& j, const char* key, double most) {
  if (!j.contains(key) || !j[key].is_number()) return std::nullopt;
  const double value = j[key].get<double>();
  return std::isfinite(value) && value > 0 && value <= most ? std::optional(value) : std::nullopt;
}

Result<MadePicture> parse_made(const std::string& text, bool whole) {
  const json j = json::parse(text, nullptr, false);
  if (!j.is_object()) return fail(Errc::invalid_argument, "this is no JSON object");
  MadePicture made;
  const auto seconds = number(j, "seconds", kMostExtraSeconds);
  if (!seconds) return fail(Errc::invalid_argument, "'seconds' must be a number above 0");
  made.seconds = *seconds;
  if (j.contains("cpu_seconds")) {
    made.cpu_seconds = number(j, "cpu_seconds", kMostExtraSeconds);
    if (!made.cpu_seconds) return fail(Errc::invalid_argument, "'cpu_seconds' must be a number above 0");
  }
  if (!whole) return made;
  const auto spp = number(j, "spp", kMostSpp);
  if (!spp) return fail(Errc::invalid_argument, "'spp' must be a number above 0");
  made.spp = *spp;
  if (!j.contains("image") || !j["image"].is_string())
    return fail(Errc::invalid_argument, "'image' must be the name of a file");
  made.image = j["image"].get<std::string>();
  if (made.image.empty() || made.image != made.image.filename() || made.image == "." || made.image == "..")
    return fail(Errc::invalid_argument, "'image' must be the name of a file in {folder}, without a folder");
  return made;
}

}  // namespace

Result<Adapter> read_adapter(const std::filesystem::path& file) {
  std::error_code none;
  const auto bytes = std::filesystem::file_size(file, none);
  if (none) return wrong_key(file, "there is no such file");
  if (bytes > kMostBytes) return wrong_key(file, "this is no adapter: it has more than 1 MiB");
  std::ifstream in(file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return parse_adapter(text, file);
}

Result<Adapter> parse_adapter(const std::string& text, const std::filesystem::path& file) {
  const json j = json::parse(text, nullptr, false);
  if (!j.is_object()) return wrong_key(file, "an adapter is a JSON object");
  for (const auto& [key, value] : j.items())
    if (!kKeys.contains(key))
      return wrong_key(
          file, fmt::format("unknown key '{}'; there are {}", plain_text(key), fmt::join(kKeys, ", ")));
  Adapter adapter;
  std::error_code none;
  adapter.folder = std::filesystem::absolute(file, none).parent_path();
  if (!j.contains("name") || !j["name"].is_string() || j["name"].get<std::string>().empty())
    return wrong_key(file, "'name' must be what the program is called in tables");
  adapter.name = plain_text(j["name"].get<std::string>());
  if (!j.contains("command") || !texts(j["command"]) || j["command"].empty() ||
      j["command"].size() > kMostArguments)
    return wrong_key(file, "'command' must be an array of texts: the program and its arguments");
  adapter.command = j["command"].get<std::vector<std::string>>();
  if (auto ok = check_command(adapter, file); !ok) return tl::unexpected(ok.error());
  adapter.most_seconds = kDefaultExtraSeconds;
  if (j.contains("most_seconds")) {
    const auto most = number(j, "most_seconds", kMostExtraSeconds);
    if (!most) return wrong_key(file, "'most_seconds' must be a number of seconds above 0");
    adapter.most_seconds = *most;
  }
  if (j.contains("first_spp")) {
    const auto first = number(j, "first_spp", 65536);
    if (!first || *first != std::floor(*first))
      return wrong_key(file, "'first_spp' must be a whole number from 1 to 65536");
    adapter.first_spp = static_cast<std::uint64_t>(*first);
  }
  if (j.contains("scenes")) {
    if (!texts(j["scenes"])) return wrong_key(file, "'scenes' must be an array of names of scenes");
    for (const json& name : j["scenes"]) adapter.scenes.insert(name.get<std::string>());
  }
  return adapter;
}

std::vector<std::string> filled(const Adapter& adapter, const std::map<std::string, std::string>& values) {
  std::vector<std::string> out;
  for (const std::string& word : adapter.command) {
    std::string text;
    std::size_t from = 0;
    for (auto at = word.find('{'); at != std::string::npos; at = word.find('{', from)) {
      const auto end = word.find('}', at);
      text += word.substr(from, at - from) + values.at(word.substr(at + 1, end - at - 1));
      from = end + 1;
    }
    out.push_back(text + word.substr(from));
  }
  return out;
}

Result<std::vector<MadePicture>> parse_pictures(const std::string& lines) {
  std::vector<MadePicture> out;
  std::size_t from = 0, line = 0;
  while (from < lines.size()) {
    const auto end = std::min(lines.find('\n', from), lines.size());
    const std::string text = lines.substr(from, end - from);
    from = end + 1;
    ++line;
    if (text.find_first_not_of(" \t\r") == std::string::npos) continue;
    auto made = parse_made(text, true);
    if (!made) return fail(Errc::invalid_argument, fmt::format("line {}: {}", line, made.error().message));
    if (!out.empty() && made->spp <= out.back().spp)
      return fail(Errc::invalid_argument, fmt::format("line {}: 'spp' must rise from line to line", line));
    if (out.size() == kMostPictures)
      return fail(Errc::invalid_argument, fmt::format("there are more than {} lines", kMostPictures));
    out.push_back(std::move(*made));
  }
  if (out.empty()) return fail(Errc::invalid_argument, "it names no picture");
  return out;
}

Result<MadePicture> parse_times(const std::string& json) { return parse_made(json, false); }

Result<Cost> plausible_cost(const MadePicture& claim, const Cost& process, RaceClock clock) {
  const auto too_much = [](double claimed, double measured) {
    return claimed > measured * kClockRatio + kClockSeconds;
  };
  if (too_much(claim.seconds, process.wall))
    return fail(Errc::invalid_argument,
                fmt::format("it says that a picture took {:g} s, and the whole program ran for {:g} s",
                            claim.seconds, process.wall));
  if (!claim.cpu_seconds && clock == RaceClock::cpu)
    return fail(Errc::invalid_argument, "it says no 'cpu_seconds', which a race by --clock cpu is about");
  const double cpu = claim.cpu_seconds.value_or(0);
  if (too_much(cpu, process.cpu))
    return fail(Errc::invalid_argument,
                fmt::format("it says that a picture took {:g} CPU seconds, and the whole program had {:g}",
                            cpu, process.cpu));
  return Cost{claim.seconds, cpu};
}

}  // namespace ls::race
