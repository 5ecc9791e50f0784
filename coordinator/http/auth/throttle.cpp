#include "coordinator/http/auth/throttle.h"

#include <algorithm>
#include <cmath>

namespace ls::http {
namespace {

constexpr std::size_t kMaxBuckets = 10'000;
constexpr std::size_t kMaxKnown = 64;
constexpr std::size_t kGroupsOfPrefix = 4;  // number of 16-bit groups in the /64 prefix of an IPv6 address

}  // namespace

Throttle::Bucket& Throttle::fill(Buckets& buckets, std::string_view who, const Pace& pace, std::int64_t now) {
  auto found = buckets.find(who);
  if (found == buckets.end()) {
    // Bounds the memory. First, buckets that are full again and whose `known` is empty are dropped: a new
    // bucket would be equal. If there are still too many, all are dropped.
    if (buckets.size() >= kMaxBuckets)
      std::erase_if(buckets, [&](const auto& b) {
        return b.second.known.empty() &&
               b.second.level + static_cast<double>(now - b.second.at) * pace.per_second >= pace.burst;
      });
    if (buckets.size() >= kMaxBuckets) buckets.clear();
    found = buckets.emplace(std::string(who), Bucket{pace.burst, now, {}}).first;
  }
  Bucket& bucket = found->second;
  const auto passed = static_cast<double>(std::max<std::int64_t>(0, now - bucket.at));
  bucket.level = std::min(pace.burst, bucket.level + passed * pace.per_second);
  bucket.at = now;
  return bucket;
}

int Throttle::wait_of(const Bucket& bucket, const Pace& pace) {
  if (bucket.level >= 1) return 0;
  return std::max(1, static_cast<int>(std::ceil((1 - bucket.level) / pace.per_second)));
}

int Throttle::request(std::string_view who, std::int64_t now) {
  if (requests_.per_second <= 0) return 0;
  const std::lock_guard lock(mutex_);
  Bucket& bucket = fill(by_caller_, who, requests_, now);
  const int wait = wait_of(bucket, requests_);
  if (wait == 0) bucket.level -= 1;
  return wait;
}

int Throttle::may_try(const std::string& address, std::string_view token_id, std::int64_t now) {
  if (failures_.per_second <= 0) return 0;
  const std::lock_guard lock(mutex_);
  const Bucket& bucket = fill(by_address_, address, failures_, now);
  const auto& known = bucket.known;
  if (std::find(known.begin(), known.end(), token_id) != known.end()) return 0;
  return wait_of(bucket, failures_);
}

void Throttle::failed(const std::string& address, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  Bucket& bucket = fill(by_address_, address, failures_, now);
  bucket.level = std::max(0.0, bucket.level - 1);
}

void Throttle::succeeded(const std::string& address, std::string_view token_id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  auto& known = fill(by_address_, address, failures_, now).known;
  if (std::find(known.begin(), known.end(), token_id) != known.end()) return;
  if (known.size() >= kMaxKnown) known.erase(known.begin());
  known.emplace_back(token_id);
}

std::string Throttle::group_of(const std::string& address) {
  if (address.find(':') == std::string::npos || address.find('.') != std::string::npos) return address;
  std::size_t at = 0;
  for (std::size_t group = 0; group < kGroupsOfPrefix; ++group) {
    const std::size_t colon = address.find(':', at);
    if (colon == std::string::npos) return address;
    at = colon + 1;
    if (colon + 1 < address.size() && address[colon + 1] == ':') return address.substr(0, at + 1);
  }
  return address.substr(0, at);
}

}  // namespace ls::http
