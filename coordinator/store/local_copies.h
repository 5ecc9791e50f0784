// Which copies on this machine, of blobs that a store elsewhere has, give way to newer ones: those not read
// for the longest time. Thread-safe; removes nothing itself.
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
  explicit LocalCopies(std::uint64_t most) : most_(most) {}  // bytes; 0: any number

  // It is here, of so many bytes, and was read or written just now. Which ones must go; never this one.
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
  std::list<Copy> order_;  // the one used last is the last
  std::map<Digest, std::list<Copy>::iterator> where_;
  std::uint64_t bytes_ = 0;
};

}  // namespace ls::coordinator
