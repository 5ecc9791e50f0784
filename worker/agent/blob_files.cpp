#include "worker/agent/blob_files.h"

#include <fmt/format.h>

namespace ls::worker {
namespace {
struct PlainFile final : BlobFile {
  explicit PlainFile(std::filesystem::path p) : file(std::move(p)) {}
  const std::filesystem::path& path() const override { return file; }
  std::filesystem::path file;
};
}  // namespace

Result<std::shared_ptr<const BlobFile>> LocalFiles::acquire(const BlobRef& blob) {
  const auto it = files_.find(blob.digest);
  if (it == files_.end())
    return fail(Errc::not_found,
                fmt::format("no file here has the content of '{}' ({})", blob.name, blob.digest.hex()));
  return std::make_shared<const PlainFile>(it->second);
}

std::vector<Digest> LocalFiles::held(std::size_t limit) const {
  std::vector<Digest> digests;
  for (const auto& [digest, path] : files_) {
    if (digests.size() == limit) break;
    digests.push_back(digest);
  }
  return digests;
}

}  // namespace ls::worker
