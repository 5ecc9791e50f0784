// Converts received protobuf messages to the structs of util/protocol/messages.h. Every field is checked,
// because senders are not trusted.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/safe_text.h"
#include "proto/convert.h"

// Defines `name` as the value of `expression`, a Result; if that is an error, the enclosing function returns
// the error.
#define LS_TRY(name, expression)                                   \
  auto name##_or = (expression);                                   \
  if (!name##_or) return tl::unexpected<Error>(name##_or.error()); \
  auto& name = *name##_or

namespace ls::wire {
namespace {

// ---- checks: each returns an error that names `field` if the value is wrong ----

tl::unexpected<Error> wrong(const std::string& field, const std::string& what) {
  return bad_argument(fmt::format("bad message: {} {}", field, what));
}

// Returns the id, which must be 1 to kIdBytes printable ASCII characters without spaces.
Result<std::string> id_from(const std::string& text, const char* field) {
  if (text.empty()) return wrong(field, "is missing");
  if (text.size() > limits::kIdBytes)
    return wrong(field, fmt::format("has {} bytes; at most {} are allowed", text.size(), limits::kIdBytes));
  for (const char c : text)
    if (c <= ' ' || c > '~') return wrong(field, "has a character that is not printable ASCII");
  return text;
}

// Returns the text, which must have at most `limit` bytes. Characters that would control the terminal on
// which the text is shown, or reorder its letters, are replaced by spaces. Line breaks stay.
Result<std::string> lines_from(const std::string& text, std::size_t limit, const char* field) {
  if (text.size() > limit)
    return wrong(field, fmt::format("has {} bytes; at most {} are allowed", text.size(), limit));
  return plain_lines(text);
}

// The same for a text of one line.
Result<std::string> text_from(const std::string& text, std::size_t limit, const char* field) {
  LS_TRY(lines, lines_from(text, limit, field));
  std::ranges::replace(lines, '\n', ' ');
  return lines;
}

// Returns a secret or a part of one, which is never shown.
Result<std::string> secret_from(const std::string& text, const char* field) {
  if (text.size() > limits::kTokenBytes) return wrong(field, "is too long");
  return text;
}

Result<double> seconds_from(double value, const char* field) {
  if (!(value >= 0 && value <= limits::kSeconds))
    return wrong(field,
                 fmt::format("is {}; it must be a time in seconds, at most {}", value, limits::kSeconds));
  return value;
}

Result<PixelRect> rect_from(const pb::Rect& rect, const char* field) {
  const PixelRect r{rect.x0(), rect.y0(), rect.x1(), rect.y1()};
  const bool inside = r.x0 >= 0 && r.y0 >= 0 && r.x1 <= limits::kFrameSide && r.y1 <= limits::kFrameSide;
  if (!inside || r.x0 >= r.x1 || r.y0 >= r.y1)
    return wrong(field,
                 fmt::format("[{}, {}) x [{}, {}) is empty or outside any frame", r.x0, r.x1, r.y0, r.y1));
  return r;
}

Result<SampleRange> range_from(std::uint64_t s0, std::uint64_t s1, const char* field) {
  if (s0 % 2 != 0 || s1 % 2 != 0 || s0 >= s1 || s1 > limits::kSampleIndex)
    return wrong(field, fmt::format("[{}, {}) must be a non-empty range with even ends up to {}", s0, s1,
                                    limits::kSampleIndex));
  return SampleRange{s0, s1};
}

// ---- values ----

// Returns the entries of the list `in`, each converted by `entry_from`. Returns an error if the list has more
// than `limit` entries or one of them is invalid.
template <class List, class From>
auto list_from(const List& in, std::size_t limit, const char* field, const From& entry_from)
    -> Result<std::vector<typename decltype(entry_from(*in.begin()))::value_type>> {
  if (static_cast<std::size_t>(in.size()) > limit)
    return wrong(field, fmt::format("has {} entries; at most {} are allowed", in.size(), limit));
  std::vector<typename decltype(entry_from(*in.begin()))::value_type> out;
  for (const auto& each : in) {
    LS_TRY(entry, entry_from(each));
    out.push_back(std::move(entry));
  }
  return out;
}

Result<UnitKey> key_from(const pb::UnitKey& in) {
  LS_TRY(job, id_from(in.job(), "unit.job"));
  return UnitKey{JobId{job}, in.tile(), in.round()};
}

Result<Error> problem_from(const pb::Problem& in) {
  LS_TRY(text, lines_from(in.message(), limits::kTextBytes, "problem.message"));
  const auto* code = std::ranges::find(kErrcNames, in.code());
  return Error{code == kErrcNames.end() ? Errc::internal : static_cast<Errc>(code - kErrcNames.begin()),
               text};
}

Result<LeaseUnit> lease_unit_from(const pb::LeaseUnit& in) {
  LS_TRY(rect, rect_from(in.rect(), "units.rect"));
  LS_TRY(samples, range_from(in.s0(), in.s1(), "units.s0,s1"));
  return LeaseUnit{in.tile(), in.round(), rect, samples};
}

Result<BlobRef> asset_from(const pb::Blob& in) {
  LS_TRY(digest, digest_from(in.digest(), "brief.assets.digest"));
  LS_TRY(name, text_from(in.name(), limits::kNameBytes, "brief.assets.name"));
  return BlobRef{digest, in.bytes(), name};
}

Result<JobBrief> brief_from(const pb::JobBrief& in) {
  LS_TRY(job, id_from(in.job(), "brief.job"));
  LS_TRY(scene, digest_from(in.scene(), "brief.scene"));
  if (in.settings().size() > limits::kSettingsBytes) return wrong("brief.settings", "is too long");
  LS_TRY(settings, parse_render_settings(in.settings()));
  LS_TRY(assets, list_from(in.assets(), limits::kAssetsPerJob, "brief.assets", asset_from));
  LS_TRY(needs, lines_from(in.needs(), limits::kNeedsBytes, "brief.needs"));
  return JobBrief{JobId{job}, scene, settings, digest_of(settings), std::move(assets), needs};
}

Result<FromWorker> hello_from(const pb::Hello& in) {
  WorkerHello hello;
  LS_TRY(name, text_from(in.name(), limits::kNameBytes, "hello.name"));
  if (name.empty()) return wrong("hello.name", "is missing");
  LS_TRY(build, text_from(in.build(), limits::kNameBytes, "hello.build"));
  LS_TRY(numeric_class, digest_from(in.numeric_class(), "hello.numeric_class"));
  LS_TRY(platform, text_from(in.platform(), limits::kNameBytes, "hello.platform"));
  if (in.threads() < 1 || in.threads() > limits::kThreads)
    return wrong("hello.threads", fmt::format("is {}; it must be 1 to {}", in.threads(), limits::kThreads));
  LS_TRY(token, secret_from(in.join_token(), "hello.join_token"));
  LS_TRY(secret, secret_from(in.secret(), "hello.secret"));
  if (in.has_secret()) hello.secret = secret;
  const auto tag_from = [](const std::string& tag) {
    return text_from(tag, limits::kNameBytes, "hello.tags");
  };
  LS_TRY(tags, list_from(in.tags(), limits::kTags, "hello.tags", tag_from));
  const auto blob_from = [](const std::string& blob) { return digest_from(blob, "hello.blobs_held"); };
  LS_TRY(blobs, list_from(in.blobs_held(), limits::kBlobsHeld, "hello.blobs_held", blob_from));
  hello.tags = std::move(tags);
  hello.blobs_held = std::move(blobs);
  if (!in.previous_id().empty()) {
    LS_TRY(previous, id_from(in.previous_id(), "hello.previous_id"));
    hello.previous_id = WorkerId{previous};
  }
  hello.protocol = in.protocol();
  hello.name = name;
  hello.build = build;
  hello.numeric_class = numeric_class;
  hello.threads = in.threads();
  hello.memory_bytes = in.memory_bytes();
  hello.join_token = token;
  hello.fake = in.fake();
  hello.platform = platform;
  hello.brief_bytes = in.brief_bytes();
  hello.restarts = in.restarts();
  return hello;
}

Result<WorkerProgress::Entry> entry_from(const pb::Progress::Entry& in) {
  LS_TRY(lease, id_from(in.lease(), "progress.leases.lease"));
  return WorkerProgress::Entry{LeaseId{lease}, in.units_done()};
}

Result<FromWorker> progress_from(const pb::Progress& in) {
  LS_TRY(leases, list_from(in.leases(), limits::kLeasesPerWorker, "progress.leases", entry_from));
  LS_TRY(activity, text_from(in.activity(), limits::kNameBytes, "progress.activity"));
  LS_TRY(cpu, seconds_from(in.cpu_seconds_total(), "progress.cpu_seconds_total"));
  LS_TRY(load, seconds_from(in.load_seconds(), "progress.load_seconds"));
  return WorkerProgress{std::move(leases), activity, cpu, in.rss_bytes(), load};
}

Result<Health> health_from(const pb::UnitResult& in) {
  if (in.health().empty() && in.nonfinite() == 0 && in.negative() == 0 && in.majorant_violations() == 0)
    return Health{};
  auto health = parse_health(in.health().empty() ? "{}" : in.health());
  if (!health) return wrong("result.health", health.error().message);
  // A newer worker may count a cause that this version does not know. Then its counts nonfinite, negative and
  // majorant_violations are larger than the counts of the causes in `health`. Each excess is added to one
  // cause: unnamed for nonfinite, negative, or majorant_violation.
  const auto rest = [](std::uint64_t stated, std::uint64_t named) {
    return stated > named ? stated - named : 0;
  };
  health->add(HealthCause::unnamed, rest(in.nonfinite(), health->nonfinite));
  health->add(HealthCause::negative, rest(in.negative(), health->negative));
  health->add(HealthCause::majorant_violation, rest(in.majorant_violations(), health->majorant_violations));
  return health;
}

Result<UnitTimes> times_from(const pb::UnitTimes& in) {
  LS_TRY(load, seconds_from(in.load(), "result.times.load"));
  LS_TRY(build, seconds_from(in.build(), "result.times.build"));
  LS_TRY(transfer, seconds_from(in.transfer(), "result.times.transfer"));
  LS_TRY(idle, seconds_from(in.idle(), "result.times.idle"));
  LS_TRY(wait, seconds_from(in.wait(), "result.times.wait"));
  return UnitTimes{load, build, transfer, idle, wait};
}

Result<FromWorker> result_from(const pb::UnitResult& in) {
  LS_TRY(unit, key_from(in.unit()));
  LS_TRY(lease, id_from(in.lease(), "result.lease"));
  LS_TRY(digest, digest_from(in.digest(), "result.digest"));
  LS_TRY(cpu, seconds_from(in.cpu_seconds(), "result.cpu_seconds"));
  if (in.exr().empty() || in.exr().size() > limits::kPartialBytes)
    return wrong("result.exr",
                 fmt::format("has {} bytes; 1 to {} are allowed", in.exr().size(), limits::kPartialBytes));
  LS_TRY(health, health_from(in));
  LS_TRY(times, times_from(in.times()));
  const auto* bytes = reinterpret_cast<const std::byte*>(in.exr().data());
  return UnitResult{unit,
                    LeaseId{lease},
                    {bytes, bytes + in.exr().size()},
                    digest,
                    cpu,
                    std::move(health),
                    times,
                    TechniqueSet::of_bits(in.techniques()),
                    in.held_unix_ns()};
}

Result<FromWorker> failure_from(const pb::UnitFailure& in) {
  UnitFailure failure;
  LS_TRY(unit, key_from(in.unit()));
  LS_TRY(lease, id_from(in.lease(), "failure.lease"));
  LS_TRY(reason, lines_from(in.reason(), limits::kTextBytes, "failure.reason"));
  failure.unit = unit;
  failure.lease = LeaseId{lease};
  failure.scene_at_fault = in.scene_at_fault();
  failure.reason = reason;
  if (in.has_signal()) failure.signal = in.signal();
  if (in.has_pixel_x() && in.has_pixel_y()) failure.pixel = {in.pixel_x(), in.pixel_y()};
  if (in.has_sample()) failure.sample = in.sample();
  return failure;
}

Result<FromWorker> draining_from(const pb::Draining& in) {
  LS_TRY(refused, text_from(in.refused(), limits::kTextBytes, "draining.refused"));
  return WorkerDraining{in.withdrawn(), in.restarts(), sendable(refused, limits::kReasonBytes)};
}

Result<FromWorker> returned_from(const pb::LeaseReturned& in) {
  LS_TRY(lease, id_from(in.lease(), "returned.lease"));
  LS_TRY(units, list_from(in.units(), limits::kUnitsPerLease, "returned.units", key_from));
  LS_TRY(reason, text_from(in.reason(), limits::kTextBytes, "returned.reason"));
  return LeaseReturned{LeaseId{lease}, std::move(units), sendable(reason, limits::kReasonBytes),
                       in.unknown_job()};
}

Result<ToWorker> assign_from(const pb::AssignLease& in) {
  AssignLease assign;
  LS_TRY(lease, id_from(in.lease(), "assign.lease"));
  LS_TRY(job, id_from(in.job(), "assign.job"));
  LS_TRY(units, list_from(in.units(), limits::kUnitsPerLease, "assign.units", lease_unit_from));
  assign.lease = {LeaseId{lease}, JobId{job}, std::move(units)};
  if (in.has_brief()) {
    LS_TRY(brief, brief_from(in.brief()));
    if (brief.job != assign.lease.job) return wrong("assign.brief", "is of another job");
    assign.brief = brief;
  }
  assign.trace = trace::parse_traceparent(in.traceparent());
  return assign;
}

Result<ToWorker> ack_from(const pb::ResultAck& in) {
  ResultAck ack;
  LS_TRY(unit, key_from(in.unit()));
  ack.unit = unit;
  if (in.has_refused()) {
    LS_TRY(problem, problem_from(in.refused()));
    ack.refused = problem;
  }
  return ack;
}

}  // namespace

bool known(const pb::FromWorker& in) { return in.message_case() != pb::FromWorker::MESSAGE_NOT_SET; }
bool known(const pb::ToWorker& in) { return in.message_case() != pb::ToWorker::MESSAGE_NOT_SET; }

Result<FromWorker> from_wire(const pb::FromWorker& in) {
  switch (in.message_case()) {
    case pb::FromWorker::kHello:
      return hello_from(in.hello());
    case pb::FromWorker::kProgress:
      return progress_from(in.progress());
    case pb::FromWorker::kResult:
      return result_from(in.result());
    case pb::FromWorker::kFailure:
      return failure_from(in.failure());
    case pb::FromWorker::kReturned:
      return returned_from(in.returned());
    case pb::FromWorker::kDraining:
      return draining_from(in.draining());
    case pb::FromWorker::MESSAGE_NOT_SET:
      break;
  }
  return wrong("message", "is empty or of a kind that this version does not know");
}

Result<ToWorker> from_wire(const pb::ToWorker& in) {
  switch (in.message_case()) {
    case pb::ToWorker::kWelcome: {
      LS_TRY(worker, id_from(in.welcome().worker(), "welcome.worker"));
      LS_TRY(secret, secret_from(in.welcome().secret(), "welcome.secret"));
      return Welcome{WorkerId{worker}, in.welcome().epoch(), secret};
    }
    case pb::ToWorker::kRefused: {
      LS_TRY(problem, problem_from(in.refused().problem()));
      return Refused{problem, in.refused().retry()};
    }
    case pb::ToWorker::kAssign:
      return assign_from(in.assign());
    case pb::ToWorker::kAck:
      return ack_from(in.ack());
    case pb::ToWorker::kCancelJob: {
      LS_TRY(job, id_from(in.cancel_job().job(), "cancel_job.job"));
      return CancelJob{JobId{job}};
    }
    case pb::ToWorker::kCancelLease: {
      LS_TRY(lease, id_from(in.cancel_lease().lease(), "cancel_lease.lease"));
      return CancelLease{LeaseId{lease}};
    }
    case pb::ToWorker::kRecallLease: {
      LS_TRY(lease, id_from(in.recall_lease().lease(), "recall_lease.lease"));
      return RecallLease{LeaseId{lease}};
    }
    case pb::ToWorker::kDrain:
      return DrainNow{in.drain().withdrawn(), in.drain().restart()};
    case pb::ToWorker::MESSAGE_NOT_SET:
      break;
  }
  return wrong("message", "is empty or of a kind that this version does not know");
}

Result<Digest> digest_from(const std::string& bytes, const char* field) {
  Digest digest;
  if (bytes.size() != digest.bytes.size())
    return wrong(field, fmt::format("has {} bytes; a SHA-256 has 32", bytes.size()));
  std::copy(bytes.begin(), bytes.end(), digest.bytes.begin());
  return digest;
}

}  // namespace ls::wire
