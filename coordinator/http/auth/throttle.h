// Rate limits by the token-bucket algorithm. (The word "token" means an access token below.) Each token has a
// bucket for its requests. Each address has a bucket for its requests without a token, and another for its
// wrong tokens. A bucket refills by Pace::per_second for every second of the wall clock; if the clock jumps
// back, nothing is refilled.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace ls::http {

struct Pace {
  double per_second = 0;  // requests (or wrong tokens) per second in the long run; 0: no limit
  double burst = 1;       // capacity of the bucket: how many may come at once
};

class Throttle {
 public:
  Throttle(Pace requests, Pace failures) : requests_(requests), failures_(failures) {}

  // Counts one request of `who`, a token's id or an address, at the time `now`. Returns 0 if the request is
  // allowed, else the number of seconds after which it would be.
  int request(std::string_view who, std::int64_t now);

  // Checks whether a token from this address may be tried. After too many wrong tokens, only tokens that were
  // accepted from the address before may be tried: guessing stops, and known users are not locked out.
  // Returns the seconds to wait; 0: the token may be tried.
  int may_try(const std::string& address, std::string_view token_id, std::int64_t now);
  void failed(const std::string& address, std::int64_t now);
  void succeeded(const std::string& address, std::string_view token_id, std::int64_t now);

  // Returns the text under which an address is counted: an IPv4 address itself, and the /64 prefix of an IPv6
  // address, since one person usually has a whole /64.
  static std::string group_of(const std::string& address);

 private:
  struct Bucket {
    double level = 0;                // number of requests, or of wrong tokens, that are allowed now
    std::int64_t at = 0;             // time for which `level` was computed, in seconds since 1970
    std::vector<std::string> known;  // ids of the last kMaxKnown tokens that were accepted from this address
  };
  using Buckets = std::map<std::string, Bucket, std::less<>>;
  static Bucket& fill(Buckets& buckets, std::string_view who, const Pace& pace, std::int64_t now);
  static int wait_of(const Bucket& bucket, const Pace& pace);

  const Pace requests_, failures_;
  std::mutex mutex_;
  Buckets by_caller_, by_address_;
};

}  // namespace ls::http
