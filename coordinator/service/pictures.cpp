#include "coordinator/service/pictures.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "coordinator/base/limits.h"
#include "coordinator/service/core.h"
#include "coordinator/service/image_writer.h"
#include "coordinator/views/views.h"
#include "core/image/exr/final_image.h"

namespace ls::coordinator {
namespace {

using nlohmann::json;

// Sorts the lines by time and keeps only the latest `most` lines.
void shorten(std::vector<LogLine>& lines, std::size_t most) {
  std::stable_sort(lines.begin(), lines.end(),
                   [](const LogLine& a, const LogLine& b) { return a.unix_time < b.unix_time; });
  if (lines.size() > most) lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(most));
}

}  // namespace

// Returns the job's current image in memory (the film) and the values for its report (the facts).
Result<Pictures::Picture> Pictures::picture(const JobId& id, const std::optional<LightMix>& mix) const {
  if (mix) {
    auto plain = picture(id);
    if (!plain) return plain;
    const auto factors = factors_of(*mix, plain->film.aovs(), plain->facts.job.settings.light_groups);
    if (!factors) return tl::unexpected(factors.error());
    MixedError error;
    plain->film = error.mix(plain->film, *factors);
    plain->error_of_mix = error.error();
    return plain;
  }
  auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry) return tl::unexpected(entry.error());
  ReportFacts facts = facts_of(**entry, clock_.now());
  if ((*entry)->assembly) return Picture{(*entry)->assembly->film(), std::move(facts)};
  const TileGrid grid = (*entry)->grid;
  core.unlock();
  Film film = files_.load_image(facts.job, grid).film();
  put_film(facts, film);
  return Picture{std::move(film), std::move(facts)};
}

std::filesystem::path Pictures::final_file(const JobId& id, const std::string& name) const {
  const auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry || !files_.on_disk() || (*entry)->stored.state != JobState::done) return {};
  return files_.folder(id) / name;
}

Result<std::vector<std::byte>> Pictures::image_exr(const JobId& id,
                                                   const std::optional<LightMix>& mix) const {
  if (const auto file = mix ? std::filesystem::path() : final_file(id, "image.exr"); !file.empty())
    return read_file(file, std::uint64_t{1} << 33);
  auto shown = picture(id, mix);
  if (!shown) return tl::unexpected(shown.error());
  // A reference is of the image itself, not of a mix
  if (mix) shown->facts.job.spec.reference.reset();
  const auto made = denoising_.of_job(shown->film, shown->facts);
  Provenance provenance = provenance_of(shown->facts, blobs_);
  if (mix) {
    provenance.error_of_mix = shown->error_of_mix;
    provenance.convergence_status.reset();
    provenance.figures.clear();
    provenance.notes["mix"] = canonical_json(*mix);
  }
  auto image = final_exr(shown->film, provenance, form_of(shown->facts.job.spec),
                         made ? std::span(made->image.rgb) : std::span<const float>());
  if (!image) return tl::unexpected(image.error());
  return std::move(image->exr);
}

Result<std::vector<std::byte>> Pictures::deep_exr(const JobId& id, bool while_rendering) const {
  if (const auto file = final_file(id, "deep.exr"); !file.empty())
    if (auto bytes = read_file(file, std::uint64_t{1} << 36)) return bytes;
  {
    const auto core = core_.lock();
    const auto entry = core->jobs.usable(id);
    if (!entry) return tl::unexpected(entry.error());
    if ((*entry)->stored.settings.deep == 0)
      return fail(Errc::failed_precondition,
                  fmt::format("job {} was submitted without \"deep\": it has no deep image", id.value));
    if (!while_rendering && !is_terminal((*entry)->stored.state))
      return fail(Errc::failed_precondition,
                  fmt::format("job {} has not ended: the deep image is there when it has", id.value));
  }
  const std::unique_lock one(deep_mutex_, std::try_to_lock);
  if (!one)
    return fail(Errc::unavailable, "another deep image is being written, which takes memory: ask again soon");
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  return deep_exr_of(shown->film, provenance_of(shown->facts, blobs_), form_of(shown->facts.job.spec));
}

