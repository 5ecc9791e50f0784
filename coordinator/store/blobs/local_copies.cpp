#include "coordinator/store/blobs/local_copies.h"

namespace ls::coordinator {

std::vector<Digest> LocalCopies::used(const Digest& digest, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  forget_locked(digest);
  where_[digest] = order_.insert(order_.end(), {digest, bytes});
  bytes_ += bytes;
  std::vector<Digest> too_many;
  while (most_ > 0 && bytes_ > most_ && order_.size() > 1) {
    too_many.push_back(order_.front().digest);
    forget_locked(too_many.back());
  }
  return too_many;
}

void LocalCopies::gone(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  forget_locked(digest);
}

std::uint64_t LocalCopies::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

void LocalCopies::forget_locked(const Digest& digest) {
  const auto found = where_.find(digest);
  if (found == where_.end()) return;
  bytes_ -= found->second->bytes;
  order_.erase(found->second);
  where_.erase(found);
}

}  // namespace ls::coordinator
