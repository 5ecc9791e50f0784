#include "coordinator/store/blobs/s3_blobs.h"

#include <fmt/format.h>

#include "core/base/log.h"

namespace ls::coordinator {

std::vector<Digest> LocalCopies::used(const Digest& digest, std::uint64_t bytes) {
  gone(digest);
  where_[digest] = order_.insert(order_.end(), {digest, bytes});
  bytes_ += bytes;
  std::vector<Digest> too_many;
  while (most_ > 0 && bytes_ > most_ && order_.size() > 1) {
    too_many.push_back(order_.front().digest);
    gone(too_many.back());
  }
  return too_many;
}

void LocalCopies::gone(const Digest& digest) {
  const auto found = where_.find(digest);
  if (found == where_.end()) return;
  bytes_ -= found->second->bytes;
  order_.erase(found->second);
  where_.erase(found);
}

namespace {

constexpr int kReadTries = 3;
// missing() either sends one request per unknown digest or lists the whole store, which takes one request per
// kKeysPerList keys (the most that S3 returns at once). It lists the store if the number of unknown digests
// is greater than kLeastLookups plus the expected number of list requests.
constexpr std::size_t kLeastLookups = 16, kKeysPerList = 1000;

std::string key_of(const Digest& digest) {
  const std::string hex = digest.hex();
  return hex.substr(0, 2) + "/" + hex;
}

std::optional<Digest> digest_of_key(std::string_view key) {
  return key.size() > 3 && key[2] == '/' ? Digest::parse(key.substr(3)) : std::nullopt;
}

}  // namespace

// An upload into the local folder. When the upload is complete, its file is sent to the S3 store.
class S3Blobs::Passed final : public BlobStore::Upload {
 public:
  Passed(S3Blobs& store, std::unique_ptr<Upload> local, const Digest& digest)
      : store_(store), local_(std::move(local)), digest_(digest) {}
  Result<void> append(std::span<const std::byte> bytes) override { return local_->append(bytes); }
  Result<void> finish() override {
    if (auto whole = local_->finish(); !whole) return whole;
    return store_.send(digest_);
  }

