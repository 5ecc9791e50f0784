#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <random>

#include "cli/commands/commands.h"
#include "cli/farm/farm_api.h"
#include "cli/farm/job_results.h"
#include "cli/output/console.h"
#include "cli/output/files_to_come.h"
#include "cli/output/interrupt.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"
#include "core/image/reference/reference.h"
#include "worker/machine.h"

namespace ls::cli {
namespace {

struct SubmitFlags {
  std::string scene, name, out, view, report, html, reference;
  JobOptions job;
  FarmOptions farm;
  std::vector<std::string> after_files;
  bool wait = false, quiet = false;
};

using Job = FarmApi::Answer<FarmApi::Json>;

// Reads the scene before submitting it, so that its errors are reported before anything is sent.
Job submit_scene(const SubmitFlags& flags, const JobSpec& spec) {
  auto reader = SceneReader::open(flags.scene, spec.defines, flags.job.strict);
  if (!reader) return tl::unexpected(reader.error());
  auto scene = spec.frames ? reader->read_all(*spec.frames) : reader->read({});
  if (!scene) return tl::unexpected(scene.error());
  if (!flags.name.empty()) scene->title = flags.name;
  print_diagnostics(scene->warnings);
  auto api = FarmApi::open(flags.farm);
  if (!api) return coordinator::rejected(api.error());
  return api->submit(*scene, spec, [&](const std::string& line) {
    if (!flags.quiet) print_note(line);
  });
}

Job submit_bundle(const SubmitFlags& flags, const JobSpec& spec, const std::string& type) {
  if (flags.job.strict)
    return coordinator::rejected(
        {Errc::invalid_argument, "--strict: a bundle is read by the coordinator, which has no such choice"});
  std::error_code error;
  if (!std::filesystem::is_regular_file(flags.scene, error))
    return coordinator::rejected(
        {Errc::invalid_argument, fmt::format("{}: there is no such file", flags.scene)});
  auto api = FarmApi::open(flags.farm);
  if (!api) return coordinator::rejected(api.error());
  auto job = api->submit_bundle(flags.scene, type, spec_query(spec, flags.job.given(), flags.name));
  if (!job) return job;
  for (const std::string& warning : texts_field(*job, "warnings")) print_note(warning);
  return job;
}

int wait_and_fetch(const std::string& id, const SubmitFlags& flags) {
  auto api = FarmApi::open(flags.farm);
  if (!api) return print_error(api.error());
  const auto end = watch_job(*api, id, {flags.quiet, flags.farm.json});
  if (!end) return print_rejected(end.error());
  const int code = print_end(*end, flags.quiet);
  if (code != kOk && done_frames(*end) == 0) return code;
  if (code == kOk && !flags.quiet) print_denoised(*api, *end);
  // One frame that has failed does not keep the others from being written.
  const int fetched = fetch_results(*api, id,
                                    {.image = flags.out,
                                     .report = flags.report,
                                     .html = flags.html,
                                     .view = flags.view,
                                     .patient = true,
                                     .done_only = code != kOk});
  return code == kOk ? fetched : code;
}

// Asks the farm for the view of --view, so that a wrong name is not noticed when the job is done.
FarmApi::Answer<void> check_view_of_farm(const SubmitFlags& flags) {
  auto api = FarmApi::open(flags.farm);
  if (!api) return coordinator::rejected(api.error());
  const auto cube = api->text("/api/v1/views/cube" + query_of({{"view", flags.view}}));
  if (cube) return {};
  if (cube.error().error.code != Errc::not_found) return tl::unexpected(cube.error());
  return coordinator::rejected({Errc::invalid_argument, "--view: " + cube.error().error.message});
}

// Uploads the reference image, and stores its digest in `spec`. Must be called before the job is submitted.
FarmApi::Answer<void> send_reference(const SubmitFlags& flags, JobSpec& spec) {
  if (spec.frames && spec.frames->count() > 1)
    return coordinator::rejected(
        {Errc::invalid_argument,
         "--reference is one image, and the job has several frames: submit them one by one"});
  auto api = FarmApi::open(flags.farm);
  if (!api) return coordinator::rejected(api.error());
  const auto digest = api->upload(flags.reference, [&](const std::string& line) {
    if (!flags.quiet) print_note(line);
  });
  if (!digest) return tl::unexpected(digest.error());
  spec.reference = *digest;
  return {};
}

// Tells the farm of a job that waits for files, so that the dashboard and `lightshaft jobs` show it.
class Announcement {
 public:
  static constexpr std::size_t kFilesNamed = 5;  // as many as the farm keeps
  Announcement(const SubmitFlags& flags, const JobSpec& spec) : flags_(flags), spec_(spec) {}

