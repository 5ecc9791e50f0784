// The commands that query or change a farm (its jobs, workers and tokens). `lightshaft token add | list |
// revoke` manages the tokens that give access to the farm; only its administrator may use it.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "cli/commands/commands.h"
#include "cli/farm/farm_api.h"
#include "cli/farm/farm_tables.h"
#include "cli/farm/job_results.h"
#include "cli/output/console.h"
#include "cli/output/interrupt.h"
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
  std::string id, frame, spp, target_error, out, report, html, region, fps, exposure, role, user;
  std::string state, search, owner, sort, limit, offset, seconds, seed, priority;
  std::vector<std::string> after;
  bool quiet = false, none = false, denoised = false;
};
constexpr std::chrono::milliseconds kVideoPause(500);  // pause between checks whether a video is ready
using Run = int (*)(FarmApi& api, const FarmFlags& flags);

int show_answer(const FarmApi::Answer<json>& answer, const FarmFlags& flags,
                std::string (*table)(const json&)) {
  if (!answer) return print_rejected(answer.error());
  print(flags.farm.json ? dump(*answer) : table(*answer));
  return kOk;
}

int jobs(FarmApi& api, const FarmFlags& flags) {
  const auto answer = api.get("/api/v1/jobs" + query_of({{"state", flags.state},
                                                         {"search", flags.search},
                                                         {"owner", flags.owner},
                                                         {"sort", flags.sort},
                                                         {"limit", flags.limit},
                                                         {"offset", flags.offset}}));
  const int code = show_answer(answer, flags, jobs_table);
  if (code != kOk || flags.farm.json) return code;
  const std::size_t shown = objects_field(*answer, "jobs").size();
  if (const auto total = number_field(*answer, "total"); total && *total > static_cast<double>(shown))
    print_note(fmt::format("{} of {:.0f} jobs; --limit and --offset choose others", shown, *total));
  return code;
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

int priority(FarmApi& api, const FarmFlags& flags) {
  const auto value = parse_number<int>(flags.priority);
  if (!value || std::abs(std::int64_t{*value}) > kMaxPriority)
    return usage_error(fmt::format("priority '{0}': it must be a whole number from -{1} to {1}",
                                   flags.priority, kMaxPriority));
  return change(api, flags, {{"priority", *value}});
}

int after(FarmApi& api, const FarmFlags& flags) { return change(api, flags, {{"after", flags.after}}); }

int log(FarmApi& api, const FarmFlags& flags) {
  const auto text = api.text(job_path(flags.id) + "/log");
  if (!text) return print_rejected(text.error());
  for (std::size_t at = 0; at < text->size();) {
    const std::size_t end = std::min(text->find('\n', at), text->size());
    print(plain_text(text->substr(at, end - at)));
    at = end + 1;
  }
  return kOk;
}

// Removes a job that has ended. HTTP's DELETE of a job that has not ended cancels it: who asks to remove a
// job may not know that it still renders.
int remove(FarmApi& api, const FarmFlags& flags) {
  const auto job = api.get(job_path(flags.id));
  if (!job) return print_rejected(job.error());
  if (!is_over(*job)) {
    complain(fmt::format("job {} is {}: end it first, with lightshaft cancel {}", flags.id,
                         plain_text(text_field(*job, "state")), shell_word(flags.id)));
    return kFailed;
  }
  const auto done = api.remove(job_path(flags.id));
  return done ? kOk : print_rejected(done.error());
}

// Submits the scene of a job once more.
int again(FarmApi& api, const FarmFlags& flags) {
  JobOptions options;
  options.spp = flags.spp;
  options.target_error = flags.target_error;
  options.time = flags.seconds;
  options.seed = flags.seed;
  options.priority = flags.priority;
  options.after = flags.after;
  const auto spec = options.parse();
  if (!spec) return print_error(spec.error());
  json body{{"priority", spec->priority}};
  if (spec->spp) body["spp"] = *spec->spp;
  if (spec->target_error) body["target_error"] = *spec->target_error;
  if (spec->time) body["time"] = *spec->time;
  if (spec->seed) body["seed"] = *spec->seed;
  if (!spec->after.empty()) body["after"] = spec->after;
  const auto job = api.post(job_path(flags.id) + "/again", body);
  if (!job) return print_rejected(job.error());
  print(flags.farm.json ? dump(*job) : plain_text(text_field(*job, "id")));
  return kOk;
}

// Parses a rectangle "X0,Y0,X1,Y1" in pixels; returns a JSON array of the four numbers.
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
  const LastWords words(goes_on(flags.id));
  const auto end = watch_job(api, flags.id, {flags.quiet, flags.farm.json});
  if (!end) return print_rejected(end.error());
  if (const int code = print_end(*end, flags.quiet || !flags.farm.json); code != kOk) return code;
  if (!flags.farm.json) print(job_text(*end));
  if (!flags.quiet) print_denoised(api, *end);
  return kOk;
}

