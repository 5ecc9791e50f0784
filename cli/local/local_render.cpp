#include "cli/local/local_render.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>

#include "cli/local/instructions.h"
#include "cli/local/local_farm.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "cli/output/convergence_text.h"
#include "cli/output/interrupt.h"
#include "cli/output/meter_table.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"
#include "coordinator/service/coordinator.h"
#include "coordinator/service/pages/report_page.h"
#include "core/base/safe_text.h"
#include "core/image/reference/reference.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

using coordinator::JobState;
using coordinator::JobView;
using nlohmann::json;

constexpr auto kProgressPeriod = std::chrono::milliseconds(200);

bool doubtful(const std::optional<ConvergenceStatus>& convergence_status) {
  return convergence_status && !convergence_status->trusted;
}

ProgressFigures figures_of(const JobView& job) {
  const double samples = job.spp_done * job.size.width * job.size.height;
  return {std::string(to_string(job.state)),
          job.progress,
          job.spp_done,
          job.elapsed_seconds > 0 ? samples / job.elapsed_seconds : 0,
          job.error_now ? std::optional(job.error_now->relmse) : std::nullopt,
          job.eta_seconds,
          {},
          {},
          job.eta_ci95,
          job.error_now ? std::optional(std::pair(job.error_now->relmse_lo, job.error_now->relmse_hi))
                        : std::nullopt,
          job.target_error,
          {},
          {},
          doubtful(job.convergence_status),
          job.target_layer == TargetLayer::denoised,
          job.denoised_check ? job.denoised_check->at_most : std::nullopt};
}

void wait_with_progress(coordinator::Coordinator& coordinator, const JobId& id, ProgressForm form) {
  ProgressBar bar(form);
  std::jthread shower;
  if (bar.shown())
    shower = std::jthread([&](const std::stop_token& token) {
      std::mutex mutex;
      std::condition_variable_any woken;
      std::unique_lock lock(mutex);
      while (!woken.wait_for(lock, token, kProgressPeriod, [&] { return token.stop_requested(); }) &&
             !token.stop_requested())
        if (const auto job = coordinator.job(id)) bar.show(figures_of(*job));
    });
  (void)coordinator.wait(id);
  shower = {};
  if (const auto job = coordinator.job(id); job && bar.shown()) bar.show(figures_of(*job));
}

double number(const json& object, const char* key) { return number_field(object, key).value_or(0); }

// Describes the cost of reducing the error further, from the report's forecast.
std::string forecast_text(const json& report, bool doubtful) {
  const json* forecast = object_field(report, "forecast");
  if (!forecast) return "";
  const double more = number(*forecast, "core_seconds");
  if (!(more > 0)) return "";
  std::string line = fmt::format("; {:.3g} would cost {}{} more on one core", number(*forecast, "target"),
                                 doubtful ? "at least " : "", show_seconds(more));
  if (const auto ci = pair_field(*forecast, "core_seconds_ci95"); ci && !doubtful)
    line += fmt::format(" ({} to {})", show_seconds(ci->first), show_seconds(ci->second));
  return line;
}

// Prints the numeric problems of the render (such as invalid samples) to stderr, if there are any.
void print_report_health(const json& j) {
  print_health(j);
  if (const auto cut = number(j, "clamped_values"); cut > 0)
    print_note(fmt::format(
        "{:.0f} values are above 65504, the largest of a half-precision image, and stand in it as that; "
        "--float keeps them",
        cut));
}

// Returns the peak memory use of this process. The value of getrusage() would include what the program that
// started this one took before.
std::uint64_t own_peak_rss_bytes() {
  std::ifstream status("/proc/self/status");
  std::uint64_t kibibytes = 0;
  for (std::string word; status >> word;)
    if (word == "VmHWM:" && status >> kibibytes) break;
  return kibibytes << 10;
}

// Returns the peak memory use of this process or of any child process that has ended, whichever is largest.
std::uint64_t peak_rss_bytes() {
  rusage children{};
  ::getrusage(RUSAGE_CHILDREN, &children);
  return std::max(own_peak_rss_bytes(), static_cast<std::uint64_t>(children.ru_maxrss) << 10);
}

class LocalRender {
 public:
  LocalRender(const LocalScene& scene, const LocalRenderOptions& options)
      : scene_(scene), options_(options) {}

