// Records spans and sends them to a collector, on a thread of its own. Recording takes a short lock and never
// waits for the collector: if the collector refuses spans, hangs or is unreachable, they are dropped and
// counted. A program without tracing has a null pointer instead of a Tracer.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/base/clock.h"
#include "core/base/guarded.h"
#include "util/http/post.h"
#include "util/trace/otel_settings.h"
#include "util/trace/span.h"
#include "util/trace/span_queue.h"

namespace ls::trace {

class Tracer {
 public:
  struct Options {
    Settings settings;
    std::string version;  // version of this program
    // The attribute service.instance.id, which distinguishes several processes of this program, such as the
    // name of a worker; empty: the attribute is not sent.
    std::string instance;
    std::shared_ptr<const Clock> clock;
    std::function<std::int64_t()> unix_ns;  // reads the wall clock, in nanoseconds since 1970
    // Sends an HTTP request and returns the answer; empty: ls::post is used.
    std::function<Result<HttpAnswer>(const HttpPost&)> send = {};
  };
  explicit Tracer(Options options);
  // Sends the waiting spans, but gives up after kLastSeconds (tracer.cpp).
  ~Tracer();

  // Adds the span to the queue of spans to send. The span's trace must be sampled. Thread-safe.
  void record(Span span);
  SpanId new_span_id();
  // Converts a time of the injected clock to nanoseconds since 1970. In one process a later time gives a
  // later result, unless the wall clock was set or the machine slept in between.
  std::int64_t unix_ns(TimePoint at) const;
  const Sampler& sampler() const { return options_.settings.sampler; }
  Figures figures() const;

 private:
  void send_loop(const std::stop_token& token);
  void send(const std::vector<Span>& batch);
  void settle(const Result<HttpAnswer>& answer);
  void complain(const std::string& why);
  void set_clock();

  Options options_;
  Resource resource_;
  // Offset in nanoseconds: a time of options_.clock plus this offset is the time since 1970.
  std::atomic<std::int64_t> offset_ns_{0};
  std::atomic<std::uint64_t> ids_;
  mutable Guarded<SpanQueue> queue_;
  std::condition_variable_any came_;
  std::atomic<bool> ending_{false};
  // Both are used by the sending thread only.
  std::optional<TimePoint> last_complaint_, ending_since_;
  std::jthread thread_;
};

// Returns a tracer if environment variables name a collector (otel_settings.h), otherwise a null pointer.
// `program` and `version` are the name and the version of this program.
Result<std::shared_ptr<Tracer>> tracer_from_environment(const std::string& program,
                                                        const std::string& version,
                                                        const std::string& instance);

}  // namespace ls::trace