int fetch(FarmApi& api, const FarmFlags& flags) {
  std::string out = flags.out;
  if (flags.out.empty() && flags.report.empty() && flags.html.empty()) {
    const auto job = api.get(job_path(flags.id));
    if (!job) return print_rejected(job.error());
    out = default_image(*job);
    if (!flags.farm.json) print_note("writes " + out);
  }
  return fetch_results(api, flags.id, {out, flags.report, flags.html, flags.farm.json, false});
}

// With --frame, replaces the id of a sequence (a job with several frames) in `flags` by the id of that frame,
// which is a job of its own.
Result<void> choose_frame(FarmFlags& flags) {
  if (flags.frame.empty()) return {};
  const auto frame = parse_frame(flags.frame);
  if (!frame) return tl::unexpected(frame.error());
  flags.id = coordinator::frame_job(JobId{flags.id}, *frame).value;
  return {};
}

int add_token(FarmApi& api, const FarmFlags& flags) {
  json body{{"role", flags.role}};
  if (!flags.user.empty()) body["user"] = flags.user;
  const auto made = api.post("/api/v1/tokens", body);
  if (!made) return print_rejected(made.error());
  print(flags.farm.json ? dump(*made) : text_field(*made, "token"));
  return kOk;
}

int list_tokens(FarmApi& api, const FarmFlags& flags) {
  return show_answer(api.get("/api/v1/tokens"), flags, tokens_table);
}

int revoke_token(FarmApi& api, const FarmFlags& flags) {
  if (flags.id.find_first_not_of("0123456789abcdef") != std::string::npos)
    return usage_error(fmt::format("'{}' is no token's id: `lightshaft token list` prints them", flags.id));
  const auto done = api.remove("/api/v1/tokens/" + flags.id);
  return done ? kOk : print_rejected(done.error());
}

// Adds a command. Its action connects to the farm and calls `run`. If `of_a_job`, the command takes the id of
// a job, and --frame.
std::pair<CLI::App*, FarmFlags*> add(CLI::App& app, Action& action, const char* name, const char* help,
                                     Run run, bool of_a_job = false) {
  auto flags = std::make_shared<FarmFlags>();
  CLI::App* command = app.add_subcommand(name, help);
  flags->farm.add_to(*command);
  if (of_a_job) {
    add_option(*command, "id", flags->id, "ID", "the job's id, as `submit` and `jobs` print it")->required();
    add_option(*command, "--frame", flags->frame, "N", "of a sequence: this frame alone");
  }
  command->callback([flags, run, &action] {
    action = [flags, run] {
      if (const auto chosen = choose_frame(*flags); !chosen) return print_error(chosen.error());
      auto api = FarmApi::open(flags->farm);
      return api ? run(*api, *flags) : print_error(api.error());
    };
  });
  return {command, flags.get()};
}

}  // namespace