  int run() {
    const auto limit = render::limit_threads(options_.threads);
    auto farm = LocalFarm::open({options_.threads, options_.isolate, options_.views});
    if (!farm) return print_error(farm.error());
    farm_ = std::move(*farm);
    JobSpec spec = options_.spec;
    if (options_.reference) {
      const auto digest = farm_->adopt(*options_.reference);
      if (!digest) return print_error({Errc::invalid_argument, "--reference: " + digest.error().message});
      spec.reference = *digest;
    }
    auto submitted = farm_->submit(scene_, spec);
    if (!submitted) return print_rejected(submitted.error());
    job_ = std::move(*submitted);
    if (scene_.frame) job_ = coordinator::frame_job(job_, *scene_.frame);
    const auto view = farm_->coordinator().job(job_);
    if (!view) return print_error(view.error());
    for (const std::string& warning : view->warnings)
      fmt::print(stderr, "{}{}", warning, warning.ends_with('\n') ? "" : "\n");
    if (view->reference_same_seed) print_note(fmt::format("warning: {}", kSameSeed));
    if (options_.strict && !view->warnings.empty()) return usage_error("--strict: the scene has warnings");
    if (options_.partial_dir) {
      auto folder = PartialDir::open(*options_.partial_dir);
      if (!folder) return print_error(folder.error());
      partials_ = std::move(*folder);
    }
    if (const auto started = start(); !started) return print_error(started.error());
    wait_with_progress(farm_->coordinator(), job_, options_.progress);
    farm_->stop();
    return finish();
  }

 private:
  Result<void> start() {
    interrupt_.on_signal([this] { (void)farm_->coordinator().cancel(job_); });
    if (!partials_) return farm_->start({});
    return farm_->start([this](const UnitResult& result) {
      const auto kept = partials_->keep(result);
      if (kept) return;
      if (!trouble_) trouble_ = kept.error();
      (void)farm_->coordinator().cancel(job_);
    });
  }

  int finish() {
    const auto view = farm_->coordinator().job(job_);
    if (!view) return print_error(view.error());
    if (const auto error = farm_->agent_error()) return print_error(*error);
    if (view->state == JobState::failed) {
      if (const auto fault = farm_->scene_fault())
        return print_rejected(cli::scene_fault(scene_.name, *fault));
      return print_error({Errc::internal, view->error});
    }
    // A paused job cannot be resumed in this process. So the image is written as far as it is rendered, and
    // the program ends with the error.
    if (view->state == JobState::paused) {
      if (const auto written = write_results(true); !written) complain(written.error().message);
      return print_error({Errc::unavailable, view->error});
    }
    // An error in the folder of partials, such as a full disk, does not affect the image.
    if (trouble_) complain(trouble_->message);
    const bool cut = view->state != JobState::done;
    if (cut && view->spp_done == 0) {
      print_note("lightshaft: interrupted before anything was rendered: no image is written");
      return kFailed;
    }
    if (const auto written = write_results(cut); !written)
      return print_error(Error{Errc::unavailable, written.error().message});
    if (trouble_ && !cut) return kFailed;
    if (cut)
      print_note(fmt::format("lightshaft: interrupted: {} holds what there was", options_.out.string()));
    return cut ? kFailed : kOk;
  }

  Result<void> write_results(bool cut) {
    coordinator::Coordinator& coordinator = farm_->coordinator();
    const auto format = image_format(options_.out);
    Result<void> saved;
    if (format == ImageFormat::json) {
      const auto meters = coordinator.meters_json(job_);
      if (!meters) return tl::unexpected(meters.error());
      saved = save_result(options_.out, *meters + "\n");
    } else {
      const coordinator::Look look{.denoised = options_.spec.denoise, .view = options_.view};
      const auto image =
          format == ImageFormat::png ? coordinator.image_png(job_, look) : coordinator.image_exr(job_);
      if (!image) return tl::unexpected(image.error());
      saved = save_result(options_.out, *image);
      if (saved && options_.spec.deep > 0) {
        const auto deep = coordinator.deep_exr(job_, /*while_rendering=*/true);
        if (!deep) return tl::unexpected(deep.error());
        saved = save_result(deep_file(options_.out), *deep);
      }
    }
    const auto report_text = write_report(cut, saved.has_value());
    return saved ? report_text : saved;
  }

  Result<void> write_report(bool cut, bool print_summary) {
    coordinator::Coordinator& coordinator = farm_->coordinator();
    const auto tiles = coordinator.tiles(job_);
    if (!tiles) return tl::unexpected(tiles.error());
    std::vector<RoundIndex> folded;
    for (const auto& tile : *tiles) folded.push_back(tile.rounds_folded);
    if (partials_ && !trouble_)
      if (auto dropped = partials_->drop_unfolded(folded); !dropped) return dropped;
    const auto report_text = coordinator.report_json(job_);
    if (!report_text) return tl::unexpected(report_text.error());
    LocalFacts facts{farm_->load_seconds(), peak_rss_bytes(), options_.threads, cut,
                     counter_.and_then([](const InstructionCounter& c) { return c.read(); })};
    const auto report = local_report(*report_text, facts);
    if (!report) return tl::unexpected(report.error());
    const std::string text = dump(*report) + "\n";
    if (options_.report)
      if (auto saved = save_result(*options_.report, text); !saved) return saved;
    if (options_.html) {
      const auto page = coordinator::report_page(coordinator, job_, text);
      if (!page) return tl::unexpected(page.error());
      if (auto saved = save_result(*options_.html, *page); !saved) return saved;
    }
    if (!options_.quiet && print_summary)
      print_note(fmt::format("{}: {}", options_.out.string(), report_summary(*report)));
    if (!options_.quiet && print_summary)
      if (const std::string advice = text_field(*report, "advice"); !advice.empty()) print_note(advice);
    print_report_health(*report);
    if (options_.quiet || !print_summary) return {};
    if (const std::string table = meter_table(list_field(*report, "meters")); !table.empty()) print(table);
    print("pixels_sha256 " + text_field(*report, "pixels_sha256"));
    return {};
  }

