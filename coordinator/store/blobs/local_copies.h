// Remembers the local copies of a remote store's blobs and when each was used last, and decides which copies
// must be removed to make room for newer ones. It removes nothing itself. Thread-safe.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <vector>

#include "common/base/digest.h"

namespace ls::coordinator {

class LocalCopies {
 public:
  // All copies together may have at most `most` bytes; 0: no limit.
  explicit LocalCopies(std::uint64_t most) : most_(most) {}

  // Records that the copy of this blob, of this many bytes, has just been read or written. Returns the copies
  // that the caller must remove to stay within the limit; this copy is never among them.
  std::vector<Digest> used(const Digest& digest, std::uint64_t bytes);
  void gone(const Digest& digest);
  std::uint64_t bytes() const;

 private:
  struct Copy {
    Digest digest;
    std::uint64_t bytes;
  };
  void forget_locked(const Digest& digest);

  const std::uint64_t most_;
  mutable std::mutex mutex_;
  std::list<Copy> order_;  // the most recently used at the end
  std::map<Digest, std::list<Copy>::iterator> where_;
  std::uint64_t bytes_ = 0;
};

}  // namespace ls::coordinator
