#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "coordinator/store/jobs/job_store.h"
#include "coordinator/store/jobs/json_number.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

json to_value(const JobTotals& t) {
  json time;
  for (const TimePart& part : kTimeParts) time[part.name] = finite(t.time.*part.seconds);
  return {{"render_seconds", finite(t.render_seconds)},
          {"core_seconds", finite(t.core_seconds)},
          {"load_seconds", finite(t.load_seconds)},
          {"peak_rss_bytes", t.peak_rss_bytes},
          {"spp_done", t.spp_done},
          {"units", t.units},
          {"units_planned", t.units_planned},
          {"health", json::parse(canonical_json(t.health))},
          {"time", std::move(time)},
          {"began_unix", t.began_unix},
          {"ended_unix", t.ended_unix},
          {"doubt", t.doubt},
          {"few_hits", t.few_hits ? json(*t.few_hits) : json()}};
}

// Returns 0 if the key is missing, as in records of earlier versions.
std::uint64_t count_or_none(const json& j, const char* key) {
  const auto found = j.find(key);
  return found == j.end() ? 0 : count_of(*found);
}

Health health_of(const json& totals) {
  Health health;
  if (const auto causes = totals.find("health"); causes != totals.end()) {
    auto read = parse_health(causes->dump());
    if (!read) throw std::invalid_argument(read.error().message);
    return std::move(*read);
  }
  // A record of an earlier version, which counted bad samples without their causes.
  health.add(HealthCause::unnamed, count_of(totals.at("nonfinite")));
  health.add(HealthCause::negative, count_of(totals.at("negative")));
  health.add(HealthCause::majorant_violation, count_of(totals.at("majorant_violations")));
  return health;
}

JobTotals totals_of(const json& j) {
  JobTotals t;
  t.render_seconds = number_of(j.at("render_seconds"));
  t.core_seconds = number_of(j.at("core_seconds"));
  t.load_seconds = number_of(j.at("load_seconds"));
  t.peak_rss_bytes = count_of(j.at("peak_rss_bytes"));
  t.spp_done = j.at("spp_done");
  t.units = count_of(j.at("units"));
  t.units_planned = count_or_none(j, "units_planned");
  t.health = health_of(j);
  const json time = j.value("time", json::object());  // missing in records of earlier versions
  for (const TimePart& part : kTimeParts)
    if (const auto found = time.find(part.name); found != time.end())
      t.time.*part.seconds = number_of(*found);
  t.began_unix = j.value("began_unix", 0.0);
  t.ended_unix = j.value("ended_unix", 0.0);
  t.doubt = j.value("doubt", std::string());
  if (const auto few = j.find("few_hits"); few != j.end() && !few->is_null()) t.few_hits = count_of(*few);
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

template <class T>
T required(Result<T> parsed) {
  if (!parsed) throw std::invalid_argument(parsed.error().message);
  return std::move(*parsed);
}

StoredJob stored_from(const json& j) {
  StoredJob job;
  job.id.value = j.at("id");
  job.name = j.at("name");
  job.owner = j.value("owner", std::string());
  job.submitted_unix = j.at("submitted_unix");
  job.traceparent = j.value("traceparent", std::string());
  job.scene = digest_from(j.at("scene"));
  job.settings = required(parse_render_settings(j.at("settings").get<std::string>()));
  job.spec = required(parse_job_spec(j.at("spec").get<std::string>()));
  if (!j.at("spp").is_null()) job.spp = count_of(j.at("spp"));
  for (const auto& a : j.at("assets"))
    job.assets.push_back({digest_from(a.at("digest")), count_of(a.at("bytes")), a.at("name")});
  job.warnings = j.at("warnings");
  job.reference_same_seed = j.value("reference_same_seed", false);  // missing in earlier versions
  job.features_used = j.at("features_used");
  job.features_left_out = j.at("features_left_out");
  job.needs = j.value("needs", std::string());
  job.analysis = j.value("analysis", std::string());
  job.state = enum_from(j.at("state"), {JobState::queued, JobState::running, JobState::paused, JobState::done,
                                        JobState::failed, JobState::cancelled});
  if (!j.at("stopped").is_null())
    job.stopped =
        enum_from(j.at("stopped"), {StopReason::spp, StopReason::error, StopReason::time, StopReason::user});
  job.error = j.at("error");
  if (!j.at("numeric_class").is_null()) job.numeric_class = digest_from(j.at("numeric_class"));
  job.build = j.at("build");
  job.platform = j.value("platform", std::string());  // missing in earlier versions
  job.fake = j.value("fake", false);                  // missing in earlier versions
  job.totals = totals_of(j.at("totals"));
  if (const auto missing_blobs = j.find("awaited"); missing_blobs != j.end())
    for (const auto& digest : *missing_blobs) job.missing_blobs.insert(digest_from(digest));
  job.techniques = TechniqueSet::of_bits(j.value("techniques", 0u));  // missing in earlier versions
  if (const auto checks = j.find("denoised_checks"); checks != j.end())
    for (const json& c : *checks)
      job.denoised_checks.push_back(
          {number_of(c.at("spp")), number_of(c.at("relmse")),
           c.at("at_most").is_null() ? std::nullopt : std::optional(number_of(c.at("at_most")))});
  if (const auto focus = j.find("focus"); focus != j.end())
    job.focus = PixelRect{focus->at(0), focus->at(1), focus->at(2), focus->at(3)};
  job.revision = count_or_none(j, "revision");
  job.fence = count_or_none(j, "fence");
  return job;
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
  if (job.techniques != TechniqueSet{}) j["techniques"] = job.techniques.bits();
  for (const DenoisedCheck& c : job.denoised_checks)
    j["denoised_checks"].push_back({{"spp", finite(c.spp)},
                                    {"relmse", finite(c.relmse)},
                                    {"at_most", c.at_most ? json(finite(*c.at_most)) : json()}});
  if (job.reference_same_seed) j["reference_same_seed"] = true;
  if (!job.platform.empty()) j["platform"] = job.platform;
  if (job.fake) j["fake"] = true;
  if (!job.traceparent.empty()) j["traceparent"] = job.traceparent;
  if (job.focus) j["focus"] = {job.focus->x0, job.focus->y0, job.focus->x1, job.focus->y1};
  if (job.revision != 0) j["revision"] = job.revision;
  if (job.fence != 0) j["fence"] = job.fence;
  // Names and messages may come from a worker. Invalid UTF-8 in them is replaced, so that dump() never
  // throws.
  return j.dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<StoredJob> parse_stored_job(std::string_view text) {
  try {
    return stored_from(json::parse(text));
  } catch (const std::exception& e) {
    return fail(Errc::internal,
                fmt::format("the record of a job is damaged, or a newer version wrote it: {}", e.what()));
  }
}

}  // namespace ls::coordinator
