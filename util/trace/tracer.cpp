#include "util/trace/tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <random>

#include "core/base/log.h"
#include "util/trace/otlp.h"

namespace ls::trace {
namespace {

constexpr double kLastSeconds = 2;  // time limit for sending the waiting spans at the end of the program
constexpr double kComplaintSeconds = 60;  // shortest time between two warnings about the collector in the log
constexpr std::size_t kMostAnswer = 64 << 10;
// If the difference between wall clock and monotonic clock changes by more than this, the wall clock was set
// or the machine slept, and the new difference is used. Smaller changes are errors of measurement.
constexpr std::int64_t kClockStepNs = 100'000'000;
constexpr int kClockReadings = 5;

std::int64_t count(TimePoint at) { return at.time_since_epoch().count(); }

std::uint64_t random_number() {
  std::random_device device;
  return std::uint64_t{device()} << 32 | device();
}

// Maps 64-bit numbers one to one, so that consecutive arguments give values that look random (the finalizer
// of SplitMix64, Steele et al. 2014, "Fast splittable pseudorandom number generators").
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

// True for an HTTP status after which OTLP allows the client to repeat the request.
bool may_pass(int status) { return status == 429 || status == 502 || status == 503 || status == 504; }

}  // namespace

Tracer::Tracer(Options options) : options_(std::move(options)), ids_(random_number()) {
  if (!options_.send) options_.send = &post;
  resource_.attributes = {{"service.name", options_.settings.service}, {"service.version", options_.version}};
  if (!options_.instance.empty()) resource_.attributes.emplace_back("service.instance.id", options_.instance);
  auto& all = resource_.attributes;  // no two attributes may have the same key
  for (const auto& pair : options_.settings.resource)
    if (std::none_of(all.begin(), all.end(), [&](const auto& known) { return known.first == pair.first; }))
      all.push_back(pair);
  set_clock();
  thread_ = std::jthread([this](const std::stop_token& token) { send_loop(token); });
}

Tracer::~Tracer() {
  ending_ = true;
  thread_.request_stop();
}

void Tracer::record(Span span) {
  const auto queue = queue_.lock();
  const bool slept = !queue->next_due();
  queue->add(std::move(span), options_.clock->now());
  if (slept || queue->next_due() == TimePoint{}) came_.notify_one();
}

SpanId Tracer::new_span_id() {
  std::uint64_t number = 0;
  while (number == 0) number = mixed(ids_.fetch_add(1));
  SpanId id;
  for (auto& byte : id.bytes) byte = static_cast<std::uint8_t>(number), number >>= 8;
  return id;
}

std::int64_t Tracer::unix_ns(TimePoint at) const { return count(at) + offset_ns_; }

Figures Tracer::figures() const { return queue_.lock()->figures(); }

// Measures the difference between the wall clock and the monotonic clock. This function is called again and
// again, since the difference changes if the wall clock is set, and while the machine sleeps, when the
// monotonic clock stops.
void Tracer::set_clock() {
  std::int64_t offset = 0, narrowest = std::numeric_limits<std::int64_t>::max();
  // The wall clock is read several times, each time between two readings of the monotonic clock. The result
  // is taken from the attempt whose two monotonic readings are closest, since it was interrupted least.
  for (int i = 0; i < kClockReadings; ++i) {
    const std::int64_t before = count(options_.clock->now()), wall = options_.unix_ns(),
                       after = count(options_.clock->now());
    if (after - before >= narrowest) continue;
    narrowest = after - before;
    offset = wall - before - narrowest / 2;
  }
  if (std::abs(offset - offset_ns_) > kClockStepNs) offset_ns_ = offset;
}

void Tracer::send_loop(const std::stop_token& token) {
  auto queue = queue_.lock();
  for (;;) {
    const TimePoint now = options_.clock->now();
    if (token.stop_requested()) {
      if (!ending_since_) ending_since_ = now;
      const bool late = seconds(now - *ending_since_) > kLastSeconds;
      if (queue->in_trouble() || late || !queue->next_due()) return;
      queue->hurry();
    }
    if (const auto& batch = queue->due(now); !batch.empty()) {
      queue.unlock();
      send(batch);
      queue.lock();
      continue;
    }
    const auto until = queue->next_due();
    const auto sooner = [&] {
      const auto at = queue->next_due();
      return at && (!until || *at < *until);
    };
    if (until)
      came_.wait_for(queue, token, *until - now, sooner);
    else
      came_.wait(queue, token, sooner);
    queue.unlock();
    set_clock();
    queue.lock();
  }
}

void Tracer::send(const std::vector<Span>& batch) {
  HttpPost request{.url = options_.settings.url,
                   .headers = {{"Content-Type", "application/json"}, {"User-Agent", "lightshaft"}},
                   .body = otlp_request(resource_, batch),
                   .seconds = ending_ ? kLastSeconds : options_.settings.seconds,
                   .most_answer_bytes = kMostAnswer,
                   .ca_file = options_.settings.ca_file,
                   .give_up = [this] {
                     if (!ending_) return false;
                     if (!ending_since_) ending_since_ = options_.clock->now();
                     return seconds(options_.clock->now() - *ending_since_) > kLastSeconds;
                   }};
  request.headers.insert(request.headers.end(), options_.settings.headers.begin(),
                         options_.settings.headers.end());
  settle(options_.send(request));
}

void Tracer::settle(const Result<HttpAnswer>& answer) {
  std::string trouble;
  {
    const auto queue = queue_.lock();
    if (answer && answer->status / 100 == 2) {
      const PartialSuccess partial = otlp_partial_success(answer->body);
      queue->taken(partial.rejected);
      if (partial.rejected > 0)
        trouble = fmt::format("it rejected {} spans: {}", partial.rejected, partial.message);
    } else if (answer && !may_pass(answer->status)) {
      queue->refused();
      trouble = fmt::format("it answers {}", answer->status);
    } else {
      queue->failed(options_.clock->now());
      trouble = answer ? fmt::format("it answers {}", answer->status) : answer.error().message;
    }
  }
  if (!trouble.empty()) complain(trouble);
}

void Tracer::complain(const std::string& why) {
  const TimePoint now = options_.clock->now();
  if (last_complaint_ && seconds(now - *last_complaint_) < kComplaintSeconds) return;
  last_complaint_ = now;
  const Figures f = figures();
  log_warn("",
           fmt::format("the collector of traces does not take all spans: {}; {} sent, {} refused, {} left "
                       "out; check OTEL_EXPORTER_OTLP_ENDPOINT and the collector",
                       why, f.sent, f.refused, f.left_out));
}

Result<std::shared_ptr<Tracer>> tracer_from_environment(const std::string& program,
                                                        const std::string& version,
                                                        const std::string& instance) {
  auto settings = settings_from([](const char* name) { return std::getenv(name); }, program);
  if (!settings) return tl::unexpected(settings.error());
  if (!*settings) return nullptr;
  return std::make_shared<Tracer>(Tracer::Options{.settings = std::move(**settings),
                                                  .version = version,
                                                  .instance = instance,
                                                  .clock = std::make_shared<SystemClock>(),
                                                  .unix_ns = &system_unix_ns});
}

}  // namespace ls::trace
