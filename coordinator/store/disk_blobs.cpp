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

Result<void> move_durably(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (auto made = make_folder(to.parent_path()); !made) return made;
  if (::rename(from.c_str(), to.c_str()) != 0) return tl::unexpected(errno_error("rename to", to));
  if (auto synced = sync_folder(to.parent_path()); !synced) return synced;
  return sync_folder(to.parent_path().parent_path());
}

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
    return move_durably(temporary_, final_);
  }

  Digest digest_;
  File file_;
  std::filesystem::path temporary_, final_;  // temporary_ is empty once the upload has ended
  Sha256 hash_;
  std::uint64_t size_ = 0;
};

}  // namespace

Result<std::unique_ptr<DiskBlobs>> DiskBlobs::open(std::filesystem::path folder, std::filesystem::path work) {
  if (auto made = make_folder(work / "tmp"); !made) return tl::unexpected(made.error());
  std::error_code error;
  for (std::filesystem::directory_iterator left(work / "tmp", error), end; !error && left != end;
       left.increment(error)) {
    std::error_code ignored;
    std::filesystem::remove(left->path(), ignored);
  }
  std::unique_ptr<DiskBlobs> blobs(new DiskBlobs(std::move(folder), std::move(work)));
  auto parts =
      UploadParts::open(blobs->work_ / "unfinished",
                        [blobs = blobs.get()](const Digest& digest, const std::filesystem::path& whole) {
                          return move_durably(whole, blobs->path(digest));
                        });
  if (!parts) return tl::unexpected(parts.error());
  blobs->parts_ = std::move(*parts);
  return blobs;
}

std::filesystem::path DiskBlobs::path(const Digest& digest) const {
  const std::string hex = digest.hex();
  return folder_ / hex.substr(0, 2) / hex;
}

bool DiskBlobs::has(const Digest& digest) const { return ::access(path(digest).c_str(), R_OK) == 0; }

// A disk that cannot be read now (EIO, ESTALE, EACCES) says nothing of what is on it.
Result<bool> DiskBlobs::find(const Digest& digest) const {
  if (has(digest)) return true;
  if (errno == ENOENT || errno == ENOTDIR) return false;
  const Error error = errno_error("look at", path(digest));
  return fail(Errc::unavailable, error.message);
}

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
  std::string name = (work_ / "tmp" / (digest.hex() + ".XXXXXX")).string();
  const int fd = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd < 0) return tl::unexpected(errno_error("make", name));
  return std::make_unique<DiskUpload>(digest, File(fd), name, path(digest));
}

std::uint64_t DiskBlobs::received(const Digest& digest) const { return parts_->received(digest); }

Result<std::unique_ptr<BlobStore::Upload>> DiskBlobs::resume_upload(const Digest& digest,
                                                                    std::uint64_t offset) {
  return parts_->resume(digest, offset);
}

Result<std::vector<Digest>> DiskBlobs::list(bool unfinished) const {
  if (unfinished) return parts_->list();
  std::vector<Digest> all;
  std::error_code error;
  const std::filesystem::directory_iterator end;
  for (std::filesystem::directory_iterator group(folder_, error); !error && group != end; group.increment(error)) {
    if (group->path().filename().string().size() != 2) continue;
    std::error_code gone;
    for (std::filesystem::directory_iterator file(group->path(), gone); !gone && file != end; file.increment(gone))
      if (const auto digest = Digest::parse(file->path().filename().string())) all.push_back(*digest);
  }
  if (error)
    return fail(Errc::unavailable, fmt::format("cannot list '{}': {}", folder_.string(), error.message()));
  return all;
}

Result<void> DiskBlobs::remove(const Digest& digest) {
  if (::unlink(path(digest).c_str()) == 0 || errno == ENOENT) return {};
  return tl::unexpected(errno_error("remove", path(digest)));
}

}  // namespace ls::coordinator
