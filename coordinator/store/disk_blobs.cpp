#include "coordinator/store/disk_blobs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "coordinator/limits.h"
#include "coordinator/store/files.h"

namespace ls::coordinator {
namespace {

class DiskUpload final : public BlobStore::Upload {
 public:
  DiskUpload(Digest digest, File file, std::filesystem::path temporary, std::filesystem::path final_path)
      : digest_(digest),
        file_(std::move(file)),
        temporary_(std::move(temporary)),
        final_(std::move(final_path)) {}
  ~DiskUpload() override {
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }

  Result<void> append(std::span<const std::byte> bytes) override {
    if (temporary_.empty()) return fail(Errc::failed_precondition, "this upload has ended");
    if (bytes.size() > limits::kMaxBlobBytes - size_)
      return fail(Errc::resource_exhausted, fmt::format("blob {} is larger than the {} bytes allowed",
                                                        digest_.hex(), limits::kMaxBlobBytes));
    if (auto done = write_all(file_, bytes, temporary_); !done) return done;
    hash_.update(bytes);
    size_ += bytes.size();
    return {};
  }

  Result<void> finish() override {
    if (temporary_.empty()) return fail(Errc::failed_precondition, "this upload has ended");
    const auto done = publish();
    if (!done) ::unlink(temporary_.c_str());
    temporary_.clear();
    return done;
  }

 private:
  Result<void> publish() {
    if (const Digest got = hash_.finish(); got != digest_)
      return fail(
          Errc::invalid_argument,
          fmt::format(
              "the {} bytes received have the SHA-256 {}, not {}: damaged on the way, or the wrong file; "
              "send it again",
              size_, got.hex(), digest_.hex()));
    if (::fsync(file_.fd()) != 0) return tl::unexpected(errno_error("sync", temporary_));
    if (auto made = make_folder(final_.parent_path()); !made) return made;
    if (::rename(temporary_.c_str(), final_.c_str()) != 0)
      return tl::unexpected(errno_error("rename to", final_));
    if (auto synced = sync_folder(final_.parent_path()); !synced) return synced;
    return sync_folder(final_.parent_path().parent_path());
  }

  Digest digest_;
  File file_;
  std::filesystem::path temporary_, final_;  // temporary_ is empty once the upload has ended
  Sha256 hash_;
  std::uint64_t size_ = 0;
};

}  // namespace

Result<std::unique_ptr<DiskBlobs>> DiskBlobs::open(std::filesystem::path folder) {
  if (auto made = make_folder(folder / "tmp"); !made) return tl::unexpected(made.error());
  std::error_code error;
  for (const auto& left : std::filesystem::directory_iterator(folder / "tmp", error)) {
    std::error_code ignored;
    std::filesystem::remove(left.path(), ignored);
  }
  return std::unique_ptr<DiskBlobs>(new DiskBlobs(std::move(folder)));
}

std::filesystem::path DiskBlobs::path(const Digest& digest) const {
  const std::string hex = digest.hex();
  return folder_ / hex.substr(0, 2) / hex;
}

bool DiskBlobs::has(const Digest& digest) const { return ::access(path(digest).c_str(), R_OK) == 0; }

Result<std::uint64_t> DiskBlobs::size(const Digest& digest) const {
  struct stat info {};
  if (::stat(path(digest).c_str(), &info) == 0) return static_cast<std::uint64_t>(info.st_size);
  if (errno == ENOENT) return fail(Errc::not_found, fmt::format("there is no blob {}", digest.hex()));
  return tl::unexpected(errno_error("look at", path(digest)));
}

Result<std::vector<std::byte>> DiskBlobs::read(const Digest& digest, std::uint64_t offset,
                                               std::uint64_t length) const {
  const auto bytes = size(digest);
  if (!bytes) return tl::unexpected(bytes.error());
  if (offset > *bytes)
    return fail(Errc::invalid_argument,
                fmt::format("blob {} has {} bytes; byte {} was asked for", digest.hex(), *bytes, offset));
  auto file = File::open(path(digest), O_RDONLY);
  if (!file) return tl::unexpected(file.error());
  const std::uint64_t n = std::min({length, *bytes - offset, limits::kMaxBlobRead});
  return read_at(*file, offset, static_cast<std::size_t>(n), path(digest));
}

Result<void> DiskBlobs::put(const Digest& digest, std::span<const std::byte> bytes) {
  if (has(digest)) return {};
  auto upload = begin_upload(digest);
  if (!upload) return tl::unexpected(upload.error());
  if (auto done = (*upload)->append(bytes); !done) return done;
  return (*upload)->finish();
}

Result<std::unique_ptr<BlobStore::Upload>> DiskBlobs::begin_upload(const Digest& digest) {
  std::string name = (folder_ / "tmp" / (digest.hex() + ".XXXXXX")).string();
  const int fd = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd < 0) return tl::unexpected(errno_error("make", name));
  return std::make_unique<DiskUpload>(digest, File(fd), name, path(digest));
}

}  // namespace ls::coordinator
