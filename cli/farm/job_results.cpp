#include "cli/farm/job_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>

#include <vector>

#include "cli/farm/farm_tables.h"
#include "cli/farm/http_client.h"
#include "cli/output/console.h"
#include "cli/output/convergence_text.h"
#include "cli/output/meter_table.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr int kPollMilliseconds = 250;

struct Download {
  std::string path, option, file;
};

// Returns the frame number in a farm's answer. Only small non-negative integers are accepted: answers are
// untrusted, and the number becomes part of file names.
std::optional<std::uint32_t> frame_number(const json& frame) {
  const int number = frame.is_object() ? int_field(frame, "frame", -1) : -1;
  if (number < 0 || number > static_cast<int>(kMaxFrameNumber)) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

struct Plan {
  std::vector<Download> downloads;
  std::vector<std::uint32_t> left_out;  // numbers of the frames of which nothing is downloaded
};

// Returns the part of the result's URL that follows the path of the job: "/image.exr", "/meters" or
// "/image.png", of an image with a query for the mix of light groups and, for a PNG, for the denoised image
// if the job requests denoising.
std::string image_of(const json& job, const Results& wanted) {
  const auto format = image_format(wanted.image);
  if (format == ImageFormat::json) return "/meters";
  const bool png = format == ImageFormat::png;
  return (png ? "/image.png" : "/image.exr") +
         query_of({{"layer", png && flag_field(job, "denoise") ? "denoised" : ""},
                   {"mix", wanted.mix},
                   {"view", png ? wanted.view : ""}});
}

// True if the deep image of the job, or of a frame in this state, is saved beside its image. A mix of light
// groups has none, and of a job that renders on it would be of other samples than the image.
bool wants_deep(const json& job, const std::string& state, const Results& wanted) {
  const bool over = state == "done" || state == "failed" || state == "cancelled";
  return over && !wanted.image.empty() && wanted.mix.empty() && int_field(job, "deep", 0) > 0;
}

Result<Plan> plan_sequence(const std::string& id, const json& job, const json& frames,
                           const Results& wanted) {
  const auto list = frames.find("list");
  if (list == frames.end() || !list->is_array())
    return fail(Errc::internal, "the coordinator does not say which frames the job has");
  for (const auto& [option, name] : {std::pair("-o", wanted.image), std::pair("--html", wanted.html)})
    if (!name.empty() && !has_frame_number(name) && list->size() != 1)
      return bad_argument(fmt::format(
          "{} {}: job {} has {} frames: give a name with # for their numbers, for example out_####, "
          "or choose one by --frame N",
          option, name, id, list->size()));
  Plan plan;
  const bool reports = has_frame_number(wanted.report);
  for (const json& frame : *list) {
    const auto number = frame_number(frame);
    if (!number) return fail(Errc::internal, "the coordinator names a frame that can't be one");
    const bool taken = wanted.done_only ? text_field(frame, "state") == "done"
                                        : number_field(frame, "spp_done").value_or(0) > 0;
    if (!taken) {
      plan.left_out.push_back(*number);
      continue;
    }
    const auto add = [&](const char* option, const std::string& name, const std::string& what) {
      const char join = what.find('?') == std::string::npos ? '?' : '&';
      plan.downloads.push_back({fmt::format("{}{}{}frame={}", job_path(id), what, join, *number), option,
                                numbered(name, *number)});
    };
    if (!wanted.image.empty()) add("-o", wanted.image, image_of(job, wanted));
    if (wants_deep(job, text_field(frame, "state"), wanted))
      add("-o", deep_file(wanted.image).string(), "/deep.exr");
    if (reports) add("--report", wanted.report, "/report");
    if (!wanted.html.empty()) add("--html", wanted.html, "/report.html");
  }
  if (!wanted.report.empty() && !reports)
    plan.downloads.push_back({job_path(id) + "/report", "--report", wanted.report});
  return plan;
}

Plan plan_image(const std::string& id, const json& job, const Results& wanted) {
  Plan plan;
  if (!wanted.image.empty())
    plan.downloads.push_back({job_path(id) + image_of(job, wanted), "-o", wanted.image});
  if (wants_deep(job, text_field(job, "state"), wanted))
    plan.downloads.push_back({job_path(id) + "/deep.exr", "-o", deep_file(wanted.image).string()});
  if (!wanted.report.empty()) plan.downloads.push_back({job_path(id) + "/report", "--report", wanted.report});
  if (!wanted.html.empty()) plan.downloads.push_back({job_path(id) + "/report.html", "--html", wanted.html});
  return plan;
}

void print_mix_error(FarmApi& api, const std::string& id, const std::string& mix) {
  const auto error = api.get(job_path(id) + "/mix" + query_of({{"mix", mix}}));
  if (!error) return static_cast<void>(print_rejected(error.error()));
  const auto relmse = number_field(*error, "relmse");
  const auto interval = error->find("relmse_ci95");
  if (!relmse || interval == error->end() || !interval->is_array() || interval->size() != 2) return;
  print_note(
      fmt::format("relMSE of the mix: {:.3g} (95 %: {:.3g} to {:.3g}){}", *relmse,
                  (*interval)[0].get<double>(), (*interval)[1].get<double>(),
                  flag_field(*error, "trusted") ? "" : "; " + plain_text(text_field(*error, "verdict"))));
}

// Returns the command by which a person downloads the same results.
std::string fetch_command(const std::string& id, const Results& wanted) {
  std::string command = "lightshaft fetch " + shell_word(id);
  for (const auto& [option, name] : {std::pair("-o", wanted.image), std::pair("--report", wanted.report),
                                     std::pair("--html", wanted.html)})
    if (!name.empty()) command += fmt::format(" {} {}", option, shell_word(name));
  return command;
}

}  // namespace

