#include "coordinator/views/views.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "coordinator/views/describe_view.h"
#include "core/base/parse_number.h"
#include "core/job/advice.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

// Writes `j` as text. Names in it come from users, so invalid UTF-8 is replaced.
std::string dump(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

template <class T>
json to_value(const T& value);

struct JsonWriter {
  json object = json::object();
  template <class T>
  void field(const char* name, std::string_view, const T& value) {
    object[name] = to_value(value);
  }
  template <class T>
  void field_unless_empty(const char* name, std::string_view doc, const T& list) {
    if (!list.empty()) field(name, doc, list);
  }
};

// Writes a value of a field (describe_view.h).
template <class T>
json to_value(const T& value) {
  if constexpr (std::is_same_v<T, double>) {
    return std::isfinite(value) ? json(value) : json();
  } else if constexpr (std::is_arithmetic_v<T> || std::is_convertible_v<T, std::string_view>) {
    return value;
  } else if constexpr (std::is_same_v<T, Word>) {
    return value.value;
  } else if constexpr (std::is_same_v<T, Interval>) {
    return {to_value(value.first), to_value(value.second)};
  } else if constexpr (requires { value.has_value(); }) {
    return value ? to_value(*value) : json();
  } else if constexpr (requires { value.begin(); }) {
    json list = json::array();
    for (const auto& one : value) list.push_back(to_value(one));
    return list;
  } else if constexpr (std::is_same_v<T, HealthView>) {
    return json::parse(health_json(value.health, value.notes));
  } else {
    JsonWriter writer;
    describe(writer, value);
    return std::move(writer.object);
  }
}

}  // namespace

std::string advice_of(const JobView& v) {
  if (!v.convergence_status) return {};
  // In a sequence that is running, frames that wait do not hold up the others
  const bool goes_on = v.state == JobState::running ? v.after.empty() || v.frames
                                                    : v.state == JobState::queued && v.after.empty();
  return advice_on(*v.convergence_status, {.job = v.id.value,
                                           .relmse = v.error_now ? v.error_now->relmse : 0,
                                           .lit = v.lit,
                                           .spp_done = v.spp_done,
                                           .goes_on = goes_on,
                                           .can_extend = v.state == JobState::done});
}

std::string time_json(const TimeSplit& time) { return dump(to_value(time)); }
std::string job_json(const JobView& job) { return dump(to_value(job)); }
std::string jobs_json(const JobsPage& page) {
  json states = json::object();
  for (std::size_t i = 0; i < page.states.size(); ++i)
    states[std::string(to_string(static_cast<JobState>(i)))] = page.states[i];
  states[std::string(kHeld)] = page.held;
  return dump(json{{"jobs", to_value(page.jobs)},
                   {"total", page.total},
                   {"states", std::move(states)},
                   {"owners", page.owners}});
}
std::string worker_json(const WorkerView& worker) { return dump(to_value(worker)); }
std::string workers_json(const std::vector<WorkerView>& workers) {
  return dump(json{{"workers", to_value(workers)}});
}
std::string video_json(const VideoView& video) { return dump(to_value(video)); }
std::string tiles_json(const std::vector<TileView>& tiles) { return dump(json{{"tiles", to_value(tiles)}}); }

std::string convergence_csv(const std::vector<ConvergencePoint>& points) {
  std::string csv =
      "seconds,core_seconds,spp,rmse,relmse,relmse_lo,relmse_hi,true_rmse,true_relmse,true_flip,rmse_lo,rmse_"
      "hi\n";
  for (const auto& p : points) {
    const auto& r = p.reference_error;
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", p.seconds, p.core_seconds, p.spp,
                       p.error.rmse, p.error.relmse, p.error.relmse_lo, p.error.relmse_hi,
                       r ? fmt::to_string(r->rmse) : "", r ? fmt::to_string(r->relmse) : "",
                       r && r->flip ? fmt::to_string(*r->flip) : "", p.error.rmse_lo, p.error.rmse_hi);
  }
  return csv;
}

std::string tile_event_json(const JobId& job, TileIndex tile, const PixelRect& rect, std::string_view state,
                            std::uint64_t spp, std::string_view worker) {
  return dump(json{{"job", job.value},
                   {"tile", tile},
                   {"rect", corners(rect)},
                   {"state", state},
                   {"spp", spp},
                   {"worker", worker}});
}

std::string worker_gone_json(const WorkerId& worker) {
  return dump(json{{"id", worker.value}, {"state", "gone"}});
}

std::string job_moved_json(const JobId& job) { return dump(json{{"id", job.value}, {"state", "moved"}}); }
std::string job_removed_json(const JobId& job) { return dump(json{{"id", job.value}, {"state", "removed"}}); }

namespace {

// Only the ids of frames contain this: other ids consist of "j-" and hexadecimal digits
constexpr std::string_view kMark = "-frame";

}  // namespace

JobId frame_job(const JobId& sequence, std::uint32_t frame) {
  return {fmt::format("{}{}{}", sequence.value, kMark, frame)};
}

std::optional<FrameId> frame_of(const JobId& job) {
  const std::size_t at = job.value.rfind(kMark);
  if (at == 0 || at == std::string::npos) return std::nullopt;
  const auto number = parse_number<std::uint32_t>(std::string_view(job.value).substr(at + kMark.size()));
  if (!number || *number > kMaxFrameNumber) return std::nullopt;
  const FrameId id{{job.value.substr(0, at)}, *number};
  // Accepts only ids that frame_job() makes: an id that ends in "-frame07" is not a frame's, since
  // frame_job() writes no leading zeros.
  return frame_job(id.sequence, id.frame) == job ? std::optional(id) : std::nullopt;
}

}  // namespace ls::coordinator