 private:
  S3Blobs& store_;
  std::unique_ptr<Upload> local_;
  Digest digest_;
};

Result<std::unique_ptr<S3Blobs>> S3Blobs::open(const S3Options& options, std::filesystem::path folder) {
  auto local = DiskBlobs::open(std::move(folder));
  if (!local) return tl::unexpected(local.error());
  std::unique_ptr<S3Blobs> blobs(new S3Blobs(options, std::move(*local)));
  const auto known = blobs->list(false);
  if (!known) return tl::unexpected(known.error());
  blobs->there_.insert(known->begin(), known->end());
  if (const auto here = blobs->local_->list(false))
    for (const Digest& digest : *here) blobs->note_copy(digest);
  log_info("store=s3", fmt::format("{}: {} blobs", blobs->link_.shown(), known->size()));
  return blobs;
}

void S3Blobs::note(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  there_.insert(digest);
  damaged_.erase(digest);
}

bool S3Blobs::known(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  return there_.contains(digest);
}

Result<bool> S3Blobs::find(const Digest& digest) const {
  if (known(digest)) return true;
  const auto object = link_.look_at(key_of(digest));
  if (object) {
    {
      const std::lock_guard lock(mutex_);
      const auto known = damaged_.find(digest);
      if (known != damaged_.end() && known->second == object->etag) return false;
    }
    note(digest);
    return true;
  }
  if (object.error().code == Errc::not_found) return false;
  log_error("store=s3", object.error().message);
  return fail(Errc::unavailable, object.error().message);
}

Result<std::vector<Digest>> S3Blobs::missing(std::span<const Digest> digests) const {
  std::set<Digest> unknown;
  bool list_is_shorter = false;
  {
    const std::lock_guard lock(mutex_);
    for (const Digest& digest : digests)
      if (!there_.contains(digest) && !damaged_.contains(digest)) unknown.insert(digest);
    list_is_shorter = unknown.size() > kLeastLookups + there_.size() / kKeysPerList;
  }
  if (list_is_shorter) {
    const auto keys = list(false);
    if (!keys) return tl::unexpected(keys.error());
    const std::lock_guard lock(mutex_);
    for (const Digest& digest : *keys)
      if (!damaged_.contains(digest)) there_.insert(digest);
  }
  std::vector<Digest> lacking;
  for (const Digest& digest : digests) {
    const auto there = list_is_shorter && unknown.contains(digest) ? known(digest) : find(digest);
    if (!there) return tl::unexpected(there.error());
    if (!*there) lacking.push_back(digest);
  }
  return lacking;
}

Result<void> S3Blobs::prove(const Digest& digest, bool again) const {
  if (local_->has(digest))
    if (auto proven = local_->prove(digest, again); !proven && local_->has(digest)) return proven;
  const auto there = find(digest);
  if (!there) return tl::unexpected(there.error());
  return *there ? Result<void>() : fail(Errc::not_found, fmt::format("there is no blob {}", digest.hex()));
}

Result<std::uint64_t> S3Blobs::size(const Digest& digest) const {
  if (local_->has(digest)) return local_->size(digest);
  const auto object = link_.look_at(key_of(digest));
  if (!object) return tl::unexpected(object.error());
  return object->bytes;
}

Result<std::vector<std::byte>> S3Blobs::read(const Digest& digest, std::uint64_t offset,
                                             std::uint64_t length) const {
  // Fetching is repeated if the local copy disappears between fetch and read: it may be removed to make room
  // for others, or moved aside as damaged.
  for (int tries = 1;; ++tries) {
    if (!local_->has(digest))
      if (auto fetched = fetch(digest); !fetched) return tl::unexpected(fetched.error());
    auto bytes = local_->read(digest, offset, length);
    if (!bytes && !local_->has(digest) && tries < kReadTries) continue;
    if (bytes) note_copy(digest);
    return bytes;
  }
}

void S3Blobs::note_copy(const Digest& digest) const {
  if (!known(digest)) return;  // the S3 store may lack this blob, so the local file must not be removed
  const auto bytes = local_->size(digest);
  if (!bytes) return;
  for (const Digest& old : copies_.lock()->used(digest, *bytes))
    if (auto removed = local_->remove(old); !removed) log_warn("store=s3", removed.error().message);
}

Result<void> S3Blobs::fetch(const Digest& digest) const {
  std::unique_lock lock(mutex_);
  if (const auto found = coming_.find(digest); found != coming_.end()) {
    const auto flight = found->second;
    flight->landed.wait(lock, [&] { return flight->outcome.has_value(); });
    return *flight->outcome;
  }
  const auto flight = coming_[digest] = std::make_shared<Flight>();
  lock.unlock();
  // Another thread may have fetched the blob since the caller checked for a copy.
  auto outcome = local_->has(digest) ? Result<void>() : fetch_now(digest);
  lock.lock();
  coming_.erase(digest);
  flight->outcome = outcome;
  flight->landed.notify_all();
  return outcome;
}

Result<void> S3Blobs::fetch_now(const Digest& digest) const {
  std::unique_ptr<Upload> upload;
  const auto restart = [&]() -> Result<void> {
    auto begun = local_->begin_upload(digest);
    if (!begun) return tl::unexpected(begun.error());
    upload = std::move(*begun);
    return {};
  };
  const S3Link::Sink sink = [&](std::span<const std::byte> bytes) { return upload->append(bytes); };
  if (auto got = link_.get(key_of(digest), restart, sink); !got) {
    if (got.error().code == Errc::not_found) note_lost(digest);
    return got;
  }
  if (auto whole = upload->finish(); !whole) {
    const bool damaged = whole.error().code == Errc::invalid_argument;
    return tl::unexpected(damaged ? note_damaged(digest, whole.error()) : whole.error());
  }
  note(digest);
  return {};
}

void S3Blobs::note_lost(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  there_.erase(digest);
}

// Notes that the object in the S3 store is damaged. The object stays there, so that an operator can examine
// it or replace it with the right one.
Error S3Blobs::note_damaged(const Digest& digest, const Error& why) const {
  const auto object = link_.look_at(key_of(digest));
  const std::lock_guard lock(mutex_);
  there_.erase(digest);
  if (object) damaged_[digest] = object->etag;
  return {Errc::failed_precondition,
          fmt::format("what {} has for blob {} is damaged ({}) and counts as missing: upload the file again, "
                      "or submit the same scene again with `lightshaft submit`",
                      link_.shown(), digest.hex(), why.message)};
}

Result<void> S3Blobs::send(const Digest& digest) {
  const auto bytes = local_->size(digest);
  if (!bytes) return tl::unexpected(bytes.error());
  if (auto sent = link_.put(key_of(digest), local_->path(digest), *bytes, digest); !sent) return sent;
  note(digest);
  note_copy(digest);
  return {};
}

Result<void> S3Blobs::put(const Digest& digest, std::span<const std::byte> bytes) {
  if (prove(digest)) return {};
  if (auto kept = local_->put(digest, bytes); !kept) return kept;
  return send(digest);
}

Result<std::unique_ptr<BlobStore::Upload>> S3Blobs::begin_upload(const Digest& digest) {
  auto local = local_->begin_upload(digest);
  if (!local) return tl::unexpected(local.error());
  return std::make_unique<Passed>(*this, std::move(*local), digest);
}

Result<std::unique_ptr<BlobStore::Upload>> S3Blobs::resume_upload(const Digest& digest,
                                                                  std::uint64_t offset) {
  auto local = local_->resume_upload(digest, offset);
  if (!local) return tl::unexpected(local.error());
  return std::make_unique<Passed>(*this, std::move(*local), digest);
}

Result<std::vector<Digest>> S3Blobs::list(bool unfinished) const {
  if (unfinished) return local_->list(true);
  const auto keys = link_.list();
  if (!keys) return tl::unexpected(keys.error());
  std::vector<Digest> all;
  for (const std::string& key : *keys)
    if (const auto digest = digest_of_key(key)) all.push_back(*digest);
  return all;
}

Result<void> S3Blobs::remove(const Digest& digest) {
  note_lost(digest);
  if (auto gone = link_.remove(key_of(digest)); !gone) return gone;
  copies_.lock()->gone(digest);
  return local_->remove(digest);
}

}  // namespace ls::coordinator
