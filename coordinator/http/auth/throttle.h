// Rate limits: a bucket of requests per token, or per address without a token, and a bucket of wrong tokens
// per address. Buckets fill with the seconds of the wall clock; if it jumps back, nothing is filled.
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
  double burst = 1;       // capacity of the bucket
};

class Throttle {
 public:
  Throttle(Pace requests, Pace failures) : requests_(requests), failures_(failures) {}

  // Takes one request of this token or address. Returns the seconds to wait; 0: allowed.
  int request(std::string_view who, std::int64_t now);

  // Checks whether a token from this address may be tried: after too many wrong ones only tokens that were
  // right here before may, so that guessing stops without locking out legitimate users. Returns the seconds
  // to wait; 0: allowed.
  int may_try(const std::string& address, std::string_view token_id, std::int64_t now);
  void failed(const std::string& address, std::int64_t now);
  void succeeded(const std::string& address, std::string_view token_id, std::int64_t now);

  // An IPv4 address itself; the /64 of an IPv6 address, since one person has that many addresses.
  static std::string group_of(const std::string& address);

 private:
  struct Bucket {
    double level = 0;
    std::int64_t at = 0;
    std::vector<std::string> known;  // ids of the last kMaxKnown tokens that were right from this address
  };
  using Buckets = std::map<std::string, Bucket, std::less<>>;
  static Bucket& fill(Buckets& buckets, std::string_view who, const Pace& pace, std::int64_t now);
  static int wait_of(const Bucket& bucket, const Pace& pace);

  const Pace requests_, failures_;
  std::mutex mutex_;
  Buckets by_caller_, by_address_;
};

}  // namespace ls::http
