#include "coordinator/store/blobs/disk_blobs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "coordinator/base/limits.h"
#include "coordinator/store/files.h"
#include "core/base/log.h"

namespace ls::coordinator {
namespace {

std::filesystem::path damaged(std::filesystem::path path) { return path += ".damaged"; }

class DiskUpload final : public BlobStore::Upload {
 public:
  DiskUpload(Digest digest, File file, std::filesystem::path temporary, UploadParts::Publish publish)
      : digest_(digest),
        file_(std::move(file)),
        temporary_(std::move(temporary)),
        publish_(std::move(publish)) {}
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
    return publish_(digest_, temporary_);
  }

  Digest digest_;
  File file_;
  std::filesystem::path temporary_;  // empty once the upload has ended
  UploadParts::Publish publish_;
  Sha256 hash_;
  std::uint64_t size_ = 0;
};

}  // namespace

Result<std::unique_ptr<DiskBlobs>> DiskBlobs::open(std::filesystem::path folder, std::filesystem::path work) {
  if (auto made = make_folder(work / "tmp"); !made) return tl::unexpected(made.error());
  for (const auto& left : list_folder(work / "tmp").value_or(std::vector<std::filesystem::path>())) {
    std::error_code ignored;
    std::filesystem::remove(left, ignored);
  }
  std::unique_ptr<DiskBlobs> blobs(new DiskBlobs(std::move(folder), std::move(work)));
  auto parts =
      UploadParts::open(blobs->work_ / "unfinished",
                        [blobs = blobs.get()](const Digest& digest, const std::filesystem::path& whole) {
                          return blobs->place(digest, whole);
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

// Returns an error if the disk cannot be read now (EIO, ESTALE, EACCES), so that it is unknown whether the
// blob exists.
Result<bool> DiskBlobs::find(const Digest& digest) const {
  if (has(digest)) return true;
  if (errno == ENOENT || errno == ENOTDIR) return false;
  const Error error = errno_error("look at", path(digest));
  return fail(Errc::unavailable, error.message);
}

Result<FileStamp> DiskBlobs::look_at(const Digest& digest) const {
  if (const auto stamp = stamp_of(path(digest))) return *stamp;
  if (errno == ENOENT) return fail(Errc::not_found, fmt::format("there is no blob {}", digest.hex()));
  return tl::unexpected(errno_error("look at", path(digest)));
}

Result<std::uint64_t> DiskBlobs::size(const Digest& digest) const {
  const auto stamp = look_at(digest);
  if (!stamp) return tl::unexpected(stamp.error());
  return stamp->bytes;
}

// A blob that is read as a whole by one call is hashed each time. A larger one, which is read in pieces, is
// hashed completely before its first piece is read.
Result<std::vector<std::byte>> DiskBlobs::read(const Digest& digest, std::uint64_t offset,
                                               std::uint64_t length) const {
  const auto seen = look_at(digest);
  if (!seen) return tl::unexpected(seen.error());
  if (offset > seen->bytes)
    return fail(Errc::invalid_argument, fmt::format("blob {} has {} bytes; byte {} was asked for",
                                                    digest.hex(), seen->bytes, offset));
  const std::uint64_t n = std::min({length, seen->bytes - offset, limits::kMaxBlobRead});
  const bool whole = n == seen->bytes;
  if (!whole)
    if (auto proven = prove(digest); !proven) return tl::unexpected(proven.error());
  auto file = File::open(path(digest), O_RDONLY);
  if (!file) return tl::unexpected(file.error());
  auto bytes = read_at(*file, offset, static_cast<std::size_t>(n), path(digest));
  if (!bytes || !whole) return bytes;
  if (const Digest got = sha256(*bytes); got != digest) return set_aside(digest, *seen, got);
  proofs_.lock()->insert_or_assign(digest, *seen);
  return bytes;
}

bool DiskBlobs::proven(const Digest& digest, const FileStamp& stamp) const {
  const auto proofs = proofs_.lock();
  const auto found = proofs->find(digest);
  return found != proofs->end() && found->second == stamp;
}

Result<void> DiskBlobs::prove(const Digest& digest, bool again) const {
  const auto known = look_at(digest);
  if (!known) return tl::unexpected(known.error());
  if (!again && proven(digest, *known)) return {};
  const std::lock_guard lock(proving_);
  // The stamp is taken before the file is read. If the file changes meanwhile, the stamp no longer matches,
  // and the next request reads the file again.
  const auto seen = look_at(digest);
  if (!seen) return tl::unexpected(seen.error());
  if (!again && proven(digest, *seen)) return {};
  const auto got = sha256_file(path(digest));
  if (!got) return tl::unexpected(got.error());
  if (*got != digest) return set_aside(digest, *seen, *got);
  proofs_.lock()->insert_or_assign(digest, *seen);
  return {};
}

tl::unexpected<Error> DiskBlobs::set_aside(const Digest& digest, const FileStamp& seen,
                                           const Digest& got) const {
  const auto from = path(digest), to = damaged(from);
  const std::lock_guard lock(placing_);
  if (stamp_of(from) != seen)
    return fail(Errc::unavailable, fmt::format("{} changed while it was read; try again", from.string()));
  proofs_.lock()->erase(digest);
  const std::string what = fmt::format("blob {} is damaged: the bytes in {} have the SHA-256 {}",
                                       digest.hex(), from.string(), got.hex());
  if (::rename(from.c_str(), to.c_str()) != 0)
    return fail(Errc::unavailable, fmt::format("{}; {}; remove the file and upload it again", what,
                                               errno_error("move it aside to", to).message));
  log_error("blob=" + digest.hex(), fmt::format("damaged, moved aside to {}; check this disk", to.string()));
  return fail(Errc::failed_precondition,
              fmt::format("{}; it is out of the way now ({}) and counts as missing: upload the file again, "
                          "or submit the same scene again with `lightshaft submit`",
                          what, to.filename().string()));
}

Result<void> DiskBlobs::place(const Digest& digest, const std::filesystem::path& from) {
  const auto to = path(digest);
  if (auto made = make_folder(to.parent_path()); !made) return made;
  {
    const std::lock_guard lock(placing_);
    if (::rename(from.c_str(), to.c_str()) != 0) return tl::unexpected(errno_error("rename to", to));
    if (const auto stamp = stamp_of(to)) proofs_.lock()->insert_or_assign(digest, *stamp);
    ::unlink(damaged(to).c_str());
  }
  if (auto synced = sync_folder(to.parent_path()); !synced) return synced;
  return sync_folder(to.parent_path().parent_path());
}

Result<void> DiskBlobs::put(const Digest& digest, std::span<const std::byte> bytes) {
  if (prove(digest)) return {};
  auto upload = begin_upload(digest);
  if (!upload) return tl::unexpected(upload.error());
  if (auto done = (*upload)->append(bytes); !done) return done;
  return (*upload)->finish();
}

Result<std::unique_ptr<BlobStore::Upload>> DiskBlobs::begin_upload(const Digest& digest) {
  std::string name = (work_ / "tmp" / (digest.hex() + ".XXXXXX")).string();
  const int fd = ::mkostemp(name.data(), O_CLOEXEC);
  if (fd < 0) return tl::unexpected(errno_error("make", name));
  return std::make_unique<DiskUpload>(
      digest, File(fd), name,
      [this](const Digest& whole, const std::filesystem::path& from) { return place(whole, from); });
}

std::uint64_t DiskBlobs::received(const Digest& digest) const { return parts_->received(digest); }

Result<std::unique_ptr<BlobStore::Upload>> DiskBlobs::resume_upload(const Digest& digest,
                                                                    std::uint64_t offset) {
  return parts_->resume(digest, offset);
}

Result<std::vector<Digest>> DiskBlobs::list(bool unfinished) const {
  if (unfinished) return parts_->list();
  const auto groups = list_folder(folder_);
  if (!groups) return tl::unexpected(groups.error());
  std::vector<Digest> all;
  for (const auto& group : *groups) {
    const auto files = group.filename().string().size() == 2 ? digests_in(group) : std::vector<Digest>();
    if (files) all.insert(all.end(), files->begin(), files->end());
  }
  return all;
}

Result<void> DiskBlobs::remove(const Digest& digest) {
  proofs_.lock()->erase(digest);
  if (::unlink(path(digest).c_str()) == 0 || errno == ENOENT) return {};
  return tl::unexpected(errno_error("remove", path(digest)));
}

}  // namespace ls::coordinator