std::string goes_on(const std::string& id) {
  const std::string word = shell_word(id);
  return fmt::format("job {} continues: lightshaft watch {} follows it, lightshaft cancel {} ends it", id,
                     word, word);
}

bool measures(const json& job) { return int_field(job, "meters", 0) > 0; }

std::string default_image(const json& job) {
  // The name comes from whoever submitted the job: only its last part is used, and no hidden file is made.
  std::string stem = std::filesystem::path(plain_text(text_field(job, "name"))).stem().string();
  stem.erase(0, stem.find_first_not_of('.'));
  if (stem.empty()) stem = "image";
  return stem + (object_field(job, "frames") ? "_####" : "") + (measures(job) ? ".json" : ".exr");
}

int done_frames(const json& job) {
  const json* frames = object_field(job, "frames");
  return frames ? int_field(*frames, "done", 0) : 0;
}

ProgressFigures progress_of(const json& job) {
  ProgressFigures f;
  f.state = text_field(job, "state");
  f.progress = number_field(job, "progress").value_or(0);
  f.spp_done = number_field(job, "spp_done").value_or(0);
  f.relmse = number_field(job, "relmse");
  f.eta_seconds = number_field(job, "eta_seconds");
  f.eta_ci95 = pair_field(job, "eta_ci95");
  f.relmse_ci95 = pair_field(job, "relmse_ci95");
  f.target_error = number_field(job, "target_error");
  f.target_denoised = text_field(job, "target_layer") == "denoised";
  if (const json* check = object_field(job, "denoised_check"))
    f.denoised_at_most = number_field(*check, "at_most");
  if (const json* more = object_field(job, "eta_with_more")) {
    f.eta_with_more = number_field(*more, "seconds");
    f.more_workers = int_field(*more, "workers", f.more_workers);
  }
  f.doubtful = verdict_of(job).doubtful;
  f.trouble = text_field(job, "error");
  const double elapsed = number_field(job, "elapsed_seconds").value_or(0);
  if (const auto size = pair_field(job, "size"); elapsed > 0 && size)
    f.samples_per_second = f.spp_done * size->first * size->second / elapsed;
  if (const json* frames = object_field(job, "frames")) {
    const int total = int_field(*frames, "total", 0);
    // spp_done is the mean over the frames, so the rate computed above is that of one frame. The rate of all
    // frames together is shown.
    f.samples_per_second *= total;
    f.frames = fmt::format("{} of {} frames", int_field(*frames, "done", 0), total);
  }
  return f;
}

