// Decides which file of a bundle is the scene, reads job.json, and makes the names of the other files
// relative to the scene.
#include "coordinator/http/bundle/bundle_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/safe_text.h"
#include "common/job/limits.h"
#include "coordinator/http/message/limits.h"

namespace ls::http {
namespace {

using nlohmann::json;

constexpr std::size_t kMostShown = 5;  // a message lists at most this many names

std::string shown(std::string_view name) {
  return fmt::format("\"{}\"", plain_text(name.substr(0, kMaxAssetName)));
}

// Returns "FOLDER/" if all files lie in one folder FOLDER, else "".
std::string top_of(const std::vector<BundleFile>& files) {
  std::string top;
  for (const BundleFile& file : files) {
    if (is_litter(file.name)) continue;
    const std::size_t slash = file.name.find('/');
    if (slash == std::string::npos) return "";
    if (top.empty()) top = file.name.substr(0, slash + 1);
    if (!file.name.starts_with(top)) return "";
  }
  return top;
}

bool is_xml(std::string_view name) {
  if (name.size() < 5) return false;
  std::string end(name.substr(name.size() - 4));
  std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return std::tolower(c); });
  return end == ".xml";
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostShown); ++i)
    text += (i ? ", " : "") + shown(names[i]);
  return names.size() > kMostShown ? text + fmt::format(" and {} more", names.size() - kMostShown) : text;
}

// Returns the name in the archive of the only .xml file at the top, which is the scene.
Result<std::string> only_scene(const std::vector<BundleFile>& files, const std::string& top) {
  std::vector<std::string> found;
  for (const BundleFile& file : files) {
    const std::string_view name =
        std::string_view(file.name).substr(file.name.starts_with(top) ? top.size() : 0);
    if (name.find('/') == std::string_view::npos && !is_litter(name) && is_xml(name))
      found.push_back(file.name);
  }
  if (found.size() == 1) return found.front();
  if (found.empty())
    return bad_bundle(
        "there is no .xml at its top: put the scene there, or name it in a file job.json, {\"scene\": "
        "\"FILE\"}");
  return bad_bundle(fmt::format(
      "which of {} is the scene? Name it in a file job.json, {{\"scene\": \"FILE\"}}", listed(found)));
}

struct JobFile {
  std::optional<std::string> scene;
  std::string spec = "{}";
};

Result<JobFile> read_job_file(const std::string& text) {
  if (text.size() > kMaxSpecBytes)
    return bad_bundle(fmt::format("job.json has more than {} bytes", kMaxSpecBytes));
  JobFile out;
  json job;
  bool too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t, const json&) {
    return !(too_deep |= depth > kMaxJsonDepth);
  };
  try {
    job = json::parse(text, watch);
  } catch (const json::exception& e) {
    return bad_bundle(fmt::format("job.json is not JSON: {}", plain_text(e.what())));
  }
  if (too_deep) return bad_bundle(fmt::format("job.json is nested deeper than {} levels", kMaxJsonDepth));
  if (!job.is_object())
    return bad_bundle("job.json must be an object: {\"scene\": \"FILE\", and the spec's keys}");
  if (const auto scene = job.find("scene"); scene != job.end()) {
    if (!scene->is_string()) return bad_bundle("'scene' in job.json must be the name of a file");
    out.scene = scene->get<std::string>();
    job.erase(scene);
  }
  // The keys of the spec are at the same level as "scene" or, as in a JSON request, in an object "spec".
  if (const auto spec = job.find("spec"); spec != job.end()) {
    if (!spec->is_object() || job.size() != 1)
      return bad_bundle("'spec' in job.json must be an object, and the only key besides 'scene'");
    job = json(*spec);
  }
  out.spec = job.dump(-1, ' ', false, json::error_handler_t::replace);
  return out;
}

// Returns the path of the file `name` relative to `folder` ("" or "a/b/"), the form in which a scene in that
// folder names the file.
std::string seen_from(std::string_view folder, std::string_view name) {
  std::size_t common = 0;
  for (std::size_t i = 0; i < std::min(folder.size(), name.size()) && folder[i] == name[i]; ++i)
    if (folder[i] == '/') common = i + 1;
  std::string out;
  for (const char c : folder.substr(common))
    if (c == '/') out += "../";
  return out.append(name.substr(common));
}

}  // namespace

Result<Bundle> sorted_out(const BundleContents& contents) {
  const std::string top = top_of(contents.files);
  const auto job_text = contents.job_files.find(top + std::string(kBundleJobFile));
  JobFile job;
  if (job_text != contents.job_files.end()) {
    auto read = read_job_file(job_text->second);
    if (!read) return tl::unexpected(read.error());
    job = std::move(*read);
  }
  Bundle bundle;
  bundle.spec = std::move(job.spec);
  if (job.scene) {
    const auto name = normal_name(*job.scene);
    if (!name)
      return bad_bundle(fmt::format("'scene' in job.json, {}, {}", shown(*job.scene), name.error().message));
    bundle.scene = top + *name;
  } else {
    auto name = only_scene(contents.files, top);
    if (!name) return tl::unexpected(name.error());
    bundle.scene = std::move(*name);
  }
  const std::size_t slash = bundle.scene.rfind('/');
  const std::string folder = bundle.scene.substr(0, slash == std::string::npos ? 0 : slash + 1);
  bool found = false;
  for (const BundleFile& file : contents.files) {
    const bool is_scene = file.name == bundle.scene;
    found |= is_scene;
    if (is_scene) bundle.scene_digest = file.digest;
    if (!is_scene) bundle.assets.emplace(seen_from(folder, file.name), file.digest);
  }
  if (!found) return bad_entry(job.scene.value_or(""), "is named by job.json as the scene, but is not in it");
  return bundle;
}

bool is_litter(std::string_view name) { return name.starts_with("__MACOSX/") || name.starts_with('.'); }

tl::unexpected<Error> bad_bundle(std::string text) {
  return fail(Errc::invalid_argument, "the bundle: " + std::move(text));
}

tl::unexpected<Error> bad_entry(std::string_view name, std::string_view what) {
  return bad_bundle(fmt::format("{} {}", shown(name), what));
}

}  // namespace ls::http
