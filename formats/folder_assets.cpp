#include "formats/folder_assets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/file_form.h"
#include "core/base/text/name_forms.h"
#include "core/base/text/suggest.h"
#include "core/scene/limits.h"

namespace ls {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNamesLookedAt = 4096;  // maximum number of file names compared for a suggestion

// Returns a text such as "; did you mean 'cloud.vol'?", for an error about a missing file. The suggestion is
// a file with a similar name in the same folder.
std::string names_like(const fs::path& missing) {
  std::vector<std::string> names;
  std::error_code error;
  const fs::path folder = missing.has_parent_path() ? missing.parent_path() : fs::path(".");
  fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && it != fs::directory_iterator() && names.size() < kMaxNamesLookedAt; it.increment(error))
    names.push_back(it->path().filename().string());
  if (names.empty())
    return fs::is_directory(folder, error) ? "; its folder is empty" : "; its folder does not exist";
  const auto near = nearest_name(missing.filename().string(), names);
  return near ? fmt::format("; did you mean '{}'?", *near) : "";
}

// The first bytes of a file, and its last one.
struct FileEnds {
  std::string head, tail;
};
FileEnds ends_of(const fs::path& path, std::uintmax_t bytes) {
  FileEnds ends;
  ends.head.resize(std::min<std::uintmax_t>(bytes, kFormBytes));
  std::ifstream in(path, std::ios::binary);
  in.read(ends.head.data(), static_cast<std::streamsize>(ends.head.size()));
  ends.tail.resize(ends.head.size());
  in.seekg(static_cast<std::streamoff>(bytes - ends.tail.size()));
  in.read(ends.tail.data(), static_cast<std::streamsize>(ends.tail.size()));
  return ends;
}

}  // namespace

Result<std::shared_ptr<const KeptFolder>> KeptFolder::make() {
  std::error_code error;
  std::string path = (fs::temp_directory_path(error) / "lightshaft-scene-XXXXXX").string();
  if (error || !::mkdtemp(path.data()))
    return fail(
        Errc::unavailable,
        fmt::format("no temporary folder can be made in {}, for the meshes and grids in the scene's text",
                    fs::path(path).parent_path().string()));
  return std::shared_ptr<const KeptFolder>(new KeptFolder(path));
}

KeptFolder::~KeptFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Result<Asset> FolderAssets::keep(std::string_view name, const std::string& bytes) {
  if (!kept_) {
    auto made = KeptFolder::make();
    if (!made) return tl::unexpected<Error>(made.error());
    kept_ = std::move(*made);
  }
  const fs::path path = kept_->path() / fs::path(name).filename();
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!out.flush()) return fail(Errc::unavailable, fmt::format("{} can't be written", path.string()));
  const Asset asset{std::string(name), sha256(bytes), bytes.size()};
  found_.insert_or_assign(asset.name, asset);
  paths_.insert_or_assign(asset.name, path);
  by_digest_.insert_or_assign(asset.digest, path);
  return asset;
}

Result<fs::path> FolderAssets::locate(std::string_view name) const {
  if (name.empty() || name.find('\0') != std::string_view::npos)
    return fail(Errc::invalid_argument, "this is not the name of a file");
  fs::path path = folder_ / fs::path(name);  // an absolute name is used unchanged
  std::error_code error;
  fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    if (fs::is_symlink(fs::symlink_status(path, error)))
      return fail(Errc::not_found, fmt::format("\"{}\" is a link to \"{}\", where there is no file", name,
                                               fs::read_symlink(path, error).string()));
    const auto other = written_otherwise(folder_, name);
    if (!other) return missing(name);
    path = *other;
    status = fs::status(path, error);
  }
  if (error)
    return fail(Errc::invalid_argument, fmt::format("\"{}\" can't be opened: {}", name, error.message()));
  if (!fs::is_regular_file(status))
    return fail(Errc::invalid_argument, fmt::format("\"{}\" is not a regular file", name));
  return path;
}

tl::unexpected<Error> FolderAssets::missing(std::string_view name) const {
  const std::string plain = with_slashes(name);
  const char* hint = plain == name ? "" : "; write / between folders, not \\";
  return fail(Errc::not_found,
              fmt::format("there is no file \"{}\"{}{}", name, names_like(folder_ / fs::path(plain)), hint));
}

Result<Asset> FolderAssets::find(std::string_view name) {
  if (const auto it = found_.find(name); it != found_.end()) return it->second;
  const auto path = locate(name);
  if (!path) return tl::unexpected<Error>(path.error());
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(*path, error);
  const auto digest = sha256_file(*path);
  if (!digest)
    return fail(Errc::invalid_argument,
                fmt::format("\"{}\" can't be read: {}", name, digest.error().message));
  if (error)
    return fail(Errc::invalid_argument, fmt::format("\"{}\" can't be read: {}", name, error.message()));
  const FileEnds ends = ends_of(*path, bytes);
  if (const std::string why = why_placeholder(ends.head); !why.empty())
    return fail(Errc::invalid_argument, fmt::format("\"{}\" {}", name, why));
  if (std::string why = why_perhaps_cut(name, ends.head, ends.tail); !why.empty())
    doubts_.emplace(name, std::move(why));
  const Asset asset{std::string(name), *digest, bytes};
  found_.emplace(asset.name, asset);
  paths_.emplace(asset.name, *path);
  by_digest_.emplace(asset.digest, *path);
  return asset;
}

Result<std::string> FolderAssets::text(std::string_view name) {
  const auto path = locate(name);
  if (!path) return tl::unexpected<Error>(path.error());
  std::error_code error;
  if (fs::file_size(*path, error) > scene::kMaxTextBytes && !error)
    return fail(Errc::resource_exhausted, fmt::format("\"{}\" is larger than the {} MiB of a scene file",
                                                      name, scene::kMaxTextBytes >> 20));
  std::ifstream in(*path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.good() && !in.eof()) return fail(Errc::invalid_argument, fmt::format("\"{}\" can't be read", name));
  return plain_bytes(name, std::move(text), scene::kMaxTextBytes);
}

std::optional<fs::path> FolderAssets::path_of(std::string_view name) const {
  const auto it = paths_.find(name);
  return it == paths_.end() ? std::nullopt : std::optional(it->second);
}

std::optional<fs::path> FolderAssets::path_of(const Digest& digest) const {
  const auto it = by_digest_.find(digest);
  return it == by_digest_.end() ? std::nullopt : std::optional(it->second);
}

}  // namespace ls