FarmApi::Answer<json> watch_job(FarmApi& api, const std::string& id, const WatchOptions& options) {
  ProgressBar bar(options.quiet || options.json ? ProgressForm::none : ProgressForm::bar);
  RetryPolicy retry;
  std::string reported;
  for (;; ::poll(nullptr, 0, kPollMilliseconds)) {
    auto job = api.get(job_path(id));
    if (!job) {
      bar.show({.state = "waiting for the coordinator"});
      if (!retry.again(job.error().error)) return job;
      continue;
    }
    retry.answered();
    bar.show(progress_of(*job));
    if (options.json)
      if (const std::string line = dump(*job, -1); line != reported) print(reported = line);
    if (options.each) options.each(*job);
    if (is_over(*job)) return job;
  }
}

int print_end(const json& job, bool quiet) {
  print_health(job);
  const std::string state = text_field(job, "state"), id = text_field(job, "id");
  if (state == "done") {
    if (const std::string worth = error_text(job); !worth.empty() && (!quiet || verdict_of(job).doubtful))
      print_note(worth);
    if (const std::string advice = verdict_of(job).advice; !advice.empty()) print_note(advice);
    return kOk;
  }
  const std::string error = text_field(job, "error");
  complain(fmt::format("job {} was {}{}", id, state == "failed" ? "given up" : state,
                       error.empty() ? "" : ": " + error));
  if (const int done = done_frames(job); done > 0)
    print_note(
        fmt::format("{} of its frames are done: lightshaft fetch {} -o out_####.exr", done, shell_word(id)));
  return kFailed;
}

void print_denoised(FarmApi& api, const json& job) {
  // A sequence has no error of its own; the report of each frame has the error of that frame.
  if (!flag_field(job, "denoise") || object_field(job, "denoised") || object_field(job, "frames")) return;
  const auto report = api.get(job_path(text_field(job, "id")) + "/report");
  if (!report)
    print_note("the error of the denoised image is unknown: " + report.error().error.message);
  else if (const std::string denoised = denoised_text(*report); !denoised.empty())
    print_note("denoised relMSE: " + denoised);
}

void print_meters(FarmApi& api, const json& job) {
  if (!measures(job) || object_field(job, "frames")) return;
  const auto answer = api.get(job_path(text_field(job, "id")) + "/meters");
  if (!answer)
    print_note("the values of its meters are unknown: " + answer.error().error.message);
  else if (const std::string table = meter_table(list_field(*answer, "meters")); !table.empty())
    print(table);
}

int fetch_results(FarmApi& api, const std::string& id, const Results& wanted) {
  if (wanted.image.empty() && wanted.report.empty() && wanted.html.empty()) return kOk;
  if (const auto format = image_format(wanted.image); !format) return print_error(format.error());
  const auto call = [&](auto request) { return wanted.patient ? with_retries(request) : request(); };
  const auto job = call([&] { return api.get(job_path(id)); });
  if (!job) return print_rejected(job.error());
  if (!measures(*job) && image_format(wanted.image) == ImageFormat::json)
    return usage_error(
        fmt::format("-o {}: job {} has no meters: its result is an image, .exr or .png", wanted.image, id));
  const json* frames = object_field(*job, "frames");
  const auto plan =
      frames ? plan_sequence(id, *job, *frames, wanted) : Result<Plan>(plan_image(id, *job, wanted));
  if (!plan) return print_error(plan.error());
  for (const Download& d : plan->downloads) {
    if (const auto ok = check_output(d.option, d.file); !ok) return print_error(ok.error());
    if (const auto got = call([&] { return api.download(d.path, d.file); }); !got)
      return print_rejected(got.error());
    if (wanted.json) print(dump(json{{"file", d.file}}, -1));
  }
  if (!wanted.mix.empty() && !wanted.image.empty() && !frames && !wanted.json)
    print_mix_error(api, id, wanted.mix);
  const std::vector<std::uint32_t>& left_out = plan->left_out;
  if (left_out.empty()) return kOk;
  constexpr std::size_t kShown = 20;
  const std::size_t shown = std::min(left_out.size(), kShown);
  const std::string numbers = fmt::format(
      "{}{}", fmt::join(left_out.begin(), left_out.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
      shown < left_out.size() ? ", ..." : "");
  if (wanted.done_only)
    complain(
        fmt::format("{} of the frames are not done, and were not written: {}. If there is anything of them, "
                    "this fetches it: {}",
                    left_out.size(), numbers, fetch_command(id, wanted)));
  else
    complain(fmt::format("nothing has come yet of {} of the frames: {}", left_out.size(), numbers));
  return kFailed;
}

}  // namespace ls::cli
