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
#include "cli/farm/tev.h"
#include "cli/output/console.h"
#include "cli/output/interrupt.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"
#include "coordinator/base/limits.h"
#include "coordinator/store/files.h"
#include "coordinator/views/describe_change.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "core/image/light_mix/light_mix.h"
#include "core/job/objects.h"

namespace ls::cli {
namespace {

using nlohmann::json;

struct FarmFlags {
  FarmOptions farm;
  std::string id, frame, spp, target_error, out, report, html, region, fps, exposure, role, user, mix, view;
  std::string state, search, owner, sort, limit, offset, priority, name, worker, restarted;
  std::string tev;  // of --tev: "true", or HOST:PORT; empty: the option was not given
  std::vector<std::string> after;
  JobOptions job;
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

// Jobs that wait for files on their users' machines. An older coordinator knows none.
void print_announced(FarmApi& api) {
  constexpr std::size_t kMost = 10;
  const auto answer = api.get("/api/v1/announced");
  if (!answer) return;
  const auto all = objects_field(*answer, "announced");
  for (std::size_t i = 0; i < std::min(all.size(), kMost); ++i) {
    const json& each = all[i];
    const auto files = texts_field(each, "files");
    const std::string frames = text_field(each, "frames"), machine = text_field(each, "machine");
    const double more = number_field(each, "count").value_or(1) - 1;
    print_note(fmt::format("{}{} will be submitted when {}{} complete{}", text_field(each, "name"),
                           frames.empty() ? "" : ", frames " + frames + ",",
                           files.empty() ? "" : files.front(),
                           more > 0 ? fmt::format(" and {:.0f} more are", more) : " is",
                           machine.empty() ? "" : " on " + machine));
  }
  if (all.size() > kMost) print_note(fmt::format("{} more jobs wait for files", all.size() - kMost));
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
    print_note(fmt::format("{} of {:.0f} jobs; --limit and --offset select others", shown, *total));
  if (flags.state.empty() && flags.search.empty() && flags.owner.empty()) print_announced(api);
  return code;
}
int print_lines(const FarmApi::Answer<std::string>& text) {
  if (!text) return print_rejected(text.error());
  for (std::size_t at = 0; at < text->size();) {
    const std::size_t end = std::min(text->find('\n', at), text->size());
    print(plain_text(text->substr(at, end - at)));
    at = end + 1;
  }
  return kOk;
}
// Calls act(worker, path in the API) for each worker with this name or id. Returns the first exit code other
// than kOk, if there is one. `connected`: only for workers that are connected, if one of them is.
template <class Act>
int for_workers(FarmApi& api, const std::string& wanted, bool connected, Act act) {
  const auto answer = api.get("/api/v1/workers");
  if (!answer) return print_rejected(answer.error());
  std::vector<json> found;
  for (const json& worker : objects_field(*answer, "workers"))
    if (text_field(worker, "id") == wanted || text_field(worker, "name") == wanted) found.push_back(worker);
  const auto lost = [](const json& worker) { return text_field(worker, "state") == "lost"; };
  if (connected && !std::ranges::all_of(found, lost)) std::erase_if(found, lost);
  if (found.empty())
    return print_error(
        {Errc::not_found,
         fmt::format("there is no worker \"{}\"; `lightshaft workers` lists them", plain_text(wanted))});
  int first_failure = kOk;
  for (const json& worker : found) {
    const int code = act(worker, "/api/v1/workers/" + percent_encode(text_field(worker, "id")));
    if (first_failure == kOk) first_failure = code;
  }
  return first_failure;
}
int restart_workers(FarmApi& api, const FarmFlags& flags) {
  return for_workers(api, flags.restarted, true, [&](const json& worker, const std::string& path) -> int {
    const auto asked = api.ask(path, {{"state", "restarting"}});
    if (!asked) return print_rejected(asked.error());
    print(fmt::format("{} ({}) finishes its units and restarts its program",
                      plain_text(text_field(worker, "name")), plain_text(text_field(worker, "id"))));
    return kOk;
  });
}
int workers(FarmApi& api, const FarmFlags& flags) {
  if (!flags.restarted.empty()) return restart_workers(api, flags);
  if (!flags.worker.empty())
    return for_workers(api, flags.worker, false, [&](const json&, const std::string& path) {
      return print_lines(api.text(path + "/log"));
    });
  return show_answer(api.get("/api/v1/workers"), flags, workers_table);
}
int views(FarmApi& api, const FarmFlags& flags) {
  const auto answer = api.get("/api/v1/views");
  return show_answer(answer, flags, [](const json& all) {
    std::string text;
    if (const auto list = all.find("views"); list != all.end() && list->is_array())
      for (const json& name : *list)
        if (name.is_string()) text += (text.empty() ? "" : "\n") + plain_text(name.get<std::string>());
    return text;
  });
}
int show(FarmApi& api, const FarmFlags& flags) {
  const auto job = api.get(job_path(flags.id));
  const int code = show_answer(job, flags, job_text);
  if (code == kOk && !flags.farm.json) print_meters(api, *job);
  return code;
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

// Changes one setting of the job to the value that the text gives.
int change(FarmApi& api, const FarmFlags& flags, std::string_view name, const std::string& text) {
  coordinator::JobChange asked;
  Result<void> done;
  job::for_each_setting(asked, [&](const job::Setting& s, auto& value) {
    if (s.name == name)
      done = job::good_or(job::read(s, job::Form::option, text, value), s, job::Form::option, "");
  });
  return done ? change(api, flags, job::write_object(asked)) : print_error(done.error());
}

int extend(FarmApi& api, const FarmFlags& flags) {
  if (flags.spp.empty() == flags.target_error.empty())
    return usage_error("extend needs either --spp TOTAL or a smaller --target-error E");
  return flags.spp.empty() ? change(api, flags, "target_error", flags.target_error)
                           : change(api, flags, "spp", flags.spp);
}
int rename(FarmApi& api, const FarmFlags& flags) {
  if (!flags.frame.empty())
    return usage_error("a frame has the name of its sequence: rename the sequence, without --frame");
  return change(api, flags, "name", flags.name);
}
int priority(FarmApi& api, const FarmFlags& flags) { return change(api, flags, "priority", flags.priority); }

int after(FarmApi& api, const FarmFlags& flags) { return change(api, flags, {{"after", flags.after}}); }

int log(FarmApi& api, const FarmFlags& flags) { return print_lines(api.text(job_path(flags.id) + "/log")); }

// True if the job is rendered, but its final image cannot be written (ImageWriter of the coordinator). Such a
// job can be removed, to make room on a full disk.
bool is_unwritten(const json& job) {
  return text_field(job, "error").starts_with("the final image cannot be written");
}

// Removes a job that has ended. HTTP's DELETE of a job that has not ended cancels it: who asks to remove a
// job may not know that it still renders.
int remove(FarmApi& api, const FarmFlags& flags) {
  const auto job = api.get(job_path(flags.id));
  if (!job) return print_rejected(job.error());
  if (!is_over(*job) && !is_unwritten(*job)) {
    complain(fmt::format("job {} is {}: end it first, with lightshaft cancel {}", flags.id,
                         plain_text(text_field(*job, "state")), shell_word(flags.id)));
    return kFailed;
  }
  const auto done = api.remove(job_path(flags.id));
  return done ? kOk : print_rejected(done.error());
}

// Submits the scene of a job once more.
int again(FarmApi& api, const FarmFlags& flags) {
  const auto spec = flags.job.parse();
  if (!spec) return print_error(spec.error());
  const json body = job::write_object(*spec, job::goes_with_again);
  const auto job = api.post(job_path(flags.id) + "/again", body);
  if (!job) return print_rejected(job.error());
  print(flags.farm.json ? dump(*job) : plain_text(text_field(*job, "id")));
  return kOk;
}

int focus(FarmApi& api, const FarmFlags& flags) {
  if (flags.region.empty() != flags.none)
    return usage_error("focus needs either --region X0,Y0,X1,Y1 or --none");
  if (flags.none) return change(api, flags, {{"focus", nullptr}});
  return change(api, flags, "focus", flags.region);
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
  if (!flags.view.empty()) asked["view"] = flags.view;
  auto made = api.post(job_path(flags.id) + "/video", asked);
  for (; made; made = with_retries([&] { return api.get(job_path(flags.id) + "/video"); })) {
    const std::string state = text_field(*made, "state");
    if (state == "ready") break;
    if (state != "waiting" && state != "making") {
      complain(state == "failed" ? plain_text(text_field(*made, "error"))
                                 : "the coordinator was restarted meanwhile: request the video again");
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

std::string tev_address(const FarmFlags& flags) { return flags.tev == "true" ? kTevAddress : flags.tev; }

// Shows the image of a job in tev while it renders.
class LiveTev {
 public:
  LiveTev(FarmApi& api, Tev tev) : api_(api), tev_(std::move(tev)) {}

  // Is called several times a second. Pixels are sent each kCalls times if there are new ones.
  void look_at(const json& job) {
    const double spp = number_field(job, "spp_done").value_or(0);
    const bool over = is_over(job);
    if (++calls_ % kCalls != 0 && !over) return;
    if (gone_ || spp <= 0 || (spp == shown_ && !over)) return;
    shown_ = spp;
    if (const auto sent = tev_.show(api_, job, over); !sent) {
      // The job goes on, and so does who follows it.
      print_note("the image is shown in tev no more: " + plain_text(sent.error().error.message));
      gone_ = true;
    }
  }

 private:
  static constexpr int kCalls = 8;
  FarmApi& api_;
  Tev tev_;
  int calls_ = -1;
  double shown_ = 0;  // samples per pixel of the image that tev has
  bool gone_ = false;
};

int watch(FarmApi& api, const FarmFlags& flags) {
  std::optional<LiveTev> live;
  if (!flags.tev.empty()) {
    auto tev = Tev::open(tev_address(flags));
    if (!tev) return print_error(tev.error());
    live.emplace(api, std::move(*tev));
  }
  const LastWords words(goes_on(flags.id));
  const auto end = watch_job(api, flags.id, {flags.quiet, flags.farm.json, [&](const json& job) {
                                               if (live) live->look_at(job);
                                             }});
  if (!end) return print_rejected(end.error());
  if (const int code = print_end(*end, flags.quiet || !flags.farm.json); code != kOk) return code;
  if (!flags.farm.json) print(job_text(*end));
  if (!flags.quiet) print_denoised(api, *end);
  if (!flags.farm.json) print_meters(api, *end);
  return kOk;
}

// Reads a mix of light groups from a text of the command line or, if its name ends in .json, from a file.
Result<LightMix> mix_of(const std::string& text) {
  if (!text.ends_with(".json")) return parse_light_mix(text);
  const auto bytes = coordinator::read_file(text, std::uint64_t{1} << 16);
  if (!bytes) return tl::unexpected(bytes.error());
  auto mix = parse_light_mix({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!mix) mix.error().message = text + ": " + mix.error().message;
  return mix;
}

int show_in_tev(FarmApi& api, const FarmFlags& flags) {
  if (!flags.mix.empty()) return usage_error("--tev shows the image itself, without --mix");
  const auto job = api.get(job_path(flags.id));
  if (!job) return print_rejected(job.error());
  auto tev = Tev::open(tev_address(flags));
  if (!tev) return print_error(tev.error());
  const auto shown = tev->show(api, *job, true);
  return shown ? kOk : print_rejected(shown.error());
}

int fetch(FarmApi& api, const FarmFlags& flags) {
  std::string out = flags.out;
  if (!flags.tev.empty())
    if (const int code = show_in_tev(api, flags); code != kOk) return code;
  if (flags.out.empty() && flags.report.empty() && flags.html.empty() && flags.tev.empty()) {
    const auto job = api.get(job_path(flags.id));
    if (!job) return print_rejected(job.error());
    out = default_image(*job);
    if (!flags.farm.json) print_note("writes " + out);
  }
  if (const auto ok = check_view(flags.view, out); !ok) return print_error(ok.error());
  std::string mix;
  if (!flags.mix.empty()) {
    const auto read = mix_of(flags.mix);
    if (!read) return print_error(read.error());
    if (image_format(out) == ImageFormat::json)
      return usage_error("--mix: an image can be mixed, the values of meters cannot");
    mix = canonical_json(*read);
  }
  return fetch_results(api, flags.id,
                       {.image = out,
                        .report = flags.report,
                        .html = flags.html,
                        .mix = mix,
                        .view = flags.view,
                        .json = flags.farm.json});
}

// Adds --tev, an option that may stand without its value: it does not take the next word for it.
void add_tev(CLI::App& app, std::string& address, const std::string& what) {
  // A flag without a value is "true".
  app.add_flag("--tev", address,
               what + fmt::format("; --tev=HOST:PORT: in one that does not listen at {}", kTevAddress));
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
    return usage_error(
        fmt::format("no token has the id '{}': `lightshaft token list` prints the ids", flags.id));
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
    add_option(*command, "--frame", flags->frame, "N", "for a sequence: only this frame");
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
  const auto [jobs_command, listing] = add(app, action, "jobs", "list the jobs of a farm", jobs);
  jobs_command->footer(
      "Examples:\n"
      "  lightshaft jobs --state running,queued\n"
      "  lightshaft jobs --search chapel --sort=-submitted --limit 20");
  add_option(
      *jobs_command, "--state", listing->state, "STATE,...",
      "only jobs in these states: queued, held (queued, and waiting for other jobs), running, paused, done, "
      "failed, cancelled");
  add_option(*jobs_command, "--search", listing->search, "TEXT",
             "only jobs with this text in their name or id");
  add_option(*jobs_command, "--owner", listing->owner, "USER", "only jobs of this user");
  add_option(*jobs_command, "--sort", listing->sort, "ORDER",
             "sort by order (of submission, the default), active, submitted, name, owner, state, progress or "
             "relmse; a - in front reverses the order");
  add_option(*jobs_command, "--limit", listing->limit, "N", "show at most this many jobs");
  add_option(*jobs_command, "--offset", listing->offset, "N", "skip the first N jobs");
  add(app, action, "show", "one job", show, true);
  const auto [watch_command, watching] = add(app, action, "watch", "follow a job until it ends", watch, true);
  watch_command->add_flag("--quiet", watching->quiet, "no progress bar");
  add_tev(*watch_command, watching->tev, "show the image in the viewer tev while it renders");
  add(app, action, "pause", "pause a job", pause, true);
  add(app, action, "resume", "continue a paused job", resume, true);
  add(app, action, "cancel", "cancel a job for good", cancel, true);
  const auto [extend_command, extending] =
      add(app, action, "extend", "give a job more samples or a smaller target error, even after its end",
          extend, true);
  add_option(*extend_command, "--spp", extending->spp, "TOTAL", "the new total of samples per pixel");
  add_option(*extend_command, "--target-error", extending->target_error, "E",
             "for a job with a target error: continue until the image's relMSE is below this");
  const auto [rename_command, naming] = add(app, action, "rename", "change the name of a job", rename, true);
  add_option(*rename_command, "name", naming->name, "NAME", "the job's name in lists")->required();
  const auto [priority_command, ranking] =
      add(app, action, "priority", "change the priority of a job", priority, true);
  add_option(*priority_command, "priority", ranking->priority, "N",
             "jobs of higher priority are rendered first; default: 0")
      ->required();
  const auto [after_command, following] =
      add(app, action, "after", "make a job wait until others are done", after, true);
  add_option(*after_command, "jobs", following->after, "JOB", "the jobs to wait for; none: stop waiting");
  const auto [again_command, repeating] =
      add(app, action, "again", "submit the scene of a job again and print the new job's id", again, true);
  repeating->job.add_to(*again_command, JobOptions::Command::again);
  add(app, action, "log", "print the log of a job", log, true);
  add(app, action, "remove", "remove a job that has ended, with its image", remove, true);
  const auto [fetch_command, fetching] =
      add(app, action, "fetch", "fetch the image of a job, finished or not", fetch, true);
  fetch_command->footer(
      "Examples:\n"
      "  lightshaft fetch j-1234abcd                     writes SCENE.exr, or SCENE_####.exr of a sequence\n"
      "  lightshaft fetch j-1234abcd -o image.png\n"
      "  lightshaft fetch j-1234abcd --frame 7 -o seventh.exr\n"
      "  lightshaft fetch j-1234abcd --mix key=2,fill=0.5 -o brighter.exr");
  add_option(
      *fetch_command, "-o,--output", fetching->out, "OUT.exr",
      "file of the image, .exr or .png, or of the values of meters, .json; for a sequence with # for the "
      "frame number, for example out_####.exr; default: the scene's name in this folder");
  add_option(
      *fetch_command, "--mix", fetching->mix, "GROUP=FACTOR,...",
      "multiply the light of light groups: key=2,fill=0.5:0.4:0.3 (R:G:B), fog.volume=4 for the light of "
      "media alone; or a file MIX.json that the dashboard has saved. The job must have --aov light_groups");
  add_view(*fetch_command, fetching->view);
  add_option(*fetch_command, "--report", fetching->report, "REPORT.json",
             "also write the report as JSON; with # in the name, one for each frame");
  add_option(*fetch_command, "--html", fetching->html, "REPORT.html",
             "also write the report as an HTML page; with # in the name, one for each frame");
  add_tev(*fetch_command, fetching->tev,
          "show all layers in the viewer tev, and write no file unless one is named");
  const auto [focus_command, looking] = add(
      app, action, "focus", "choose the part of a job's image that gets the next samples first", focus, true);
  add_option(*focus_command, "--region", looking->region, "X0,Y0,X1,Y1",
             "render the tiles of these pixels before all others");
  focus_command->add_flag("--none", looking->none, "treat all tiles alike again");
  const auto [video_command, filming] =
      add(app, action, "video", "make a video of the finished frames of a sequence", video, true);
  add_option(*video_command, "-o,--output", filming->out, "OUT.mp4", "the video")->required();
  add_option(*video_command, "--fps", filming->fps, "N",
             "frames per second; default: --fps of the job, or 24");
  add_option(*video_command, "--exposure", filming->exposure, "STOPS", "exposure in stops; default: 0");
  add_view(*video_command, filming->view);
  video_command->add_flag("--denoised", filming->denoised, "show the denoised images");
  const auto [workers_command, asking] = add(app, action, "workers", "list the workers of a farm", workers);
  CLI::Option* log = add_option(*workers_command, "--log", asking->worker, "NAME",
                                "print the latest events of the worker with this name or id instead");
  add_option(*workers_command, "--restart", asking->restarted, "NAME",
             "let the worker with this name or id finish its units and restart its program (admins only)")
      ->excludes(log);
  add(app, action, "views", "list the views in which a farm can show colours", views);
}

void add_tokens(CLI::App& app, Action& action) {
  CLI::App* token = app.add_subcommand("token", "manage the tokens of a farm (admins only)");
  token->require_subcommand(1);
  const auto [adder, adding] =
      add(*token, action, "add", "make a token and print it; it cannot be shown again", add_token);
  adder
      ->add_option("--role", adding->role,
                   "role of the token: submit (own jobs), read, join (for workers) or admin")
      ->required()
      ->check(CLI::IsMember({"submit", "read", "join", "admin"}));
  add_option(*adder, "--user", adding->user, "NAME", "owner of the jobs that are submitted with the token");
  add(*token, action, "list", "list the tokens without their secrets", list_tokens);
  const auto [revoke, revoking] = add(*token, action, "revoke", "revoke a token at once", revoke_token);
  add_option(*revoke, "id", revoking->id, "ID", "id of the token, as `list` prints it")->required();
}

}  // namespace ls::cli
