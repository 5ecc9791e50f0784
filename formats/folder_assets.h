// The files of a scene on disk, for the command line. Names are relative to the folder of the main scene
// file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "formats/read.h"

namespace ls {

// A temporary folder. It is removed from disk when the last shared pointer to it is destroyed.
class KeptFolder {
 public:
  static Result<std::shared_ptr<const KeptFolder>> make();
  ~KeptFolder();
  KeptFolder(const KeptFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit KeptFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

class FolderAssets final : public AssetSource {
 public:
  // `folder` is the folder of the main scene file; empty: the working directory.
  explicit FolderAssets(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Returns name, digest and size of a file. The digest is computed only once per file. If there is no file
  // of this name, one counts whose name is the same but for backslashes between folders and for how its
  // letters are composed. not_found: the file is missing; the error suggests similar names. invalid_argument:
  // the file exists but is not a regular file, cannot be read, or is a placeholder of the real one
  // (file_form.h).
  Result<Asset> find(std::string_view name) override;
  // Returns the text of a file, unpacked if it is packed by gzip.
  Result<std::string> text(std::string_view name) override;
  // Writes a file with these bytes to a temporary folder. From then on find(name) returns this file, even if
  // the scene's own folder has a file of the same name. The scene's folder is not changed.
  Result<Asset> keep(std::string_view name, const std::string& bytes) override;
  bool keeps() const override { return true; }

  // Returns the folder of the files that keep() stored; null if there are none.
  std::shared_ptr<const KeptFolder> kept() const { return kept_; }
  // Returns what is doubtful about the files that find() has found since the previous call, by their names.
  std::map<std::string, std::string, std::less<>> take_doubts() { return std::exchange(doubts_, {}); }
  // Returns the path of a file that find() has found.
  std::optional<std::filesystem::path> path_of(std::string_view name) const;
  std::optional<std::filesystem::path> path_of(const Digest& digest) const;

 private:
  Result<std::filesystem::path> locate(std::string_view name) const;
  tl::unexpected<Error> missing(std::string_view name) const;

  std::filesystem::path folder_;
  std::shared_ptr<const KeptFolder> kept_;
  std::map<std::string, Asset, std::less<>> found_;
  std::map<std::string, std::filesystem::path, std::less<>> paths_;
  std::map<Digest, std::filesystem::path> by_digest_;
  std::map<std::string, std::string, std::less<>> doubts_;
};

}  // namespace ls
