// A queue of spans (named time intervals of a job, span.h) that are to be sent to the collector of traces, in
// batches. It reads no clock: the caller passes the times. It is bounded: if it is full, a new span is
// dropped and counted. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/base/clock.h"
#include "util/trace/span.h"

namespace ls::trace {

inline constexpr std::size_t kMaxWaiting = 8192;  // most spans in the queue; each takes about 0.5 KB
inline constexpr std::size_t kMaxBatch = 512;     // most spans in one request
inline constexpr double kCollectSeconds = 1;      // longest wait for a batch to become full
inline constexpr int kMaxSendings = 5;            // a batch is dropped after this number of failed attempts
inline constexpr double kFirstPauseSeconds = 1;   // pause after a failed attempt; further failures double it

struct Figures {
  std::uint64_t sent = 0;      // spans that the collector accepted
  std::uint64_t left_out = 0;  // spans dropped because the queue was full
  std::uint64_t refused = 0;   // spans that the collector rejected or did not accept in kMaxSendings attempts
};

class SpanQueue {
 public:
  void add(Span span, TimePoint now);
  // Returns the batch to send now; empty: there is no span, or it is too early to send. The reference is
  // valid until the next call of a non-const function other than add().
  const std::vector<Span>& due(TimePoint now);
  // Returns the earliest time at which due() will return a batch; nullopt: no span is to be sent.
  std::optional<TimePoint> next_due() const;
  // From now on all spans are due at once, without any pause. Called when the program ends.
  void hurry() { hurried_ = true; }

  // After an attempt to send the batch of due(), call one of these three functions.
  void taken(std::uint64_t rejected);  // the collector accepted all but `rejected` spans
  void failed(TimePoint now);          // the attempt failed, but may be repeated
  void refused();                      // the collector refused the batch for good, so it is dropped
  bool in_trouble() const { return in_trouble_; }  // true if the last attempt to send a batch did not succeed

  const Figures& figures() const { return figures_; }

 private:
  std::deque<Span> waiting_;
  std::vector<Span> batch_;  // the batch that is being sent, or is to be sent again
  int attempts_ = 0;         // failed attempts to send batch_
  int failures_ = 0;         // calls of failed() since the last taken() or refused(); each doubles the pause
  bool in_trouble_ = false;
  TimePoint not_before_{};  // earliest time of the next attempt
  TimePoint first_at_{};    // when waiting_ got its first span, or when a batch was last taken from it
  bool hurried_ = false;
  Figures figures_;
};

}  // namespace ls::trace
