// The notifications that receivers have not accepted yet: for each receiver a queue in memory, and a copy of
// each notification on disk. If the coordinator is killed, it sends the notifications on disk after its next
// start. DIR is the subfolder `webhooks` of the folder that --data names:
//
//   DIR/open/JOB               an empty file that marks a job until the notification of its end has been
//                              stored for every receiver
//   DIR/RECEIVER/NUMBER.json   a delivery (one notification to one receiver) that is not accepted yet;
//                              RECEIVER is a hash of the receiver's address
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/id.h"

namespace ls::coordinator::webhooks {

// A delivery is dropped after this many failed attempts. The last attempt is about an hour after the first.
inline constexpr int kMaxAttempts = 20;
inline constexpr std::size_t kMaxWaiting = 10000;  // most deliveries in the queue of a receiver
// The pause after the first failed attempt. Each later pause is twice as long, up to the maximum.
inline constexpr double kFirstRetrySeconds = 1, kMaxRetrySeconds = 300;

struct Delivery {            // a notification that waits to be sent
  std::uint64_t number = 0;  // ascending in the order of events; the delivery's file is NUMBER.json
  std::string id;            // the same in all attempts, so that receivers detect repetitions
  std::string event;         // "job." and the new state: "job.done"
  std::string body;          // the body of the request, JSON text
};

// The queue of the deliveries to one receiver, oldest first, and the time of the next attempt. Only the first
// delivery is sent; the others wait until it is accepted or dropped, so that "done" never arrives before
// "running". The state of a Line depends only on the deliveries added, the outcomes reported and the times
// passed in. Not thread-safe.
class Line {
 public:
  // Appends a delivery. If kMaxWaiting deliveries wait already, drops the oldest one and returns it;
  // otherwise returns nullopt.
  std::optional<Delivery> add(Delivery delivery);
  // Returns the first delivery if it should be sent now. Returns null if none waits, or if the pause before
  // its next attempt has not ended.
  const Delivery* due(TimePoint now) const;
  // Returns the time from which due() returns the first delivery; nullopt: no delivery waits.
  std::optional<TimePoint> next_due() const;
  // To be called when the receiver has accepted the delivery that due() returned. Removes this delivery from
  // the queue and returns it.
  std::optional<Delivery> taken();
  // To be called when an attempt to send that delivery has failed. After kMaxAttempts attempts, removes the
  // delivery and returns it; before, sets the time of the next attempt and returns nullopt.
  std::optional<Delivery> failed(TimePoint now);
  std::size_t waiting() const { return waiting_.size(); }
  int attempts() const { return attempts_; }  // failed attempts of the first delivery

 private:
  Delivery pop();
  std::deque<Delivery> waiting_;
  int attempts_ = 0;
  TimePoint not_before_{};
};

// Returns the pause in seconds after this many failed attempts (at least 1).
double retry_seconds(int attempts);

// Reads and writes the files of the folder DIR.
class Outbox {
 public:
  static Result<Outbox> open(std::filesystem::path folder, const std::vector<std::string>& urls);

  // Returns the stored deliveries to one receiver, ascending by number. `receiver` is an index of the list
  // `urls` that open() got. Files that do not contain a delivery are skipped and stay in the folder.
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
