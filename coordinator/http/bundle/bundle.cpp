#include "coordinator/http/bundle/bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "coordinator/http/bundle/stage.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/http/message/limits.h"
#include "core/base/safe_text.h"
#include "core/base/text/utf8.h"
#include "core/job/limits.h"

namespace ls::http {
namespace {

using nlohmann::json;

constexpr std::string_view kBundleJobFile = "job.json";

struct BundleFile {
  std::string name;  // normalised by normal_name()
  Digest digest;
};

struct BundleContents {
  std::vector<BundleFile> files;  // in the archive's order
  // The text of every file that may be the bundle's job.json.
  std::map<std::string, std::string> job_files;
};

constexpr std::size_t kMostShown = 5;  // a message lists at most this many names

std::string shown(std::string_view name) {
  return fmt::format("\"{}\"", plain_text(name.substr(0, kMaxAssetName)));
}

// Make errors of the kind invalid_argument whose text begins with "the bundle: "; bad_entry() also names the
// entry.
tl::unexpected<Error> bad_bundle(std::string text) {
  return fail(Errc::invalid_argument, "the bundle: " + std::move(text));
}

tl::unexpected<Error> bad_entry(std::string_view name, std::string_view what) {
  return bad_bundle(fmt::format("{} {}", shown(name), what));
}

// True for files that file managers add to archives and that no scene uses. `name` is a normalised name.
bool is_litter(std::string_view name) { return name.starts_with("__MACOSX/") || name.starts_with('.'); }

tl::unexpected<Error> refused(const Error& error) {
  return error.code == Errc::invalid_argument ? bad_bundle(error.message) : tl::unexpected(error);
}

// Adds the name of the entry to an error about the archive.
tl::unexpected<Error> within(const Error& error, std::string_view name) {
  if (error.code != Errc::invalid_argument) return tl::unexpected(error);
  return bad_entry(name, error.message);
}

// The first of two passes over the archive. Reads, counts and hashes everything, and keeps only names,
// digests and the text of job.json.
class Survey {
 public:
  Survey(const BundleLimits& limits, std::uint64_t archive_bytes)
      : limits_(limits),
        most_(std::min(limits.total_bytes,
                       kBundleSlack + std::min(archive_bytes, limits.total_bytes) * kMaxBundleRatio)) {}

  Result<void> run(ArchiveReader& archive) {
    while (true) {
      const auto entry = archive.next();
      if (!entry) return refused(entry.error());
      if (!*entry) return {};
      if (auto ok = look_at(**entry, archive); !ok) return ok;
    }
  }

  BundleContents contents;

 private:
  Result<void> look_at(const ArchiveEntry& entry, ArchiveReader& archive) {
    const auto name = normal_name(entry.name);
    if (!name) return bad_entry(entry.name, name.error().message);
    if (auto ok = allowed(entry, *name); !ok) return ok;
    const bool folder = entry.kind == ArchiveEntry::Kind::folder;
    if (!folder && !names_.insert(*name).second) return bad_entry(entry.name, "is in it twice");
    if (++entries_ > kMaxBundleEntries)
      return bad_bundle(fmt::format("it has more than {} entries", kMaxBundleEntries));
    name_bytes_ += name->size();
    if (name_bytes_ > kMaxBundleNames)
      return bad_bundle(fmt::format("its names have more than {} bytes", kMaxBundleNames));
    if (entry.bytes)
      if (auto ok = room_for(entry.name, *entry.bytes, total_ + std::min(*entry.bytes, limits_.total_bytes));
          !ok)
        return ok;
    return read_bytes(entry, *name, folder, archive);
  }

  static Result<void> allowed(const ArchiveEntry& entry, const std::string& name) {
    using Kind = ArchiveEntry::Kind;
    if (entry.kind == Kind::link) return bad_entry(entry.name, "is a link: put the file itself in");
    if (entry.kind == Kind::other) return bad_entry(entry.name, "is neither a file nor a folder");
    if (entry.encrypted) return bad_entry(entry.name, "is encrypted: pack it without a password");
    if (entry.packed_oddly)
      return bad_entry(entry.name, "is packed by an unusual method: pack it with deflate, or unpacked");
    if (name.empty() && entry.kind == Kind::file) return bad_entry(entry.name, "is no name of a file");
    return {};
  }

