
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <optional>
#include <system_error>
#include <utility>

#include "coordinator/base/limits.h"
#include "coordinator/store/blobs/disk_blobs.h"
#include "coordinator/store/files.h"
#include "core/base/log.h"

namespace ls::coordinator {

// Decides who may write to an incomplete blob's file: the Part with the latest `turn`, a number that
// increases with each resume(). Its lock is held during every change of the file.
struct UploadParts::Slot {
  std::uint64_t turn = 0;
  bool finishing = false;
};

class UploadParts::Part final : public BlobStore::Upload {
 public:
  Part(std::shared_ptr<Guarded<Slot>> slot, std::uint64_t turn, const Digest& digest, File file,
       std::uint64_t size, std::filesystem::path path, Publish publish)
      : slot_(std::move(slot)),
        turn_(turn),
        digest_(digest),
        file_(std::move(file)),
        size_(size),
        from_start_(size == 0),
        path_(std::move(path)),
        publish_(std::move(publish)) {}
  ~Part() override {
    // The client was informed how many bytes were received and continues after them. The sync makes it
    // unlikely that a power failure loses some of these bytes.
    if (!ended_) ::fdatasync(file_.fd());
  }

  Result<void> append(std::span<const std::byte> bytes) override {
    const auto slot = slot_->lock();
    if (auto mine = my_turn(*slot); !mine) return mine;
    if (bytes.size() > limits::kMaxBlobBytes - size_)
      return fail(Errc::resource_exhausted, fmt::format("blob {} is larger than the {} bytes allowed",
                                                        digest_.hex(), limits::kMaxBlobBytes));
    if (auto done = write_all(file_, bytes, path_); !done) return done;
    if (from_start_) hash_.update(bytes);
    size_ += bytes.size();
    return {};
  }

  // Hashes the file without holding the slot's lock, since that takes long for a large file. Meanwhile
  // `finishing` makes other writers to the file fail.
  Result<void> finish() override {
    {
      const auto slot = slot_->lock();
      if (auto mine = my_turn(*slot); !mine) return mine;
      slot->finishing = true;
    }
    const auto done = publish();
    const auto slot = slot_->lock();
    slot->finishing = false;
    ++slot->turn;
    ended_ = true;
    return done;
  }

 private:
  Result<void> my_turn(const Slot& slot) const {
    if (slot.turn == turn_ && !ended_) return {};
    return fail(Errc::failed_precondition, "this upload has ended, or another request has continued it");
  }
  Result<void> publish() {
    auto got = from_start_ ? Result<Digest>(hash_.finish()) : sha256_file(path_);
    if (!got) return tl::unexpected(got.error());
    if (*got != digest_) {
      ::unlink(path_.c_str());
      return fail(
          Errc::invalid_argument,
          fmt::format("the {} bytes received have the SHA-256 {}, not {}: damaged on the way, or parts of "
                      "different files; nothing of them is kept, send it again from the start",
                      size_, got->hex(), digest_.hex()));
    }
    if (::fsync(file_.fd()) != 0) return tl::unexpected(errno_error("sync", path_));
    return publish_(digest_, path_);
  }

  std::shared_ptr<Guarded<Slot>> slot_;
  std::uint64_t turn_;
  Digest digest_;
  File file_;
  std::uint64_t size_;
  bool from_start_, ended_ = false;
  std::filesystem::path path_;
  Publish publish_;
  Sha256 hash_;  // of the whole blob; used only if all bytes came through this Part
};

UploadParts::UploadParts(std::filesystem::path folder, Publish publish)
    : folder_(std::move(folder)), publish_(std::move(publish)) {}
UploadParts::~UploadParts() = default;

Result<std::unique_ptr<UploadParts>> UploadParts::open(std::filesystem::path folder, Publish publish) {
  if (auto made = make_folder(folder); !made) return tl::unexpected(made.error());
  return std::unique_ptr<UploadParts>(new UploadParts(std::move(folder), std::move(publish)));
}

std::uint64_t UploadParts::received(const Digest& digest) const {
  struct stat info {};
  return ::stat(path(digest).c_str(), &info) == 0 ? static_cast<std::uint64_t>(info.st_size) : 0;
}

std::shared_ptr<Guarded<UploadParts::Slot>> UploadParts::slot(const Digest& digest) {
  const auto slots = slots_.lock();
  std::erase_if(*slots, [](const auto& item) { return item.second.expired(); });
  auto found = (*slots)[digest].lock();
  if (!found) (*slots)[digest] = found = std::make_shared<Guarded<Slot>>();
  return found;
}

Result<std::unique_ptr<BlobStore::Upload>> UploadParts::resume(const Digest& digest, std::uint64_t offset) {
  if (received(digest) == 0) make_room();
  const auto guarded = slot(digest);
  const auto slot = guarded->lock();
  const std::uint64_t there = received(digest);
  if (slot->finishing)
    return fail(Errc::failed_precondition,
                fmt::format("all of blob {} is here and being checked", digest.hex()));
  if (there != offset)
    return fail(Errc::failed_precondition,
                fmt::format("{} bytes of blob {} are here: continue there, not at byte {}", there,
                            digest.hex(), offset));
  auto file = File::open(path(digest), O_WRONLY | O_CREAT | O_APPEND);
  if (!file) return tl::unexpected(file.error());
  return std::make_unique<Part>(guarded, ++slot->turn, digest, std::move(*file), there, path(digest),
                                publish_);
}

Result<std::vector<Digest>> digests_in(const std::filesystem::path& folder) {
  const auto files = list_folder(folder);
  if (!files) return tl::unexpected(files.error());
  std::vector<Digest> all;
  for (const auto& file : *files)
    if (const auto digest = Digest::parse(file.filename().string())) all.push_back(*digest);
  return all;
}

void UploadParts::make_room() {
  const auto kept = list();
  if (!kept || kept->size() < limits::kMaxUnfinishedUploads) return;
  std::optional<std::pair<std::pair<std::int64_t, std::int64_t>, Digest>> oldest;
  for (const Digest& digest : *kept) {
    struct stat info {};
    if (::stat(path(digest).c_str(), &info) != 0) continue;
    const std::pair grown{std::int64_t{info.st_mtim.tv_sec}, std::int64_t{info.st_mtim.tv_nsec}};
    if (!oldest || std::pair(grown, digest) < *oldest) oldest = {grown, digest};
  }
  if (!oldest) return;
  log_warn(fmt::format("blob={}", oldest->second.hex()),
           fmt::format("{} unfinished uploads are kept: the one that has not grown for the longest time goes",
                       kept->size()));
  remove(oldest->second);
}

void UploadParts::remove(const Digest& digest) {
  const auto guarded = slot(digest);
  const auto slot = guarded->lock();
  if (slot->finishing) return;
  ++slot->turn;
  ::unlink(path(digest).c_str());
}

}  // namespace ls::coordinator
