// Memory that callers share: once half of it is used, each may hold a part of it, so that no caller takes the
// part of another.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace ls::http {

// Not thread-safe.
class Shares {
 public:
  // Up to half of `bytes` is for whoever asks. Beyond that one caller may hold a quarter, or one larger
  // piece; a piece counts as a quarter at most.
  explicit Shares(std::uint64_t bytes) : bytes_(bytes), each_(bytes / kParts) {}

  // Bytes of at most this many are not counted and always allowed: small requests and answers, such as a
  // login or a cancellation, never wait for large ones.
  static constexpr std::uint64_t kSmall = std::uint64_t{64} << 10;

  // A piece of the memory; gives it back when destroyed.
  class Held {
   public:
    Held() = default;
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    ~Held() { give_back(); }

    // Takes `bytes` for `caller` in place of what was held before. False: nothing is held, since the caller's
    // part, or the whole memory, is used up.
    bool take(Shares& shares, const std::string& caller, std::uint64_t bytes) {
      give_back();
      if (bytes <= kSmall) return true;
      const std::uint64_t counted = std::min(bytes, shares.each_);
      const auto found = shares.held_.find(caller);
      const std::uint64_t held = found == shares.held_.end() ? 0 : found->second;
      const bool crowded = shares.used_ + counted > shares.bytes_ / 2;
      if ((crowded && held > shares.each_ - counted) || shares.used_ > shares.bytes_ - counted) return false;
      shares_ = &shares;
      caller_ = caller;
      counted_ = counted;
      shares.held_[caller] += counted;
      shares.used_ += counted;
      return true;
    }
    void give_back() {
      if (shares_ == nullptr) return;
      const auto held = shares_->held_.find(caller_);
      held->second -= counted_;
      shares_->used_ -= counted_;
      if (held->second == 0) shares_->held_.erase(held);
      shares_ = nullptr;
    }

   private:
    Shares* shares_ = nullptr;
    std::string caller_;
    std::uint64_t counted_ = 0;
  };

 private:
  static constexpr std::uint64_t kParts = 4;

  const std::uint64_t bytes_, each_;
  std::uint64_t used_ = 0;
  std::map<std::string, std::uint64_t> held_;
};

}  // namespace ls::http