  Result<void> room_for(std::string_view name, std::uint64_t bytes, std::uint64_t total) const {
    if (bytes > limits_.entry_bytes)
      return bad_entry(name,
                       fmt::format("has more than the {} bytes that one file may have", limits_.entry_bytes));
    if (total > limits_.total_bytes)
      return bad_entry(name, fmt::format("goes beyond the {} bytes that all files may have, unpacked",
                                         limits_.total_bytes));
    if (total > most_)
      return bad_entry(
          name,
          fmt::format("unpacks to implausibly much: the files of this archive may have {} bytes, {} times "
                      "its size and {}; upload the files as blobs instead",
                      most_, kMaxBundleRatio, kBundleSlack));
    return {};
  }

  Result<void> read_bytes(const ArchiveEntry& entry, const std::string& name, bool folder,
                          ArchiveReader& archive) {
    const bool keep = !folder && may_be_job_file(name);
    std::string text;
    Sha256 sha;
    std::uint64_t bytes = 0;
    while (true) {
      const auto n = archive.read(buffer_);
      if (!n) return within(n.error(), entry.name);
      if (*n == 0) break;
      if (folder) return bad_entry(entry.name, "is a folder with bytes of its own");
      bytes += *n;
      total_ += *n;
      if (auto ok = room_for(entry.name, bytes, total_); !ok) return ok;
      const auto part = std::span<const std::byte>(buffer_).first(*n);
      sha.update(part);
      // A job.json that is too long is an error only if it is used
      if (keep && text.size() <= kMaxSpecBytes)
        text.append(reinterpret_cast<const char*>(part.data()), part.size());
    }
    if (folder) return {};
    contents.files.push_back({name, sha.finish()});
    if (keep) contents.job_files.emplace(name, std::move(text));
    return {};
  }

  // True if this file may be the bundle's job.json, so that its text must be kept. The file must be named
  // job.json and lie at the top of the archive, or directly in a folder: if one folder contains all files
  // (except litter), that folder counts as the top. From folders at most the first two are kept: if two
  // folders have a job.json, no folder contains all files, and none of these files is used.
  bool may_be_job_file(const std::string& name) const {
    if (name == kBundleJobFile) return true;
    if (is_litter(name)) return false;
    const std::size_t slash = name.find('/');
    return slash != std::string::npos && name.substr(slash + 1) == kBundleJobFile &&
           contents.job_files.size() < 2;
  }

  const BundleLimits& limits_;
  const std::uint64_t most_;
  std::set<std::string> names_;
  std::size_t entries_ = 0, name_bytes_ = 0;
  std::uint64_t total_ = 0;
  std::vector<std::byte> buffer_ = std::vector<std::byte>(kBodyChunk);
};

// The second pass over the archive: stores those files that the blob store lacks.
Result<void> store(ArchiveReader& archive, const std::vector<BundleFile>& files,
                   coordinator::BlobStore& blobs) {
  std::vector<std::byte> buffer(kBodyChunk);
  std::size_t next = 0;
  while (true) {
    const auto entry = archive.next();
    if (!entry) return tl::unexpected(entry.error());
    if (!*entry) return {};
    const bool is_file = (*entry)->kind == ArchiveEntry::Kind::file;
    if (is_file && next == files.size()) return fail(Errc::internal, "a bundle changed while it was read");
    std::unique_ptr<coordinator::BlobStore::Upload> upload;
    if (is_file && !blobs.prove(files[next].digest)) {
      auto begun = blobs.begin_upload(files[next].digest);
      if (!begun) return tl::unexpected(begun.error());
      upload = std::move(*begun);
    }
    while (true) {
      const auto n = archive.read(buffer);
      if (!n) return within(n.error(), (*entry)->name);
      if (*n == 0) break;
      if (!upload) continue;
      if (auto done = upload->append(std::span<const std::byte>(buffer).first(*n)); !done) return done;
    }
    if (upload)
      if (auto done = upload->finish(); !done) return done;
    next += is_file;
  }
}

// Decides which file of a bundle is the scene, reads job.json, and makes the names of the other files
// relative to the scene.

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

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostShown); ++i)
    text += (i ? ", " : "") + shown(names[i]);
  return names.size() > kMostShown ? text + fmt::format(" and {} more", names.size() - kMostShown) : text;
}

