#include "coordinator/store/blobs/memory_blobs.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "coordinator/base/limits.h"
#include "coordinator/store/files.h"
#include "core/base/overloaded.h"

namespace ls::coordinator {
namespace {

Error no_blob(const Digest& digest) {
  return {Errc::not_found, fmt::format("there is no blob {}", digest.hex())};
}

class MemoryUpload final : public BlobStore::Upload {
 public:
  MemoryUpload(MemoryBlobs& store, Digest digest) : store_(store), digest_(digest) {}
  Result<void> append(std::span<const std::byte> bytes) override {
    if (bytes.size() > limits::kMaxBlobRead - bytes_.size())
      return fail(Errc::resource_exhausted, fmt::format("blob {} is larger than the {} bytes kept in memory",
                                                        digest_.hex(), limits::kMaxBlobRead));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<void> finish() override { return store_.put(digest_, bytes_); }

 private:
  MemoryBlobs& store_;
  Digest digest_;
  std::vector<std::byte> bytes_;
};

}  // namespace

Result<void> MemoryBlobs::adopt(const Digest& digest, std::filesystem::path path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  if (error) return fail(Errc::not_found, fmt::format("cannot read {}: {}", path.string(), error.message()));
  const std::lock_guard lock(mutex_);
  blobs_.insert_or_assign(digest, Adopted{std::move(path), bytes});
  return {};
}

std::optional<std::filesystem::path> MemoryBlobs::adopted(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  const auto found = blobs_.find(digest);
  if (found == blobs_.end()) return std::nullopt;
  const auto* file = std::get_if<Adopted>(&found->second);
  return file ? std::optional(file->path) : std::nullopt;
}

bool MemoryBlobs::has(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  return blobs_.contains(digest);
}

Result<std::uint64_t> MemoryBlobs::size(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  const auto found = blobs_.find(digest);
  if (found == blobs_.end()) return tl::unexpected(no_blob(digest));
  return std::visit(overloaded{[](const std::vector<std::byte>& b) -> std::uint64_t { return b.size(); },
                               [](const Adopted& a) { return a.bytes; }},
                    found->second);
}

Result<std::vector<std::byte>> MemoryBlobs::read(const Digest& digest, std::uint64_t offset,
                                                 std::uint64_t length) const {
  const auto bytes = size(digest);
  if (!bytes) return tl::unexpected(bytes.error());
  if (offset > *bytes)
    return fail(Errc::invalid_argument,
                fmt::format("blob {} has {} bytes; byte {} was asked for", digest.hex(), *bytes, offset));
  const auto n = static_cast<std::size_t>(std::min({length, *bytes - offset, limits::kMaxBlobRead}));
  if (const auto path = adopted(digest)) {
    auto file = File::open(*path, O_RDONLY);
    if (!file) return tl::unexpected(file.error());
    return read_at(*file, offset, n, *path);
  }
  const std::lock_guard lock(mutex_);
  const auto* kept = std::get_if<std::vector<std::byte>>(&blobs_.at(digest));
  if (!kept) return tl::unexpected(no_blob(digest));
  const auto from = kept->begin() + static_cast<std::ptrdiff_t>(offset);
  return std::vector<std::byte>(from, from + static_cast<std::ptrdiff_t>(n));
}

Result<void> MemoryBlobs::put(const Digest& digest, std::span<const std::byte> bytes) {
  if (const Digest got = sha256(bytes); got != digest)
    return fail(Errc::invalid_argument, fmt::format("the {} bytes received have the SHA-256 {}, not {}",
                                                    bytes.size(), got.hex(), digest.hex()));
  const std::lock_guard lock(mutex_);
  blobs_.try_emplace(digest, std::vector<std::byte>(bytes.begin(), bytes.end()));
  return {};
}

Result<std::unique_ptr<BlobStore::Upload>> MemoryBlobs::begin_upload(const Digest& digest) {
  return std::make_unique<MemoryUpload>(*this, digest);
}

}  // namespace ls::coordinator
