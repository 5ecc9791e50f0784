#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "coordinator/store/jobs/job_store.h"
#include "core/scene/schema/describe.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

// JSON has no infinity and no NaN: the JSON library would write null instead, which could not be read back as
// a number. So finite() replaces these values by 0.
double finite(double value) { return std::isfinite(value) ? value : 0; }
// Returns the number `j`. JSON that earlier versions wrote may have null where finite() now gives 0; this is
// read as 0.
double number_of(const json& j) { return j.is_null() ? 0 : j.get<double>(); }
// Throws unless the value is an integer from 0 to 2^64 - 1. Without this check the JSON library would convert
// even 1e20, which does not fit into 64 bits.
std::uint64_t count_of(const json& j) {
  if (!j.is_number_unsigned()) throw std::invalid_argument("a count is not an integer from 0 to 2^64 - 1");
  return j.get<std::uint64_t>();
}

// Throws unless the value is an integer that T can have.
template <class T>
T whole(const json& j) {
  if (j.is_number_unsigned() ? !std::in_range<T>(j.get<std::uint64_t>())
                             : !j.is_number_integer() || !std::in_range<T>(j.get<std::int64_t>()))
    throw std::invalid_argument("a number is not an integer in the range of its field");
  return j.get<T>();
}

// Invalid UTF-8, which may come from a worker's name or message, is replaced, so that dump() never throws.
std::string dumped(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

// Parses the text as JSON, passes the value to read() and returns the result. If parsing or read() throws,
// returns an error whose message begins with `what`.
template <class Read>
auto decoded(std::string_view text, std::string_view what, Read read) -> Result<decltype(read(json()))> {
  try {
    return read(json::parse(text));
  } catch (const std::exception& e) {
    return fail(Errc::internal, fmt::format("{}: {}", what, e.what()));
  }
}

constexpr std::pair<const char*, double JobTotals::*> kReals[] = {
    {"render_seconds", &JobTotals::render_seconds}, {"core_seconds", &JobTotals::core_seconds},
    {"load_seconds", &JobTotals::load_seconds},     {"spp_done", &JobTotals::spp_done},
    {"began_unix", &JobTotals::began_unix},         {"ended_unix", &JobTotals::ended_unix}};
constexpr std::pair<const char*, std::uint64_t JobTotals::*> kCounts[] = {
    {"peak_rss_bytes", &JobTotals::peak_rss_bytes},
    {"units", &JobTotals::units},
    {"units_planned", &JobTotals::units_planned}};

json to_value(const JobTotals& t) {
  json j{{"health", json::parse(canonical_json(t.health))},
         {"doubt", t.doubt},
         {"lit", t.lit},
         {"few_hits", t.few_hits ? json(*t.few_hits) : json()}};
  for (const auto& [name, member] : kReals) j[name] = finite(t.*member);
  for (const auto& [name, member] : kCounts) j[name] = t.*member;
  for (const TimePart& part : kTimeParts) j["time"][part.name] = finite(t.time.*part.seconds);
  return j;
}

// Returns the counter with this key; 0 if the key is missing, since counters of 0 are not stored.
std::uint64_t count_or_none(const json& j, const char* key) {
  const auto found = j.find(key);
  return found == j.end() ? 0 : count_of(*found);
}

template <class T>
T required(Result<T> parsed) {
  if (!parsed) throw std::invalid_argument(parsed.error().message);
  return std::move(*parsed);
}

JobTotals totals_of(const json& j) {
  JobTotals t;
  for (const auto& [name, member] : kReals) t.*member = number_of(j.at(name));
  for (const auto& [name, member] : kCounts) t.*member = count_of(j.at(name));
  for (const TimePart& part : kTimeParts) t.time.*part.seconds = number_of(j.at("time").at(part.name));
  t.health = required(parse_health(j.at("health").dump()));
  t.doubt = j.at("doubt");
  t.lit = j.value("lit", true);  // records of older versions have none
  if (const json& few = j.at("few_hits"); !few.is_null()) t.few_hits = count_of(few);
  return t;
}

Digest digest_from(const json& j) {
  const auto digest = Digest::parse(j.get_ref<const std::string&>());
  if (!digest) throw std::invalid_argument("a digest is not 64 hexadecimal digits");
  return *digest;
}

template <class Enum>
Enum enum_from(const json& j, std::initializer_list<Enum> all) {
  const auto& word = j.get_ref<const std::string&>();
  for (const Enum e : all)
    if (to_string(e) == word) return e;
  throw std::invalid_argument("unknown word '" + word + "'");
}

json to_value(const JobFailure& f) {
  json j{{"kind", to_string(f.kind)},
         {"tile", f.tile},
         {"rect", {f.rect.x0, f.rect.y0, f.rect.x1, f.rect.y1}},
         {"round", f.round},
         {"samples", {f.samples.s0, f.samples.s1}},
         {"attempts", json::array()},
         {"replay", f.replay}};
  for (const JobFailure::Attempt& a : f.attempts)
    j["attempts"].push_back({a.worker, a.reason, a.signal ? json(*a.signal) : json(),
                             a.pixel ? json{a.pixel->first, a.pixel->second} : json(),
                             a.sample ? json(*a.sample) : json()});
  return j;
}

JobFailure failure_from(const json& j) {
  JobFailure f;
  f.kind = enum_from(j.at("kind"), {FailureKind::unit, FailureKind::scene, FailureKind::no_worker});
  f.tile = whole<TileIndex>(j.at("tile"));
  const json& rect = j.at("rect");
  f.rect = {whole<int>(rect.at(0)), whole<int>(rect.at(1)), whole<int>(rect.at(2)), whole<int>(rect.at(3))};
  f.round = whole<RoundIndex>(j.at("round"));
  f.samples = {count_of(j.at("samples").at(0)), count_of(j.at("samples").at(1))};
  for (const json& a : j.at("attempts")) {
    JobFailure::Attempt& attempt = f.attempts.emplace_back();
    attempt.worker = a.at(0), attempt.reason = a.at(1);
    if (!a.at(2).is_null()) attempt.signal = whole<int>(a.at(2));
    if (const json& pixel = a.at(3); !pixel.is_null())
      attempt.pixel = {whole<int>(pixel.at(0)), whole<int>(pixel.at(1))};
    if (!a.at(4).is_null()) attempt.sample = count_of(a.at(4));
  }
  f.replay = j.at("replay");
  return f;
}

// The job's error says the same as its failure, so a record whose failure cannot be read is not damaged.
std::optional<JobFailure> failure_or_none(const json& j) {
  try {
    return failure_from(j);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

MeterKind meter_kind_of(const json& name) {
  for (const auto& [known, kind] : scene::NamesOf<MeterKind>::all)
    if (name == known) return kind;
  throw std::invalid_argument("the kind of a meter");
}

CameraMatrices camera_of(const json& j) {
  const auto matrix = [](const json& from) {
    RowMatrix m{};
    for (std::size_t i = 0; i < m.size(); ++i) m[i] = from.at(i).get<double>();
    return m;
  };
  CameraMatrices camera{matrix(j.at(0)), std::nullopt};
  if (j.size() > 1) camera.world_to_ndc = matrix(j.at(1));
  return camera;
}

StoredJob stored_from(const json& j) {
  StoredJob job;
  job.id.value = j.at("id");
  job.name = j.at("name");
  job.scene_name = j.value("scene_name", std::string());
  job.owner = j.at("owner");
  job.submitted_unix = j.at("submitted_unix");
  job.traceparent = j.value("traceparent", std::string());
  job.scene = digest_from(j.at("scene"));
  job.settings = required(parse_render_settings(j.at("settings").get<std::string>()));
  job.spec = required(parse_job_spec(j.at("spec").get<std::string>()));
  if (!j.at("spp").is_null()) job.spp = count_of(j.at("spp"));
  for (const auto& a : j.at("assets"))
    job.assets.push_back({digest_from(a.at("digest")), count_of(a.at("bytes")), a.at("name")});
  if (const auto meters = j.find("meters"); meters != j.end())
    for (const json& m : *meters) job.meters.push_back({m.at(0), meter_kind_of(m.at(1)), m.at(2)});
  job.warnings = j.at("warnings");
  job.reference_same_seed = j.value("reference_same_seed", false);
  job.features_used = j.at("features_used");
  job.features_left_out = j.at("features_left_out");
  job.needs = j.at("needs");
  job.analysis = j.at("analysis");
  if (const auto camera = j.find("camera"); camera != j.end()) job.camera = camera_of(*camera);
  job.state = enum_from(j.at("state"), {JobState::queued, JobState::running, JobState::paused, JobState::done,
                                        JobState::failed, JobState::cancelled});
  if (!j.at("stopped").is_null())
    job.stopped =
        enum_from(j.at("stopped"), {StopReason::spp, StopReason::error, StopReason::time, StopReason::user});
  job.error = j.at("error");
  if (const auto failure = j.find("failure"); failure != j.end()) job.failure = failure_or_none(*failure);
  if (!j.at("numeric_class").is_null()) job.numeric_class = digest_from(j.at("numeric_class"));
  job.build = j.at("build");
  job.platform = j.value("platform", std::string());
  job.fake = j.value("fake", false);
  job.totals = totals_of(j.at("totals"));
  if (const auto missing_blobs = j.find("awaited"); missing_blobs != j.end())
    for (const auto& digest : *missing_blobs) job.missing_blobs.insert(digest_from(digest));
  job.techniques = TechniqueSet::of_bits(j.value("techniques", 0u));
  if (const auto checks = j.find("denoised_checks"); checks != j.end())
    for (const json& c : *checks)
      job.denoised_checks.push_back(
          {number_of(c.at("spp")), number_of(c.at("relmse")),
           c.at("at_most").is_null() ? std::nullopt : std::optional(number_of(c.at("at_most")))});
  if (const auto denoised = j.find("denoised"); denoised != j.end()) {
    job.denoised = {number_of(denoised->at(0)), std::nullopt};
    if (denoised->size() == 3)
      job.denoised->relmse_ci95 = {number_of(denoised->at(1)), number_of(denoised->at(2))};
  }
  if (const auto focus = j.find("focus"); focus != j.end())
    job.focus = PixelRect{focus->at(0), focus->at(1), focus->at(2), focus->at(3)};
  job.revision = count_or_none(j, "revision");
  job.fence = count_or_none(j, "fence");
  return job;
}

std::optional<ReferenceError> reference_error_of(const json& t) {
  if (t.is_null()) return {};
  const auto known = [&](std::size_t i) {
    return t.at(i).is_null() ? std::nullopt : std::optional(t.at(i).get<double>());
  };
  return ReferenceError{t.at(0), t.at(1), known(2), known(3), known(4)};
}

json reference_error_value(const std::optional<ReferenceError>& reference_error) {
  if (!reference_error) return nullptr;
  const auto or_null = [](const std::optional<double>& v) { return v ? json(*v) : json(); };
  return json::array({reference_error->rmse, reference_error->relmse, or_null(reference_error->flip),
                      or_null(reference_error->mse_stderr), or_null(reference_error->relmse_stderr)});
}

std::vector<ConvergencePoint> points_from(const json& all) {
  std::vector<ConvergencePoint> points;
  for (const json& p : all) {
    const ErrorFigures error{number_of(p.at(3)), number_of(p.at(4)), number_of(p.at(5)),
                             number_of(p.at(6)), number_of(p.at(8)), number_of(p.at(9))};
    points.push_back(
        {number_of(p.at(0)), number_of(p.at(1)), number_of(p.at(2)), error, reference_error_of(p.at(7))});
  }
  return points;
}

}  // namespace

std::string to_json(const StoredJob& job) {
  json assets = json::array();
  for (const auto& a : job.assets)
    assets.push_back({{"digest", a.digest.hex()}, {"bytes", a.bytes}, {"name", a.name}});
  json j{{"id", job.id.value},
         {"name", job.name},
         {"owner", job.owner},
         {"submitted_unix", job.submitted_unix},
         {"scene", job.scene.hex()},
         {"settings", canonical_json(job.settings)},
         {"spec", canonical_json(job.spec)},
         {"spp", job.spp ? json(*job.spp) : json()},
         {"assets", std::move(assets)},
         {"warnings", job.warnings},
         {"features_used", job.features_used},
         {"features_left_out", job.features_left_out},
         {"needs", job.needs},
         {"analysis", job.analysis},
         {"state", to_string(job.state)},
         {"stopped", job.stopped ? json(to_string(*job.stopped)) : json()},
         {"error", job.error},
         {"numeric_class", job.numeric_class ? json(job.numeric_class->hex()) : json()},
         {"build", job.build},
         {"totals", to_value(job.totals)}};
  for (const Digest& digest : job.missing_blobs) j["awaited"].push_back(digest.hex());
  if (!job.scene_name.empty()) j["scene_name"] = job.scene_name;
  for (const MeterGroup& m : job.meters) j["meters"].push_back({m.name, scene::name_of(m.kind), m.count});
  if (job.failure) j["failure"] = to_value(*job.failure);
  if (job.techniques != TechniqueSet{}) j["techniques"] = job.techniques.bits();
  for (const DenoisedCheck& c : job.denoised_checks)
    j["denoised_checks"].push_back({{"spp", finite(c.spp)},
                                    {"relmse", finite(c.relmse)},
                                    {"at_most", c.at_most ? json(finite(*c.at_most)) : json()}});
  if (job.denoised) {
    j["denoised"] = {finite(job.denoised->relmse)};
    if (const auto& ci = job.denoised->relmse_ci95)
      j["denoised"].insert(j["denoised"].end(), {finite(ci->first), finite(ci->second)});
  }
  if (job.reference_same_seed) j["reference_same_seed"] = true;
  if (!job.platform.empty()) j["platform"] = job.platform;
  if (job.fake) j["fake"] = true;
  if (!job.traceparent.empty()) j["traceparent"] = job.traceparent;
  if (job.camera) {
    j["camera"] = json::array({job.camera->world_to_camera});
    if (job.camera->world_to_ndc) j["camera"].push_back(*job.camera->world_to_ndc);
  }
  if (job.focus) j["focus"] = {job.focus->x0, job.focus->y0, job.focus->x1, job.focus->y1};
  if (job.revision != 0) j["revision"] = job.revision;
  if (job.fence != 0) j["fence"] = job.fence;
  return dumped(j);
}

Result<StoredJob> parse_stored_job(std::string_view text) {
  return decoded(text, "the record of a job is damaged, or a newer version wrote it", stored_from);
}

std::string points_json(const std::vector<ConvergencePoint>& points) {
  json all = json::array();
  for (const auto& p : points)
    all.push_back({finite(p.seconds), finite(p.core_seconds), finite(p.spp), finite(p.error.rmse),
                   finite(p.error.relmse), finite(p.error.relmse_lo), finite(p.error.relmse_hi),
                   reference_error_value(p.reference_error), finite(p.error.rmse_lo),
                   finite(p.error.rmse_hi)});
  return dumped(all);
}

Result<std::vector<ConvergencePoint>> parse_points(std::string_view text) {
  return decoded(text, "the points or log of a job are damaged", points_from);
}

std::string log_json(const std::vector<LogLine>& lines) {
  json all = json::array();
  for (const auto& line : lines) all.push_back({line.unix_time, line.text});
  return dumped(all);
}

Result<std::vector<LogLine>> parse_log(std::string_view text) {
  return decoded(text, "the points or log of a job are damaged", [](const json& all) {
    std::vector<LogLine> lines;
    for (const json& line : all) lines.push_back({line.at(0), line.at(1)});
    return lines;
  });
}

std::string log_text(std::span<const LogLine> lines) {
  std::string text;
  for (const LogLine& line : lines)
    text += fmt::format("{:%Y-%m-%dT%H:%M:%SZ} {}\n", fmt::gmtime(static_cast<std::time_t>(line.unix_time)),
                        line.text);
  return text;
}

}  // namespace ls::coordinator