bool is_xml(std::string_view name) {
  if (name.size() < 5) return false;
  std::string end(name.substr(name.size() - 4));
  std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return std::tolower(c); });
  return end == ".xml";
}

// Returns the names in the archive of the files at the top whose name has this ending.
std::vector<std::string> at_top(const std::vector<BundleFile>& files, const std::string& top,
                                bool (*has_ending)(std::string_view)) {
  std::vector<std::string> found;
  for (const BundleFile& file : files) {
    const std::string_view name =
        std::string_view(file.name).substr(file.name.starts_with(top) ? top.size() : 0);
    if (name.find('/') == std::string_view::npos && !is_litter(name) && has_ending(name))
      found.push_back(file.name);
  }
  return found;
}

// Returns the name in the archive of the scene: the only .xml file at the top, or else the only stage of USD.
Result<std::string> only_scene(const std::vector<BundleFile>& files, const std::string& top) {
  std::vector<std::string> found = at_top(files, top, is_xml);
  if (found.empty()) found = at_top(files, top, is_stage_name);
  if (found.size() == 1) return found.front();
  if (found.empty())
    return bad_bundle(
        "there is no .xml and no stage of USD at its top: put the scene there, or name it in a file "
        "job.json, "
        "{\"scene\": \"FILE\"}");
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
  auto parsed = parse_json(text, "job.json");
  if (!parsed) return bad_bundle(plain_text(parsed.error().message));
  json& job = *parsed;
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

}  // namespace

Result<std::string> normal_name(std::string_view name) {
  const auto wrong = [](std::string_view why) { return fail(Errc::invalid_argument, std::string(why)); };
  if (name.empty()) return wrong("is no name (or one in an unknown encoding: names are UTF-8)");
  if (name.size() > kMaxAssetName)
    return wrong(fmt::format("has a name of more than {} bytes", kMaxAssetName));
  if (find_invalid_utf8(name) != std::string_view::npos) return wrong("has a name that is not UTF-8");
  if (find_control(name) != std::string_view::npos || name.find_first_of("\t\r\n") != std::string_view::npos)
    return wrong("has control characters in its name");
  if (name.find('\\') != std::string_view::npos)
    return wrong("has a backslash in its name: folders are separated by /");
  const bool drive = name.size() > 1 && name[1] == ':' && std::isalpha(static_cast<unsigned char>(name[0]));
  if (name.front() == '/' || drive)
    return wrong("has an absolute name: names are relative to the bundle's top");
  std::string out;
  while (!name.empty()) {
    const std::size_t slash = std::min(name.find('/'), name.size());
    const std::string_view part = name.substr(0, slash);
    name.remove_prefix(std::min(slash + 1, name.size()));
    if (part == "..") return wrong("leads out of its folder by \"..\"");
    if (part.empty() || part == ".") continue;
    if (!out.empty()) out += '/';
    out += part;
  }
  return out;
}

Result<Bundle> read_bundle(int fd, std::uint64_t archive_bytes, ArchiveKind kind, const BundleLimits& limits,
                           coordinator::BlobStore& blobs, const std::stop_token& stop) {
  if (archive_bytes == 0) return bad_bundle("the archive is empty");
  auto first = ArchiveReader::open(fd, kind, stop);
  if (!first) return refused(first.error());
  Survey survey(limits, archive_bytes);
  if (auto done = survey.run(*first); !done) return tl::unexpected(done.error());
  auto bundle = sorted_out(survey.contents);
  if (!bundle) return bundle;
  auto second = ArchiveReader::open(fd, kind, stop);
  if (!second) return tl::unexpected(second.error());
  if (auto done = store(*second, survey.contents.files, blobs); !done) return tl::unexpected(done.error());
  return bundle;
}

}  // namespace ls::http