Result<std::string> Pictures::mix_json(const JobId& id, const LightMix& mix) const {
  auto core = core_.lock();
  const auto entry = core->jobs.usable(id);
  if (!entry) return tl::unexpected(entry.error());
  const StoredJob job = (*entry)->stored;
  const TileGrid grid = (*entry)->grid;
  const auto film = (*entry)->assembly ? std::optional((*entry)->assembly->film()) : std::nullopt;
  core.unlock();
  const auto factors = factors_of(mix, aovs_of(job.settings), job.settings.light_groups);
  if (!factors) return tl::unexpected(factors.error());
  MixedError sum;
  if (film) {
    for (int row = 0; row < grid.rows(); ++row) sum.mix(film->row(row), *factors);
  } else if (const auto tiles = files_.tiles_of_image(job, grid)) {
    Film part(grid, aovs_of(job.settings));
    for (TileIndex t = 0; t < grid.count(); ++t) {
      if (auto loaded = tiles->load(t, part); !loaded) return tl::unexpected(loaded.error());
      sum.mix(part, *factors);
      part.discard(t);
    }
  }
  json out{{"mix", json::parse(canonical_json(mix))},
           {"groups", job.settings.light_groups},
           {"relmse", nullptr},
           {"relmse_ci95", nullptr},
           {"rmse", nullptr},
           {"trusted", false},
           {"verdict", "no samples yet"}};
  if (sum.any()) {
    const ImageError error = sum.error();
    out["relmse"] = error.relmse;
    out["relmse_ci95"] = {error.relmse_lo, error.relmse_hi};
    out["rmse"] = error.rmse;
    out["trusted"] = error.trusted;
    out["verdict"] = error.trusted ? "trusted" : error.verdict;
  }
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<ToCodes> Pictures::codes_of(const std::string& view) const {
  if (view.empty() || view == kPlainView) return srgb_codes;
  if (views_ == nullptr)
    return bad_argument(fmt::format("there is no view '{}' here but {}", view, kPlainView));
  auto shown = views_->view(view);
  if (!shown) return tl::unexpected(shown.error());
  return [shown = std::move(*shown)](std::span<const double> rgb) { return shown.codes(rgb); };
}

Result<std::vector<std::uint16_t>> Pictures::cube_of(const std::string& view) const {
  if (views_ == nullptr) return fail(Errc::not_found, fmt::format("there is no view '{}' here", view));
  const auto shown = views_->view(view);
  if (!shown) return fail(Errc::not_found, shown.error().message);
  return shown->cube();
}

Result<std::vector<std::byte>> Pictures::image_png(const JobId& id, const Look& look,
                                                   const std::optional<LightMix>& mix) const {
  const auto to_codes = codes_of(look.view);
  if (!to_codes) return tl::unexpected(to_codes.error());
  auto shown = picture(id, mix);
  if (!shown) return tl::unexpected(shown.error());
  if (!look.denoised) return preview_png(shown->film, look.exposure, {}, *to_codes);
  if (!shown->facts.job.spec.denoise)
    return fail(Errc::failed_precondition,
                fmt::format("job {} was submitted without \"denoise\": it has no denoised image", id.value));
  if (mix) shown->facts.job.spec.reference.reset();
  const auto made = denoising_.of_job(shown->film, shown->facts);
  if (!made)  // without samples there is nothing to denoise
    return preview_png(shown->film, look.exposure, {}, *to_codes);
  if (made->image.rgb.empty()) return fail(Errc::unavailable, made->figures.trouble);
  return preview_png(shown->film, look.exposure, made->image.rgb, *to_codes);
}

Result<std::vector<std::byte>> Pictures::error_png(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  return error_map_png(shown->film);
}

Result<std::vector<std::byte>> Pictures::samples_png(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  return samples_map_png(shown->film);
}

Result<std::vector<TileView>> Pictures::tiles(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  const auto core = core_.lock();
  std::vector<TileView> all;
  const TileGrid& grid = shown->film.grid();
  for (TileIndex t = 0; t < grid.count(); ++t) {
    const TileError error = shown->film.error(t);
    const auto relmse = error.samples > 0 ? std::optional(image_error(error).relmse) : std::nullopt;
    all.push_back({t, grid.rect(t), shown->film.rounds_folded(t), shown->film.spp(t), relmse, {}});
  }
  const auto entry = core->jobs.find(id);
  if (!entry) return all;
  for (const auto& [unit, holders] : entry->leased)
    for (const WorkerId& worker : holders) {
      const auto known = core->workers.find(worker);
      const std::string& name = known == core->workers.end() ? worker.value : known->second.hello.name;
      auto& names = all[unit.first].workers;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  return all;
}

Result<std::string> Pictures::report_json(const JobId& id) const {
  {
    auto core = core_.lock();
    if (const Sequence* sequence = core->jobs.sequence(id)) {
      const JobView view = core->views.sequence(id, *sequence, true);
      core.unlock();
      return sequence_report(view);
    }
  }
  if (const auto file = final_file(id, "report.json"); !file.empty()) {
    const auto bytes = read_file(file, std::uint64_t{1} << 28);
    if (!bytes) return tl::unexpected(bytes.error());
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  }
  auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  ReportFacts& facts = shown->facts;
  facts.pixels = pixels_sha256(shown->film);
  facts.meters = meter_values(shown->film, facts.job.meters);
  // The report of a running job is requested often and must not wait for the denoiser.
  if (is_terminal(facts.job.state)) denoising_.of_job(shown->film, facts);
  if (!facts.job.spec.float_output)
    facts.clamped_values = values_above_half(shown->film, facts.job.spec.colour_space);
  return coordinator::report_json(facts);
}

Result<std::string> Pictures::meters_json(const JobId& id) const {
  const auto shown = picture(id);
  if (!shown) return tl::unexpected(shown.error());
  return fmt::format("{{\"meters\":{}}}",
                     coordinator::meters_json(meter_values(shown->film, shown->facts.job.meters)));
}

// Returns the log lines of a job, or those of all frames of a sequence. If the frames have more than
// kLogLinesKept lines together, the oldest lines are left out.
Result<std::string> Pictures::log(const JobId& id) const {
  std::vector<JobId> jobs;
  {
    const auto core = core_.lock();
    const auto found = core->jobs.job_or_frames(id);
    if (!found) return tl::unexpected(found.error());
    for (const EntryPtr& entry : *found) jobs.push_back(entry->stored.id);
  }
  std::vector<LogLine> all;
  for (const JobId& job : jobs) {
    auto lines = store_.log(job);
    if (!lines) return tl::unexpected(lines.error());
    if (job == id) return log_text(*lines);
    for (LogLine& line : *lines)
      all.push_back({line.unix_time, fmt::format("frame {}: {}", frame_of(job)->frame, line.text)});
    if (all.size() > 4 * limits::kLogLinesKept) shorten(all, limits::kLogLinesKept);
  }
  shorten(all, limits::kLogLinesKept);
  return log_text(all);
}

// Returns the report of a sequence. Its member pixels_sha256 is a digest over the pixel digests of all
// frames, or null if some frames are not done.
std::string Pictures::sequence_report(const JobView& view) const {
  static constexpr const char* kKept[] = {"seed",
                                          "scene",
                                          "spp",
                                          "samples",
                                          "load_seconds",
                                          "render_seconds",
                                          "core_seconds",
                                          "time",
                                          "peak_rss_bytes",
                                          "rmse",
                                          "rmse_ci95",
                                          "relmse",
                                          "relmse_ci95",
                                          "verdict",
                                          "verdict_kind",
                                          "trusted",
                                          "few_hits_pixels",
                                          "slope",
                                          "forecast",
                                          "efficiency",
                                          "efficiency_per_core",
                                          "nonfinite_samples",
                                          "health",
                                          "pixels_sha256",
                                          "numeric_class",
                                          "fake",
                                          "stopped"};
  json frames = json::array();
  std::uint64_t samples = 0, rss = 0;
  double load = 0;
  bool all_done = true;
  Sha256 chain;
  json last;
  for (const FrameView& f : view.frames->all) {
    json row{{"frame", f.frame}, {"job", f.job.value}, {"state", to_string(f.state)}};
    all_done &= f.state == JobState::done;
    const auto text = f.spp_done > 0 ? report_json(f.job) : fail(Errc::not_found, "nothing came of it yet");
    const json report = text ? json::parse(*text, nullptr, false) : json();
    if (report.is_object()) {
      for (const char* key : kKept) row[key] = report.value(key, json());
      samples += report.value("samples", std::uint64_t{0});
      rss = std::max(rss, report.value("peak_rss_bytes", std::uint64_t{0}));
      load += report.value("load_seconds", 0.0);
      const auto pixels = Digest::parse(report.value("pixels_sha256", ""));
      if (pixels) chain.update(std::as_bytes(std::span(pixels->bytes)));
      all_done &= pixels.has_value();
      last = report;
    }
    frames.push_back(std::move(row));
  }
  const auto number = [](double x) { return std::isfinite(x) ? json(x) : json(); };
  json j{{"job", view.id.value},
         {"state", to_string(view.state)},
         {"size", {view.size.width, view.size.height}},
         {"spp", number(view.spp_done)},
         {"samples", samples},
         {"load_seconds", load},
         {"render_seconds", number(view.elapsed_seconds)},
         {"core_seconds", number(view.core_seconds)},
         {"time", json::parse(time_json(view.time))},
         {"peak_rss_bytes", rss},
         {"nonfinite_samples", view.health.nonfinite},
         {"negative_samples", view.health.negative},
         {"majorant_violations", view.health.majorant_violations},
         {"health", json::parse(health_json(view.health, view.notes))},
         {"pixels_sha256", all_done ? json(chain.finish().hex()) : json()},
         {"features_used", last.is_object() ? last.value("features_used", json()) : json::array()},
         {"features_left_out", last.is_object() ? last.value("features_left_out", json()) : json::array()},
         {"numeric_class", last.is_object() ? last.value("numeric_class", json()) : json()},
         {"stopped", view.stopped.empty() ? json() : json(view.stopped)},
         {"warnings", view.warnings},
         {"fake", view.fake},
         {"convergence", json::array()},  // every frame has its own curve
         {"frames", std::move(frames)}};
  const auto& e = view.error_now;
  j["rmse"] = e ? number(e->rmse) : json();
  j["relmse"] = e ? number(e->relmse) : json();
  j["relmse_ci95"] = e ? json{number(e->relmse_lo), number(e->relmse_hi)} : json();
  j["trusted"] = view.convergence_status && view.convergence_status->trusted;
  j["verdict"] = view.convergence_status ? json(view.convergence_status->words) : json();
  j["verdict_kind"] = view.convergence_status ? json(to_string(view.convergence_status->kind)) : json();
  j["few_hits_pixels"] = view.few_hits ? json(*view.few_hits) : json();
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace ls::coordinator
