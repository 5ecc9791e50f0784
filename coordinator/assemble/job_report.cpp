#include "coordinator/assemble/job_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/image/exr/final_image.h"
#include "core/job/advice.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

json number(double value) { return std::isfinite(value) ? json(value) : json(); }
json number(const std::optional<double>& value) { return value ? number(*value) : json(); }
json interval(double from, double to) { return {number(from), number(to)}; }
json text_or_null(const std::string& text) { return text.empty() ? json() : json(text); }

// Writes a whole number of samples per pixel as an integer: 64 rather than 64.0. Means over the pixels may be
// fractions.
json spp_value(double spp) {
  if (spp == std::floor(spp) && spp >= 0 && spp < 1e15) return static_cast<std::uint64_t>(spp);
  return number(spp);
}

// Adds the errors against the reference (true_rmse, true_relmse, true_flip), and whether the first two are no
// larger than the reference's own noise.
void put_reference_error(json& object, const ReferenceError& reference_error) {
  object["true_rmse"] = number(reference_error.rmse);
  object["true_relmse"] = number(reference_error.relmse);
  object["true_flip"] = number(reference_error.flip);
  object["true_rmse_below_noise"] = reference_error.rmse_below_noise();
  object["true_relmse_below_noise"] = reference_error.relmse_below_noise();
}

json reference_of(const ReportFacts& facts, const std::optional<ReferenceError>& reference_error) {
  if (!facts.job.spec.reference) return {};
  const auto& noise = facts.reference_noise;
  const auto figure = [&](auto value) {
    return reference_error ? number((*reference_error).*value) : json();
  };
  return {{"digest", facts.job.spec.reference->hex()},
          {"rmse", figure(&ReferenceError::rmse)},
          {"relmse", figure(&ReferenceError::relmse)},
          {"flip", figure(&ReferenceError::flip)},
          {"same_seed", facts.job.reference_same_seed},
          // True if the measured error is no larger than the reference's own noise: it then says nothing
          // about the error of the image.
          {"below_noise", reference_error && reference_error->relmse_below_noise()},
          {"rmse_below_noise", reference_error && reference_error->rmse_below_noise()},
          {"mse_stderr", figure(&ReferenceError::mse_stderr)},
          {"relmse_stderr", figure(&ReferenceError::relmse_stderr)},
          {"noise_rmse", noise ? number(std::sqrt(noise->mse)) : json()},
          {"noise_relmse", noise ? number(noise->relmse) : json()}};
}

// Adds a forecast to some points of the curve: the cost of reaching the target, predicted from the points up
// to that point. Users can compare it with the actual cost, and see how reliable forecasts were.
void put_forecasts(json& curve, const std::vector<ConvergencePoint>& points, double target) {
  const std::vector<ErrorPoint> all = error_points(points);
  // A forecast is added each time the samples have doubled. More forecasts would show little more, and the
  // time of each grows with the number of points before it.
  double next = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].spp < next) continue;
    const auto forecast = forecast_of(std::span(all).first(i + 1), target);
    if (!forecast || forecast->core_seconds == 0) continue;
    next = 2 * all[i].spp;
    curve[i]["forecast"] = {
        {"core_seconds", number(forecast->core_seconds)},
        {"core_seconds_ci95", interval(forecast->core_seconds_lo, forecast->core_seconds_hi)},
        {"spp", number(forecast->spp)}};
  }
}

json split_json(const TimeSplit& t) {
  json j;
  for (const TimePart& part : kTimeParts) j[part.name] = number(t.*part.seconds);
  return j;
}

json point(const ConvergencePoint& p) {
  json j{{"seconds", number(p.seconds)},     {"core_seconds", number(p.core_seconds)},
         {"spp", spp_value(p.spp)},          {"rmse", number(p.error.rmse)},
         {"relmse", number(p.error.relmse)}, {"relmse_ci95", interval(p.error.relmse_lo, p.error.relmse_hi)}};
  if (p.error.rmse_hi > 0) j["rmse_ci95"] = interval(p.error.rmse_lo, p.error.rmse_hi);
  if (p.reference_error) put_reference_error(j, *p.reference_error);
  return j;
}

json denoised_of(const ReportFacts& facts) {
  if (!facts.denoised) return {};
  const DenoisedFigures& d = *facts.denoised;
  if (d.by.empty()) return {{"error", d.trouble}};
  const DenoisedError& e = d.error;
  json j{{"by", d.by},
         {"seconds", number(d.seconds)},
         {"rmse", number(e.rmse)},
         {"rmse_ci95", e.rmse_interval ? interval(e.rmse_lo, e.rmse_hi) : json()},
         {"relmse", number(std::max(0.0, e.relmse))},
         {"relmse_ci95", e.relmse_interval ? interval(e.relmse_lo, e.relmse_hi) : json()}};
  if (!d.true_error) return j;
  j["true_rmse"] = number(d.true_error->rmse);
  j["true_relmse"] = number(d.true_error->relmse);
  j["true_relmse_stderr"] = number(d.true_error->relmse_stderr);
  return j;
}

