// Whose unfinished uploads the store keeps. The store has room for a number of them and drops the one that
// has not grown for the longest; without shares a token with many would drop those of others.
#pragma once

#include <algorithm>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "core/base/digest.h"

namespace ls::http {

// Thread-safe. It is empty after a restart: unfinished uploads from before it count for nobody.
class PartialUploads {
 public:
  explicit PartialUploads(std::size_t each) : each_(each) {}

  // Notes that the token goes on with an upload. Returns the token's upload that the store must drop for it:
  // the one with which it has not gone on for the longest.
  std::optional<Digest> go_on(const std::string& token, const Digest& digest) {
    const std::lock_guard lock(mutex_);
    auto& own = by_token_[token];
    own.remove(digest);
    own.push_back(digest);
    if (own.size() <= each_) return std::nullopt;
    const Digest oldest = own.front();
    own.pop_front();
    return oldest;
  }
  // Notes that an upload of the token has ended.
  void ended(const std::string& token, const Digest& digest) {
    const std::lock_guard lock(mutex_);
    const auto own = by_token_.find(token);
    if (own == by_token_.end()) return;
    own->second.remove(digest);
    if (own->second.empty()) by_token_.erase(own);
  }

 private:
  const std::size_t each_;
  std::mutex mutex_;
  std::map<std::string, std::list<Digest>> by_token_;
};

}  // namespace ls::http
