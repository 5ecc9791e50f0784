// Least-recently-used list of the local copies of a remote store's blobs: decides which give way to newer
// ones. Thread-safe; removes nothing itself.
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
  explicit LocalCopies(std::uint64_t most) : most_(most) {}  // bytes; 0: no limit

  // Records that the copy, of this size, has just been read or written. Returns the copies to remove; never
  // this one.
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