void add_farm_commands(CLI::App& app, Action& action) {
  const auto [jobs_command, listing] = add(app, action, "jobs", "the jobs of a farm", jobs);
  jobs_command->footer(
      "Examples:\n"
      "  lightshaft jobs --state running,queued\n"
      "  lightshaft jobs --search chapel --sort=-submitted --limit 20");
  add_option(*jobs_command, "--state", listing->state, "STATE,...",
             "only these: queued, running, paused, done, failed, cancelled");
  add_option(*jobs_command, "--search", listing->search, "TEXT", "only those with this in their name or id");
  add_option(*jobs_command, "--owner", listing->owner, "USER", "only those of this user");
  add_option(*jobs_command, "--sort", listing->sort, "ORDER",
             "order (of submission, the default), active, submitted, name, owner, state, progress or relmse; "
             "with - before it the other way round");
  add_option(*jobs_command, "--limit", listing->limit, "N", "at most so many");
  add_option(*jobs_command, "--offset", listing->offset, "N", "without the first N of them");
  add(app, action, "show", "one job", show, true);
  const auto [watch_command, watching] = add(app, action, "watch", "follow a job until it ends", watch, true);
  watch_command->add_flag("--quiet", watching->quiet, "no progress bar");
  add(app, action, "pause", "hand out no more of a job", pause, true);
  add(app, action, "resume", "go on with a paused job", resume, true);
  add(app, action, "cancel", "end a job for good", cancel, true);
  const auto [extend_command, extending] =
      add(app, action, "extend", "more samples or less error for a job, done or not", extend, true);
  add_option(*extend_command, "--spp", extending->spp, "TOTAL", "the new total per pixel");
  add_option(*extend_command, "--target-error", extending->target_error, "E",
             "of a job that has one: go on until the image's relMSE is below this");
  const auto [priority_command, ranking] =
      add(app, action, "priority", "puts a job before others, or behind them", priority, true);
  add_option(*priority_command, "priority", ranking->priority, "N", "higher goes first; 0 is the default")
      ->required();
  const auto [after_command, following] =
      add(app, action, "after", "lets a job wait until others are done", after, true);
  add_option(*after_command, "jobs", following->after, "JOB", "the jobs to wait for; none: it waits no more");
  const auto [again_command, repeating] =
      add(app, action, "again", "submits the scene of a job once more; prints the new job's id", again, true);
  add_option(*again_command, "--spp", repeating->spp, "N", "samples per pixel instead of the job's end");
  add_option(*again_command, "--target-error", repeating->target_error, "E", "a target instead");
  add_option(*again_command, "--time", repeating->seconds, "SECONDS", "a time instead");
  add_option(*again_command, "--seed", repeating->seed, "N", "other noise");
  add_option(*again_command, "--priority", repeating->priority, "N", "higher goes first; default 0");
  add_option(*again_command, "--after", repeating->after, "JOB,...", "begin when these jobs are done")
      ->delimiter(',')
      ->allow_extra_args(false);
  add(app, action, "log", "what happened to a job", log, true);
  add(app, action, "remove", "removes a job that has ended, with its image", remove, true);
  const auto [fetch_command, fetching] =
      add(app, action, "fetch", "the image of a job, finished or as it is", fetch, true);
  fetch_command->footer(
      "Examples:\n"
      "  lightshaft fetch j-1234abcd                     writes SCENE.exr, or SCENE_####.exr of a sequence\n"
      "  lightshaft fetch j-1234abcd -o image.png\n"
      "  lightshaft fetch j-1234abcd --frame 7 -o seventh.exr");
  add_option(
      *fetch_command, "-o,--output", fetching->out, "OUT.exr",
      "the image, .exr or .png; of a sequence every frame's, out_####.exr say; default: the scene's name "
      "in this folder");
  add_option(*fetch_command, "--report", fetching->report, "REPORT.json",
             "its report, too; with # in its name, every frame's");
  add_option(*fetch_command, "--html", fetching->html, "REPORT.html",
             "its report as a page; of a sequence every frame's, with # in the name");
  const auto [focus_command, looking] =
      add(app, action, "focus", "which part of a job's image gets the next samples first", focus, true);
  add_option(*focus_command, "--region", looking->region, "X0,Y0,X1,Y1",
             "the tiles of these pixels go before all others");
  focus_command->add_flag("--none", looking->none, "all tiles are treated alike again");
  const auto [video_command, filming] =
      add(app, action, "video", "a video of the finished frames of a sequence", video, true);
  add_option(*video_command, "-o,--output", filming->out, "OUT.mp4", "the video")->required();
  add_option(*video_command, "--fps", filming->fps, "N", "pictures per second; without it 24");
  add_option(*video_command, "--exposure", filming->exposure, "STOPS", "in stops; without it 0");
  video_command->add_flag("--denoised", filming->denoised, "of the denoised images");
  add(app, action, "workers", "the workers of a farm", workers);
}

void add_tokens(CLI::App& app, Action& action) {
  CLI::App* token = app.add_subcommand("token", "who may use a farm: for its admin");
  token->require_subcommand(1);
  const auto [adder, adding] =
      add(*token, action, "add", "makes a token and prints it; it is kept nowhere else", add_token);
  adder
      ->add_option("--role", adding->role,
                   "what it may do: submit (own jobs), read, join (a worker's) or admin")
      ->required()
      ->check(CLI::IsMember({"submit", "read", "join", "admin"}));
  add_option(*adder, "--user", adding->user, "NAME", "whose it is: owner of the jobs handed in with it");
  add(*token, action, "list", "the tokens, without their secrets", list_tokens);
  const auto [revoke, revoking] =
      add(*token, action, "revoke", "makes a token worthless, at once", revoke_token);
  add_option(*revoke, "id", revoking->id, "ID", "its id, as `list` prints it")->required();
}

}  // namespace ls::cli
