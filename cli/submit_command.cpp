#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/farm_api.h"
#include "cli/farm_wait.h"
#include "cli/job_options.h"
#include "cli/json_fields.h"
#include "cli/output_file.h"
#include "cli/patience.h"
#include "cli/say.h"
#include "common/base/plain_text.h"

namespace ls::cli {
namespace {

struct Flags {
  std::string scene, out, report;
  JobOptions job;
  FarmOptions farm;
  bool wait = false, quiet = false;
};

int fetch_results(FarmApi& api, const std::string& id, const Flags& flags) {
  if (!flags.out.empty())
    if (const auto got = patiently([&] { return api.download(job_path(id) + "/image.exr", flags.out); });
        !got)
      return say_rejected(got.error());
  if (!flags.report.empty())
    if (const auto got = patiently([&] { return api.download(job_path(id) + "/report", flags.report); });
        !got)
      return say_rejected(got.error());
  return kOk;
}

int run(const Flags& flags) {
  const auto spec = flags.job.parse();
  if (!spec) return say_error(spec.error());
  for (const auto& [option, file] : {std::pair("-o", flags.out), std::pair("--report", flags.report)})
    if (!file.empty())
      if (const auto ok = check_output(option, file); !ok) return say_error(ok.error());
  // Here first: what is wrong is told before anything is sent.
  const auto scene = read_local_scene(flags.scene, spec->defines, flags.job.strict);
  if (!scene) return say_rejected(scene.error());
  say_diagnostics(scene->warnings);
  auto api = FarmApi::open(flags.farm);
  if (!api) return say_error(api.error());
  const auto job = api->submit(*scene, *spec, [&](const std::string& line) {
    if (!flags.quiet) say(line);
  });
  if (!job) return say_rejected(job.error());
  const std::string id = text_field(*job, "id");
  if (id.empty()) return say_error({Errc::internal, "the coordinator's answer names no job"});
  print(flags.farm.json ? job->dump() : plain_text(id));
  if (!flags.wait && flags.out.empty() && flags.report.empty()) return kOk;
  const auto end = watch_job(*api, id, {flags.quiet, flags.farm.json});
  if (!end) return say_rejected(end.error());
  if (const int code = say_end(*end); code != kOk) return code;
  return fetch_results(*api, id, flags);
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  auto flags = std::make_shared<Flags>();
  CLI::App* submit =
      app.add_subcommand("submit", "send a scene and its files to a farm; prints the job's id");
  submit->add_option("scene", flags->scene, "Mitsuba XML")->required()->type_name("SCENE");
  flags->farm.add_to(*submit);
  flags->job.add_to(*submit);
  submit->add_option("--priority", flags->job.priority, "higher goes first; default 0")->type_name("N");
  submit->add_option("--tags", flags->job.tags, "only workers with all of these")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("A,B");
  submit->add_flag("--wait", flags->wait, "until the job is done");
  submit->add_option("-o,--output", flags->out, "wait, then fetch the image")->type_name("OUT.exr");
  submit->add_option("--report", flags->report, "wait, then fetch the report")->type_name("REPORT.json");
  submit->add_flag("--quiet", flags->quiet, "only the id, warnings and errors");
  submit->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace ls::cli
