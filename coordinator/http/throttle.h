// How often one may ask: a bucket of requests per token, or per address where there is none, and one of wrong
// tokens per address. Buckets fill with the seconds of the wall clock; one that jumps back fills nothing.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace ls::http {

struct Pace {
  double per_second = 0;  // 0: no limit
  double burst = 1;       // what a full bucket holds
};

class Throttle {
 public:
  Throttle(Pace requests, Pace failures) : requests_(requests), failures_(failures) {}

  // Takes one request of this token or address. Gives the seconds to wait, 0: go on.
  int request(std::string_view who, std::int64_t now);

  // Whether a token from this address may be looked at at all: after too many wrong ones only those may that
  // were right here before, so that guessing ends without locking out who works. Seconds to wait, 0: go on.
  int may_try(const std::string& address, std::string_view token_id, std::int64_t now);
  void failed(const std::string& address, std::int64_t now);
  void succeeded(const std::string& address, std::string_view token_id, std::int64_t now);

  // Of an IPv4 address itself, of an IPv6 one its /64: one person has that many.
  static std::string group_of(const std::string& address);

 private:
  struct Bucket {
    double level = 0;
    std::int64_t at = 0;
    std::vector<std::string> known;  // ids of tokens that were right from this address, the last kMaxKnown
  };
  using Buckets = std::map<std::string, Bucket, std::less<>>;
  static Bucket& fill(Buckets& buckets, std::string_view who, const Pace& pace, std::int64_t now);
  static int wait_of(const Bucket& bucket, const Pace& pace);

  const Pace requests_, failures_;
  std::mutex mutex_;
  Buckets by_caller_, by_address_;
};

}  // namespace ls::http
