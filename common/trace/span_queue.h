// A queue of spans to send. It depends only on the calls of its functions and the times passed to them. It is
// bounded: if it is full, a new span is dropped and counted. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "common/trace/span.h"

namespace ls::trace {

inline constexpr std::size_t kMaxWaiting = 8192;  // spans, about 0.5 KB each
inline constexpr std::size_t kMaxBatch = 512;     // spans in one request
inline constexpr double kCollectSeconds = 1;      // time from the first span of a batch until it is sent
inline constexpr int kMaxSendings = 5;            // attempts to send a batch; then it is dropped
inline constexpr double kFirstPauseSeconds = 1;   // after a failed attempt; each further failure doubles it

struct Figures {
  std::uint64_t sent = 0;      // spans that the collector took
  std::uint64_t left_out = 0;  // spans dropped because the queue was full
  std::uint64_t refused = 0;   // spans that the collector rejected, or did not take in kMaxSendings attempts
};

class SpanQueue {
 public:
  void add(Span span, TimePoint now);
  // Returns the batch to send now; empty: there is none, or its time has not come. The reference is valid
  // until the next call of a non-const function other than add().
  const std::vector<Span>& due(TimePoint now);
  // Returns the time from which due() will return a batch; nullopt: no span waits.
  std::optional<TimePoint> next_due() const;
  // Makes all waiting spans due at once and without pauses. Called when the program ends.
  void hurry() { hurried_ = true; }

  // When sending the batch of due() has ended, call one of these three:
  void taken(std::uint64_t rejected);              // the collector took it, except for `rejected` spans
  void failed(TimePoint now);                      // the batch may be sent again
  void refused();                                  // the batch is dropped: it would be refused again
  bool in_trouble() const { return in_trouble_; }  // the last attempt to send a batch failed

  const Figures& figures() const { return figures_; }

 private:
  std::deque<Span> waiting_;
  std::vector<Span> batch_;  // being sent, or to be sent again
  int attempts_ = 0;         // failed attempts to send batch_
  int failures_ = 0;         // failed attempts since the collector's last answer; each lengthens the pause
  bool in_trouble_ = false;
  TimePoint not_before_{};  // earliest time of the next attempt
  TimePoint first_at_{};    // when waiting_ got its first span, or last gave a batch
  bool hurried_ = false;
  Figures figures_;
};

}  // namespace ls::trace
