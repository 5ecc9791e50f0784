// A collector of traces without a network: it gives a tracer's requests the answer that the test has set, and
// keeps their spans.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/fake_clock.h"
#include "util/trace/tracer.h"

namespace ls::test {

struct CollectedSpan {
  std::string name, trace, id, parent;  // parent: empty for the first span of a trace
  std::int64_t start_ns = 0, end_ns = 0;
  nlohmann::json json;
};

class SpanCollector {
 public:
  static constexpr std::int64_t kUnixNs = 1'700'000'000'000'000'000;  // when the fake clock shows 0

  // A tracer whose wall clock follows `clock`.
  std::shared_ptr<trace::Tracer> tracer(std::shared_ptr<const Clock> clock = std::make_shared<SystemClock>(),
                                        trace::Sampler sampler = {}) {
    trace::Settings settings;
    settings.url = "http://collector/v1/traces";
    settings.headers = {{"api-key", "k"}};
    settings.service = "tested";
    settings.sampler = sampler;
    return std::make_shared<trace::Tracer>(
        trace::Tracer::Options{.settings = settings,
                               .version = "1",
                               .instance = "one",
                               .clock = clock,
                               .unix_ns =
                                   [clock] {
                                     const bool fake = dynamic_cast<const FakeClock*>(clock.get()) != nullptr;
                                     const auto now = clock->now().time_since_epoch().count();
                                     return fake ? kUnixNs + now : system_unix_ns();
                                   },
                               .send = [this](const HttpPost& request) { return take(request); }});
  }

  Result<HttpAnswer> take(const HttpPost& request) {
    const std::lock_guard lock(mutex_);
    requests.push_back(request);
    came_.notify_all();
    if (!answer || answer->status != 200) return answer;
    const auto body = nlohmann::json::parse(request.body);
    for (const auto& span : body["resourceSpans"][0]["scopeSpans"][0]["spans"])
      spans_.push_back({span["name"], span["traceId"], span["spanId"], span.value("parentSpanId", ""),
                        std::stoll(span["startTimeUnixNano"].get<std::string>()),
                        std::stoll(span["endTimeUnixNano"].get<std::string>()), span});
    return answer;
  }
  std::vector<CollectedSpan> spans() const {
    const std::lock_guard lock(mutex_);
    return spans_;
  }
  std::vector<CollectedSpan> named(const std::string& name) const {
    auto all = spans();
    std::erase_if(all, [&](const CollectedSpan& span) { return span.name != name; });
    return all;
  }
  // Returns false if fewer than `count` requests have come within two minutes.
  bool wait_for_requests(std::size_t count) {
    std::unique_lock lock(mutex_);
    return came_.wait_for(lock, std::chrono::minutes(2), [&] { return requests.size() >= count; });
  }

  Result<HttpAnswer> answer = HttpAnswer{200, "{}"};
  std::vector<HttpPost> requests;

 private:
  mutable std::mutex mutex_;
  std::condition_variable came_;
  std::vector<CollectedSpan> spans_;
};

}  // namespace ls::test
