#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "cli/commands/commands.h"
#include "cli/farm/farm_api.h"
#include "cli/farm/farm_tables.h"
#include "cli/farm/farm_wait.h"
#include "cli/farm/fetch_results.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"
#include "common/base/parse_number.h"
#include "common/base/safe_text.h"
#include "common/job/limits.h"
#include "coordinator/base/limits.h"

namespace ls::cli {
namespace {

using nlohmann::json;

struct FarmFlags {
  FarmOptions farm;
  std::string id, frame, spp, target_error, out, report, html, region, fps, exposure;
  bool quiet = false, none = false, denoised = false;
};
constexpr std::chrono::milliseconds kVideoPause(500);  // between two checks whether the video is ready
using Run = int (*)(FarmApi& api, const FarmFlags& flags);

int show_answer(const FarmApi::Answer<json>& answer, const FarmFlags& flags,
                std::string (*table)(const json&)) {
  if (!answer) return print_rejected(answer.error());
  print(flags.farm.json ? dump(*answer) : table(*answer));
  return kOk;
}

int jobs(FarmApi& api, const FarmFlags& flags) {
  return show_answer(api.get("/api/v1/jobs"), flags, jobs_table);
}
int workers(FarmApi& api, const FarmFlags& flags) {
  return show_answer(api.get("/api/v1/workers"), flags, workers_table);
}
int show(FarmApi& api, const FarmFlags& flags) {
  return show_answer(api.get(job_path(flags.id)), flags, job_text);
}

int change(FarmApi& api, const FarmFlags& flags, const json& body) {
  const auto job = api.patch(job_path(flags.id), body);
  if (!job) return print_rejected(job.error());
  print(flags.farm.json ? dump(*job) : fmt::format("{} {}", flags.id, plain_text(text_field(*job, "state"))));
  return kOk;
}
int pause(FarmApi& api, const FarmFlags& flags) { return change(api, flags, {{"state", "paused"}}); }
int resume(FarmApi& api, const FarmFlags& flags) { return change(api, flags, {{"state", "running"}}); }
int cancel(FarmApi& api, const FarmFlags& flags) { return change(api, flags, {{"state", "cancelled"}}); }

int extend(FarmApi& api, const FarmFlags& flags) {
  if (flags.spp.empty() == flags.target_error.empty())
    return usage_error("extend needs either --spp TOTAL or a smaller --target-error E");
  if (!flags.target_error.empty()) {
    const auto target = parse_positive("--target-error", flags.target_error, kMaxTargetError);
    if (!target) return print_error(target.error());
    return change(api, flags, {{"target_error", *target}});
  }
  const auto spp = parse_whole("--spp", flags.spp, 1, kMaxSpp);
  if (!spp) return print_error(spp.error());
  return change(api, flags, {{"spp", *spp}});
}

// Parses "X0,Y0,X1,Y1".
Result<json> parse_region(const std::string& text) {
  json rect = json::parse('[' + text + ']', nullptr, false);
  const bool pixels =
      rect.is_array() && rect.size() == 4 &&
      std::all_of(rect.begin(), rect.end(), [](const json& v) { return v.is_number_unsigned(); });
  if (!pixels)
    return bad_argument(fmt::format("--region '{}': it must be X0,Y0,X1,Y1 in pixels, 0,0,64,64 say", text));
  return rect;
}

int focus(FarmApi& api, const FarmFlags& flags) {
  if (flags.region.empty() != flags.none)
    return usage_error("focus needs either --region X0,Y0,X1,Y1 or --none");
  if (flags.none) return change(api, flags, {{"focus", nullptr}});
  const auto region = parse_region(flags.region);
  if (!region) return print_error(region.error());
  return change(api, flags, {{"focus", *region}});
}

// Requests a video, waits until the coordinator has made it, and downloads it.
int video(FarmApi& api, const FarmFlags& flags) {
  if (const auto ok = check_output("-o", flags.out); !ok) return print_error(ok.error());
  json asked = json::object();
  if (!flags.fps.empty()) {
    const auto fps = parse_positive("--fps", flags.fps, coordinator::limits::kMaxVideoFps);
    if (!fps) return print_error(fps.error());
    asked["fps"] = *fps;
  }
  if (!flags.exposure.empty()) {
    const auto stops = parse_number<double>(flags.exposure);
    if (!stops || !(std::abs(*stops) <= coordinator::limits::kMaxExposure))
      return usage_error(fmt::format("--exposure '{0}': it must be a number of stops from -{1} to {1}",
                                     flags.exposure, coordinator::limits::kMaxExposure));
    asked["exposure"] = *stops;
  }
  if (flags.denoised) asked["layer"] = "denoised";
  auto made = api.post(job_path(flags.id) + "/video", asked);
  for (; made; made = with_retries([&] { return api.get(job_path(flags.id) + "/video"); })) {
    const std::string state = text_field(*made, "state");
    if (state == "ready") break;
    if (state != "waiting" && state != "making") {
      complain(state == "failed" ? plain_text(text_field(*made, "error"))
                                 : "the coordinator was started again meanwhile: ask for the video again");
      return kFailed;
    }
    std::this_thread::sleep_for(kVideoPause);
  }
  if (!made) return print_rejected(made.error());
  if (const auto got = api.download(job_path(flags.id) + "/video.mp4", flags.out); !got)
    return print_rejected(got.error());
  if (flags.farm.json) print(dump(*made));
  return kOk;
}

int watch(FarmApi& api, const FarmFlags& flags) {
  const auto end = watch_job(api, flags.id, {flags.quiet, flags.farm.json});
  if (!end) return print_rejected(end.error());
  if (const int code = print_end(*end, flags.quiet || !flags.farm.json); code != kOk) return code;
  if (!flags.farm.json) print(job_text(*end));
  if (!flags.quiet) print_denoised(api, *end);
  return kOk;
}

int fetch(FarmApi& api, const FarmFlags& flags) {
  if (flags.out.empty() && flags.report.empty() && flags.html.empty())
    return usage_error("say what to fetch: -o OUT.exr, --report REPORT.json or --html REPORT.html");
  return fetch_results(api, flags.id, {flags.out, flags.report, flags.html, flags.farm.json, false});
}

// With --frame, replaces the id of a sequence in `flags` by the id of one frame, which is a separate job.
Result<void> choose_frame(FarmFlags& flags) {
  if (flags.frame.empty()) return {};
  const auto frame = parse_whole("--frame", flags.frame, 0, kMaxFrameNumber);
  if (!frame) return tl::unexpected(frame.error());
  flags.id = coordinator::frame_job(JobId{flags.id}, static_cast<std::uint32_t>(*frame)).value;
  return {};
}

CLI::App* add(CLI::App& app, Action& action, const char* name, const char* help, Run run,
              const std::shared_ptr<FarmFlags>& flags, bool of_a_job) {
  CLI::App* command = app.add_subcommand(name, help);
  flags->farm.add_to(*command);
  if (of_a_job) {
    command->add_option("id", flags->id, "the job's id, as `submit` and `jobs` print it")
        ->required()
        ->type_name("ID");
    command->add_option("--frame", flags->frame, "of a sequence: this frame alone")->type_name("N");
  }
  command->callback([flags, run, &action] {
    action = [flags, run] {
      if (const auto chosen = choose_frame(*flags); !chosen) return print_error(chosen.error());
      auto api = FarmApi::open(flags->farm);
      return api ? run(*api, *flags) : print_error(api.error());
    };
  });
  return command;
}

}  // namespace

void add_farm_commands(CLI::App& app, Action& action) {
  const auto plain = [&](const char* name, const char* help, Run run, bool of_a_job) {
    add(app, action, name, help, run, std::make_shared<FarmFlags>(), of_a_job);
  };
  plain("jobs", "the jobs of a farm", jobs, false);
  plain("show", "one job", show, true);
  auto watching = std::make_shared<FarmFlags>();
  add(app, action, "watch", "follow a job until it ends", watch, watching, true)
      ->add_flag("--quiet", watching->quiet, "no progress bar");
  plain("pause", "hand out no more of a job", pause, true);
  plain("resume", "go on with a paused job", resume, true);
  plain("cancel", "end a job for good", cancel, true);
  auto extending = std::make_shared<FarmFlags>();
  CLI::App* extend_command = add(app, action, "extend", "more samples or less error for a job, done or not",
                                 extend, extending, true);
  extend_command->add_option("--spp", extending->spp, "the new total per pixel")->type_name("TOTAL");
  extend_command
      ->add_option("--target-error", extending->target_error,
                   "of a job that has one: go on until the image's relMSE is below this")
      ->type_name("E");
  auto fetching = std::make_shared<FarmFlags>();
  CLI::App* fetch_command =
      add(app, action, "fetch", "the image of a job, finished or as it is", fetch, fetching, true);
  fetch_command
      ->add_option("-o,--output", fetching->out,
                   "the image, .exr or .png; of a sequence every frame's, out_####.exr say")
      ->type_name("OUT.exr");
  fetch_command
      ->add_option("--report", fetching->report, "its report, too; with # in its name, every frame's")
      ->type_name("REPORT.json");
  fetch_command
      ->add_option("--html", fetching->html,
                   "its report as a page; of a sequence every frame's, with # in the name")
      ->type_name("REPORT.html");
  auto looking = std::make_shared<FarmFlags>();
  CLI::App* focus_command = add(
      app, action, "focus", "which part of a job's image gets the next samples first", focus, looking, true);
  focus_command->add_option("--region", looking->region, "the tiles of these pixels go before all others")
      ->type_name("X0,Y0,X1,Y1");
  focus_command->add_flag("--none", looking->none, "all tiles are treated alike again");
  auto filming = std::make_shared<FarmFlags>();
  CLI::App* video_command =
      add(app, action, "video", "a video of the finished frames of a sequence", video, filming, true);
  video_command->add_option("-o,--output", filming->out, "the video")->required()->type_name("OUT.mp4");
  video_command->add_option("--fps", filming->fps, "pictures per second; without it 24")->type_name("N");
  video_command->add_option("--exposure", filming->exposure, "in stops; without it 0")->type_name("STOPS");
  video_command->add_flag("--denoised", filming->denoised, "of the denoised images");
  plain("workers", "the workers of a farm", workers, false);
}

}  // namespace ls::cli