  const LocalScene& scene_;
  const LocalRenderOptions& options_;
  Interrupt interrupt_;  // created before any member that has threads, as Interrupt requires
  Result<InstructionCounter> counter_ = InstructionCounter::open();
  // The folder of --partial-dir, for the results of units (each the pixel sums of one tile and one range of
  // samples), and the first error in it. While the farm runs, only the worker agent's thread uses the two.
  std::optional<PartialDir> partials_;
  std::optional<Error> trouble_;
  std::unique_ptr<LocalFarm> farm_;
  JobId job_;
};

}  // namespace

Result<json> local_report(const std::string& report, const LocalFacts& facts) {
  json j = json::parse(report, nullptr, false);
  if (!j.is_object()) return fail(Errc::internal, "the coordinator's report cannot be read");
  // The report may be shared, so it should not contain the scene's local path.
  j["name"] = std::filesystem::path(text_field(j, "name")).filename().string();
  j["load_seconds"] = facts.load_seconds;
  j["peak_rss_bytes"] = facts.peak_rss_bytes;
  j["threads"] = facts.threads;
  // The job ends with this command: another one renders on.
  if (std::string advice = text_field(j, "advice"); !advice.empty()) {
    const std::string extend = fmt::format("lightshaft extend {} ", text_field(j, "job"));
    if (const std::size_t at = advice.find(extend); at != std::string::npos)
      advice.replace(at, extend.size(),
                     fmt::format("lightshaft render {} ", shell_word(text_field(j, "name"))));
    j["advice"] = advice;
  }
  if (facts.interrupted) j["stopped"] = "user";
  if (facts.instructions) {
    const double samples = number(j, "samples");
    j["instructions"] = {{"count", *facts.instructions}};
    if (samples > 0) j["instructions"]["per_sample"] = static_cast<double>(*facts.instructions) / samples;
  } else {
    j["instructions"] = {{"uncounted", facts.instructions.error().message}};
  }
  return j;
}

std::string report_summary(const json& j) {
  std::string line =
      fmt::format("{:g} samples per pixel in {} ({} of loading)", number(j, "spp"),
                  show_seconds(number(j, "render_seconds")), show_seconds(number(j, "load_seconds")));
  // The error of the denoised layers comes first: a user who denoises an image looks at these layers.
  const std::string denoised = denoised_text(j);
  if (!denoised.empty()) line += fmt::format(", denoised relMSE {}; as rendered", denoised);
  if (const auto relmse = number_field(j, "relmse"))
    line += fmt::format("{} relMSE {:.3g}", denoised.empty() ? "," : "", *relmse);
  const Verdict verdict = verdict_of_report(j);
  if (const auto ci = pair_field(j, "relmse_ci95"); ci && !verdict.doubtful)
    line += fmt::format(" ({:.3g} to {:.3g})", ci->first, ci->second);
  const json* reference = object_field(j, "reference");
  const bool same_seed = reference && flag_field(*reference, "same_seed");
  if (const std::string reference_error =
          reference_error_text(j, "true_relmse", "true_relmse_below_noise", same_seed);
      !reference_error.empty())
    line += ", true relMSE " + reference_error;
  if (const auto flip = number_field(j, "true_flip")) line += fmt::format(", FLIP {:.3g}", *flip);
  if (const auto target = number_field(j, "target_error"))
    line += fmt::format(", target {:g}{}", *target,
                        text_field(j, "target_layer") == "denoised" ? " for the denoised layers" : "");
  const bool news = verdict.doubtful || text_field(j, "verdict_kind") != "early";
  if (news && !verdict.words.empty()) line += ": " + verdict.words;
  return line + forecast_text(j, verdict.doubtful);
}

int render_locally(const LocalScene& scene, const LocalRenderOptions& options) {
  const bool measures = !scene.scene.meters.empty();
  if (!measures && image_format(options.out) == ImageFormat::json)
    return usage_error(
        fmt::format("-o {}: the scene has a camera and no meters: its result is an image, .exr "
                    "or .png",
                    options.out.string()));
  LocalRenderOptions chosen = options;
  if (measures && options.out_by_default) chosen.out.replace_extension(".json");
  return LocalRender(scene, chosen).run();
}

}  // namespace ls::cli