  // A farm that does not answer, or knows no announcements, does not end the wait. One that does not accept
  // the token does: it would not accept the job either.
  Result<void> repeat(const std::vector<std::string>& files) {
    auto api = FarmApi::open(flags_.farm);
    if (!api) return tl::unexpected(api.error());
    const auto named = static_cast<std::ptrdiff_t>(std::min(files.size(), kFilesNamed));
    FarmApi::Json body{
        {"name", flags_.name.empty() ? std::filesystem::path(flags_.scene).filename().string() : flags_.name},
        {"machine", worker::host_name()},
        {"files", std::vector(files.begin(), files.begin() + named)},
        {"count", files.size()}};
    if (spec_.frames) body["frames"] = to_string(*spec_.frames);
    const auto done = api->put(path_, body);
    announced_ |= done.has_value();
    if (done) return {};
    const Error& error = done.error().error;
    const bool refused = error.code == Errc::permission_denied || error.code == Errc::unauthenticated;
    return refused ? tl::unexpected(error) : Result<void>();
  }
  void withdraw() {
    if (!announced_) return;
    if (auto api = FarmApi::open(flags_.farm)) (void)api->remove(path_);
  }

 private:
  static std::string new_path() {
    std::random_device random;
    return fmt::format("/api/v1/announced/{:08x}{:08x}", random(), random());
  }
  const SubmitFlags& flags_;
  const JobSpec& spec_;
  const std::string path_ = new_path();
  bool announced_ = false;
};

int run(const SubmitFlags& flags) {
  auto spec = flags.job.parse();
  if (!spec) return print_error(spec.error());
  for (const auto& [option, file] :
       {std::pair("-o", flags.out), std::pair("--report", flags.report), std::pair("--html", flags.html)})
    if (!file.empty())
      if (const auto ok = check_outputs(option, file, spec->frames); !ok) return print_error(ok.error());
  if (const auto ok = check_view(flags.view, flags.out); !ok) return print_error(ok.error());
  if (!flags.view.empty())
    if (const auto ok = check_view_of_farm(flags); !ok) return print_rejected(ok.error());
  Announcement announcement(flags, *spec);
  std::string noted;
  const auto waiting = [&](const std::vector<std::string>& files) {
    if (std::string text = waits_for(files); text != noted && !flags.quiet)
      print_note(noted = std::move(text));
    return announcement.repeat(files);
  };
  if (const auto there = wait_for_files(flags.after_files, spec->frames, waiting); !there)
    return print_error(there.error());
  if (!flags.reference.empty())
    if (const auto sent = send_reference(flags, *spec); !sent) return print_rejected(sent.error());
  const auto type = bundle_type(flags.scene);
  const Job job = type ? submit_bundle(flags, *spec, *type) : submit_scene(flags, *spec);
  announcement.withdraw();
  if (!job) return print_rejected(job.error());
  const std::string id = text_field(*job, "id");
  if (id.empty()) return print_error({Errc::internal, "the coordinator's answer names no job"});
  if (flag_field(*job, "reference_same_seed")) print_note(fmt::format("warning: {}", kSameSeed));
  const bool waits = flags.wait || !flags.out.empty() || !flags.report.empty() || !flags.html.empty();
  std::optional<LastWords> words;
  if (waits) words.emplace(goes_on(id));
  print(flags.farm.json ? job->dump() : plain_text(id));
  return waits ? wait_and_fetch(id, flags) : kOk;
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  const auto [submit, flags] = add_command<SubmitFlags>(
      app, action, "submit", "send a scene and its files to a farm; prints the job's id", run);
  add_option(*submit, "scene", flags->scene, "SCENE",
             "Mitsuba XML, .pbrt, .gltf or .glb, or a .zip, .tar or .tar.gz with one and all its files")
      ->required();
  submit->footer(
      "Examples:\n"
      "  lightshaft submit scene.xml --spp 256 --wait -o scene.exr\n"
      "  lightshaft submit scene.xml --name 'chapel v3' --denoise      prints the job's id: watch, fetch\n"
      "  lightshaft submit smoke.xml --frames 1-48 -o out_####.exr\n"
      "  lightshaft submit beauty.xml --frames 1-48 --after j-1234abcd  each frame after that job's frame");
  flags->farm.add_to(*submit);
  flags->job.add_to(*submit, JobOptions::Command::submit);
  add_option(*submit, "--name", flags->name, "NAME", "name of the job in lists; default: the scene's file");
  add_option(*submit, "--reference", flags->reference, "REF.exr",
             "the true image, rendered with another seed: every checkpoint is compared with it");
  add_option(
      *submit, "--after-file", flags->after_files, "FILE",
      "submit once this file is there and has not changed for 5 seconds; # stands for the frame number "
      "of every frame; can be given again for further files")
      ->allow_extra_args(false);
  add_view(*submit, flags->view);
  submit->add_flag("--wait", flags->wait, "wait until the job is done");
  add_option(
      *submit, "-o,--output", flags->out, "OUT.exr",
      "wait, then fetch the image, .exr or .png, or the values of meters, .json; of a sequence those of "
      "all frames, for example out_####.exr");
  add_option(*submit, "--report", flags->report, "REPORT.json",
             "wait, then fetch the report; with # in its name, every frame's");
  add_option(*submit, "--html", flags->html, "REPORT.html",
             "wait, then fetch the report as a page; of a sequence every frame's, with # in the name");
  submit->add_flag("--quiet", flags->quiet, "only the id, warnings and errors");
}

}  // namespace ls::cli