// Returns the job's target error if it applies to the image itself; nullopt if it applies to the denoised
// layers, since the convergence curve does not show their errors.
std::optional<double> target_of_image(const JobSpec& spec) {
  return spec.target_layer == TargetLayer::raw ? spec.target_error : std::nullopt;
}

json checks_of(const std::vector<DenoisedCheck>& checks) {
  json all = json::array();
  for (const DenoisedCheck& c : checks)
    all.push_back({{"spp", spp_value(c.spp)},
                   {"relmse", number(std::max(0.0, c.relmse))},
                   {"at_most", number(c.at_most)}});
  return all;
}

// Returns a forecast of the cost of reaching the job's target error. If the job has no target error for the
// image itself, or has reached it, the forecast is for half of the present error.
json forecast(const ReportFacts& facts) {
  if (facts.convergence.empty()) return {};
  const double now = facts.convergence.back().error.relmse;
  const auto asked = target_of_image(facts.job.spec);
  const bool goes_on = asked && *asked < now;
  const double target = goes_on ? *asked : now / 2;
  const auto f = forecast_of(error_points(facts.convergence), target);
  if (!f) return {};
  return {{"target", number(target)},
          {"asked", goes_on},
          {"spp", spp_value(f->spp)},
          {"core_seconds", number(f->core_seconds)},
          {"core_seconds_ci95", interval(f->core_seconds_lo, f->core_seconds_hi)}};
}

}  // namespace

std::string note_on(StopReason stopped, TargetLayer layer) {
  if (stopped == StopReason::error && layer == TargetLayer::denoised)
    return "stopped at a target error of the denoised layers: each tile has as many samples as its own error "
           "required, so the image has a small bias; the errors that ended the job were computed by the "
           "denoiser of this coordinator";
  if (stopped == StopReason::error)
    return "stopped at a target error: each tile has as many samples as its own error required, so the image "
           "has a small bias, which is smaller than the reported error; images with a fixed number of "
           "samples "
           "have none";
  if (stopped == StopReason::time)
    return "stopped by time: another run may end with other samples, so its pixels may differ";
  return "";
}

TimeSplit split_of(const JobTotals& totals) {
  TimeSplit split = totals.time;
  split.render = totals.core_seconds;
  return split;
}

ErrorFigures figures_of(const ImageError& e) {
  return {e.rmse, e.relmse, e.relmse_lo, e.relmse_hi, e.rmse_lo, e.rmse_hi};
}

std::vector<ErrorPoint> error_points(const std::vector<ConvergencePoint>& points, bool with_reference_error) {
  std::vector<ErrorPoint> out;
  out.reserve(points.size());
  for (const ConvergencePoint& p : points) {
    out.push_back({p.spp, p.core_seconds, p.error.relmse, p.error.relmse_lo, p.error.relmse_hi});
    if (!p.reference_error || !with_reference_error) continue;
    out.back().true_relmse = p.reference_error->relmse;
    out.back().true_stderr = p.reference_error->relmse_stderr;
  }
  return out;
}

namespace {

// The errors of means over areas. Their intervals are unknown if the image's error is not trusted, and if
// rare bright light may be missing (ImageError::settled).
void put_areas(json& j, const ReportFacts& facts) {
  const bool known = facts.error && facts.error->settled && convergence_status_of(facts).trusted;
  json mean, mean_interval;
  for (std::size_t c = 0; facts.areas && c < 3; ++c) {
    const double value = facts.areas->mean[c], half = facts.areas->half_width[c];
    mean.push_back(number(value));
    if (known) mean_interval.push_back(interval(value - half, value + half));
  }
  const AreaError areas = facts.areas.value_or(AreaError{});
  j["mean"] = std::move(mean);
  j["mean_ci95"] = std::move(mean_interval);
  j["relmse_16"] = facts.areas ? number(areas.relmse) : json();
  j["relmse_16_ci95"] = known && areas.relmse_hi > 0 ? interval(areas.relmse_lo, areas.relmse_hi) : json();
}

}  // namespace

std::optional<ReferenceError> last_reference_error(const std::vector<ConvergencePoint>& points) {
  std::optional<ReferenceError> out;
  for (auto p = points.rbegin(); p != points.rend() && !out; ++p) out = p->reference_error;
  return out;
}

