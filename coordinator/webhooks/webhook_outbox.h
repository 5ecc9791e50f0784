// The notifications that receivers have not accepted yet: a queue for each receiver in memory, and a copy on
// disk, in the folder DIR (webhooks in the folder of --data). If the coordinator is killed, it sends them
// after its next start.
//
//   DIR/open/JOB               exists until a notification of the job's end has been stored
//   DIR/RECEIVER/NUMBER.json   a delivery (one notification to one receiver) that is not accepted yet;
//                              RECEIVER is named after the receiver's address
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/base/id.h"

namespace ls::coordinator::webhooks {

// A delivery is dropped after this many failed attempts, the last about an hour after the first
inline constexpr int kMaxAttempts = 20;
inline constexpr std::size_t kMaxWaiting = 10000;  // when more deliveries wait, the oldest is dropped
inline constexpr double kFirstRetrySeconds = 1, kMaxRetrySeconds = 300;

struct Delivery {            // a notification that waits to be sent
  std::uint64_t number = 0;  // ascending in the order of events; also the name of the delivery's file
  std::string id;            // lets receivers detect repeated deliveries
  std::string event;         // "job.done"
  std::string body;          // JSON
};

// One receiver's deliveries, in order, and the times of its retries. Later deliveries wait until the first is
// accepted or dropped, so that "done" never arrives before "running". The state of a Line depends only on the
// deliveries added, the outcomes reported and the times passed in. Not thread-safe.
class Line {
 public:
  // Returns the delivery that was dropped because too many wait, else nullopt.
  std::optional<Delivery> add(Delivery delivery);
  // Returns the delivery to send now; null if there is none or the time for its next attempt has not come.
  const Delivery* due(TimePoint now) const;
  // Returns the time from which due() will return a delivery; nullopt: there is none.
  std::optional<TimePoint> next_due() const;
  // Call taken() when the receiver has accepted the delivery that due() returned, failed() when the attempt
  // failed. Both return the delivery if it leaves the queue: taken() always, failed() after kMaxAttempts
  // attempts.
  std::optional<Delivery> taken();
  std::optional<Delivery> failed(TimePoint now);
  std::size_t waiting() const { return waiting_.size(); }
  int attempts() const { return attempts_; }  // number of failed attempts to send the first delivery

 private:
  Delivery pop();
  std::deque<Delivery> waiting_;
  int attempts_ = 0;
  TimePoint not_before_{};
};

double retry_seconds(int attempts);  // seconds to wait after this many attempts

// The copies of the deliveries on disk.
class Outbox {
 public:
  static Result<Outbox> open(std::filesystem::path folder, const std::vector<std::string>& urls);

  // Returns the stored deliveries to a receiver, given by its index in `urls`, ascending by number. Other
  // files in the folder are neither returned nor removed.
  std::vector<Delivery> waiting(std::size_t receiver) const;
  Result<void> keep(std::size_t receiver, const Delivery& delivery);
  void forget(std::size_t receiver, const Delivery& delivery);

  std::set<JobId> open_jobs() const;
  Result<void> job_is_open(const JobId& job);
  void job_has_ended(const JobId& job);

 private:
  explicit Outbox(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path file(std::size_t receiver, const Delivery& delivery) const;
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> receivers_;
};

}  // namespace ls::coordinator::webhooks
