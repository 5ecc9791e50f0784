// The files of a scene on disk, for the command line. Names are relative to the folder of the main scene
// file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "common/scene/read.h"

namespace ls {

class FolderAssets final : public AssetSource {
 public:
  // `folder` is the one of the main scene file; empty: the working directory.
  explicit FolderAssets(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // Returns name, digest and size of a file; computes each file's digest only once. not_found: the file is
  // missing; the error suggests similar names. invalid_argument: it exists but is not a regular file, or
  // cannot be read.
  Result<Asset> find(std::string_view name) override;
  Result<std::string> text(std::string_view name) override;

  // Returns the path of a file that find() has found.
  std::optional<std::filesystem::path> path_of(std::string_view name) const;
  std::optional<std::filesystem::path> path_of(const Digest& digest) const;

 private:
  Result<std::filesystem::path> locate(std::string_view name) const;

  std::filesystem::path folder_;
  std::map<std::string, Asset, std::less<>> found_;
  std::map<std::string, std::filesystem::path, std::less<>> paths_;
  std::map<Digest, std::filesystem::path> by_digest_;
};

}  // namespace ls