void put_film(ReportFacts& facts, const Film& film) {
  const FrameSize& size = film.grid().frame;
  facts.samples = film.samples();
  facts.pixels_without_samples = film.pixels_without_samples();
  facts.job.totals.spp_done =
      static_cast<double>(facts.samples) / static_cast<double>(std::int64_t{size.width} * size.height);
  facts.error.reset();
  facts.areas.reset();
  if (facts.samples == 0) return;
  const TileError sums = film.error();
  facts.error = image_error(sums);
  facts.areas = area_error(sums.areas, facts.job.techniques.has(Technique::light_vertices));
}

ConvergenceStatus convergence_status_of(const ReportFacts& facts) {
  if (!facts.error) return {ConvergenceStatus::Kind::early, "no sample yet", false};
  if (facts.pixels_without_samples > 0)
    return {ConvergenceStatus::Kind::early,
            fmt::format("don't trust yet: {} pixels have no sample; the figures are of the others",
                        facts.pixels_without_samples),
            false};
  return judge(error_points(facts.convergence, !facts.job.reference_same_seed), facts.error->verdict);
}

// Returns the efficiency per wall-clock second, 1 / (relMSE x seconds), and the same per core second, which
// allows comparisons between farms.
Efficiency efficiency_of(const ReportFacts& facts) {
  const auto over = [&](double seconds) -> std::optional<double> {
    const double cost = facts.error ? facts.error->relmse * seconds : 0;
    return cost > 0 ? std::optional(1 / cost) : std::nullopt;
  };
  return {over(facts.job.totals.render_seconds), over(facts.job.totals.core_seconds)};
}

std::map<std::string, double> header_figures(const ReportFacts& facts) {
  std::map<std::string, double> figures;
  const auto put = [&](const char* name, std::optional<double> value) {
    if (value && std::isfinite(*value)) figures[name] = *value;
  };
  const Efficiency efficiency = efficiency_of(facts);
  put("efficiency", efficiency.wall);
  put("efficiency_per_core", efficiency.per_core);
  put("target_error", facts.job.spec.target_error);
  if (const auto trend = trend_of(error_points(facts.convergence))) put("slope", -trend->slope);
  if (const auto reference_error = last_reference_error(facts.convergence)) {
    put("true_rmse", reference_error->rmse);
    put("true_relmse", reference_error->relmse);
  }
  if (facts.denoised && !facts.denoised->by.empty()) {
    put("denoised_rmse", facts.denoised->error.rmse);
    put("denoised_relmse", std::max(0.0, facts.denoised->error.relmse));
  }
  return figures;
}

std::map<std::string, std::string> header_notes(const ReportFacts& facts) {
  std::map<std::string, std::string> notes;
  if (facts.job.reference_same_seed) notes["reference_same_seed"] = kSameSeed;
  if (facts.job.spec.target_error && facts.job.spec.target_layer == TargetLayer::denoised)
    notes["target_layer"] = to_string(facts.job.spec.target_layer);
  if (facts.job.fake) notes["fake"] = kFakePixels;
  if (facts.denoised && !facts.denoised->by.empty()) {
    const DenoisedError& e = facts.denoised->error;
    notes["denoised_by"] = facts.denoised->by;
    if (e.rmse_interval) notes["denoised_rmse_ci95"] = fmt::format("{:.9g} {:.9g}", e.rmse_lo, e.rmse_hi);
    if (e.relmse_interval)
      notes["denoised_relmse_ci95"] = fmt::format("{:.9g} {:.9g}", e.relmse_lo, e.relmse_hi);
  }
  const auto reference_error = last_reference_error(facts.convergence);
  if (!reference_error) return notes;
  std::string below = reference_error->rmse_below_noise() ? "rmse" : "";
  if (reference_error->relmse_below_noise()) below += below.empty() ? "relmse" : " relmse";
  if (!below.empty()) notes["true_below_noise"] = below;
  return notes;
}

std::string report_json(const ReportFacts& facts) {
  const StoredJob& job = facts.job;
  const JobTotals& totals = job.totals;
  json curve = json::array();
  for (const auto& p : facts.convergence) curve.push_back(point(p));
  if (const auto target = target_of_image(job.spec)) put_forecasts(curve, facts.convergence, *target);
  json j{{"job", job.id.value},
         {"name", job.name},
         {"submitted_unix", number(job.submitted_unix)},
         {"target_error", number(job.spec.target_error)},
         {"target_layer", job.spec.target_error ? json(to_string(job.spec.target_layer)) : json()},
         {"scene", job.scene.hex()},
         {"state", to_string(job.state)},
         {"size", {job.settings.size.width, job.settings.size.height}},
         {"seed", job.settings.seed},
         {"integrator", job.settings.integrator},
         {"max_depth", job.settings.max_depth},
         {"rr_depth", job.settings.rr_depth},
         {"spp_asked", job.spp ? json(even_spp(*job.spp)) : json()},
         {"time_asked", number(job.spec.time)},
         {"spp", spp_value(totals.spp_done)},
         {"samples", facts.samples},
         {"load_seconds", number(totals.load_seconds)},
         {"render_seconds", number(totals.render_seconds)},
         {"core_seconds", number(totals.core_seconds)},
         {"time", split_json(split_of(totals))},
         {"peak_rss_bytes", totals.peak_rss_bytes},
         {"nonfinite_samples", totals.health.nonfinite},
         {"negative_samples", totals.health.negative},
         {"majorant_violations", totals.health.majorant_violations},
         {"health", json::parse(health_json(totals.health, health_notes(totals.health, facts.replay)))},
         {"clamped_values", facts.clamped_values},
         {"pixels_sha256", facts.pixels.hex()},
         {"features_used", job.features_used},
         {"features_left_out", job.features_left_out},
         {"numeric_class", job.numeric_class ? json(job.numeric_class->hex()) : json()},
         {"build", job.build},
         {"platform", job.platform.empty() ? json() : json(job.platform)},
         {"fake", job.fake},
         {"stopped", job.stopped ? json(to_string(*job.stopped)) : json()},
         {"warnings", job.warnings},
         {"convergence", std::move(curve)}};
  // `needs` and `analysis` are JSON texts that this program wrote. Jobs stored by older versions have none.
  j["needs"] = job.needs.empty() ? json() : json::parse(job.needs, nullptr, false);
  j["analysis"] = job.analysis.empty() ? json() : json::parse(job.analysis, nullptr, false);
  j["techniques"] = json::parse(techniques_json(job.techniques, job.settings.integrator));
  const auto& e = facts.error;
  j["rmse"] = e ? number(e->rmse) : json();
  j["rmse_ci95"] = e && (e->rmse_hi > 0 || e->rmse == 0) ? interval(e->rmse_lo, e->rmse_hi) : json();
  j["relmse"] = e ? number(e->relmse) : json();
  j["relmse_ci95"] = e ? interval(e->relmse_lo, e->relmse_hi) : json();
  put_areas(j, facts);
  j["meters"] = json::parse(meters_json(facts.meters));
  const auto reference_error = last_reference_error(facts.convergence);
  if (reference_error) put_reference_error(j, *reference_error);
  j["reference"] = reference_of(facts, reference_error);
  j["few_hits_pixels"] = e ? json(e->few_hits) : json();
  const auto trend = trend_of(error_points(facts.convergence));
  j["slope"] = trend ? number(-trend->slope) : json();
  j["slope_ci95"] = trend ? interval(-trend->slope_hi, -trend->slope_lo) : json();
  j["trend"] = trend ? trend->verdict : "too early to tell how it converges";
  j["forecast"] = forecast(facts);
  const ConvergenceStatus convergence_status = convergence_status_of(facts);
  j["trusted"] = convergence_status.trusted;
  j["verdict"] = convergence_status.words;
  j["verdict_kind"] = to_string(convergence_status.kind);
  const bool open = job.state == JobState::running || job.state == JobState::queued;
  j["advice"] = text_or_null(advice_on(convergence_status, {.job = job.id.value,
                                                            .relmse = e ? e->relmse : 0,
                                                            .lit = !e || e->lit,
                                                            .spp_done = totals.spp_done,
                                                            .goes_on = open && job.spec.after.empty(),
                                                            .can_extend = job.state == JobState::done}));
  const Efficiency efficiency = efficiency_of(facts);
  j["efficiency"] = number(efficiency.wall);
  j["efficiency_per_core"] = number(efficiency.per_core);
  j["threads"] = totals.render_seconds > 0 ? number(totals.core_seconds / totals.render_seconds) : json();
  j["pixels_without_samples"] = facts.pixels_without_samples;
  j["error"] = text_or_null(job.error);
  j["adaptive"] = job.spec.target_error.has_value();
  if (job.spec.denoise) j["denoised"] = denoised_of(facts);
  if (job.spec.denoise) j["denoised_checks"] = checks_of(job.denoised_checks);
  const std::string note = job.stopped ? note_on(*job.stopped, job.spec.target_layer) : "";
  if (!note.empty()) j["note"] = note;
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace ls::coordinator
