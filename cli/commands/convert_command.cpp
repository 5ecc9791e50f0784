// lightshaft convert: any scene as canonical Mitsuba 3 XML, with its files beside it.
#include <fmt/format.h>

#include <filesystem>

#include "cli/commands/commands.h"
#include "cli/commands/converted.h"
#include "cli/local/local_scene.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "common/scene/json/serialize.h"

namespace ls::cli {
namespace {

struct ConvertFlags {
  std::string in, out;
  std::vector<std::string> defines;
  bool strict = false, quiet = false;
};

int run(const ConvertFlags& flags) {
  const auto defines = parse_defines(flags.defines);
  if (!defines) return print_error(defines.error());
  if (const auto ok = check_output("OUT", flags.out); !ok) return print_error(ok.error());
  std::error_code error;
  if (std::filesystem::equivalent(flags.in, flags.out, error))
    return usage_error(fmt::format("{} would be written over itself: choose another OUT", flags.in));
  const auto scene = read_local_scene(flags.in, *defines, flags.strict);
  if (!scene) return print_rejected(scene.error());
  print_diagnostics(scene->warnings);
  const auto converted = convert_scene(*scene, flags.out);
  if (!converted) return print_error(converted.error());
  for (const FileCopy& copy : converted->copies) {
    if (!flags.quiet && copy.renamed)
      print_note(fmt::format("{} becomes {}", copy.name_before, copy.to.string()));
    if (const auto done = copy_beside(copy); !done) return print_error(done.error());
  }
  if (const auto written = write_output(flags.out, converted->text); !written)
    return print_error(written.error());
  print(fmt::format("scene_sha256 {}", converted->digest.hex()));
  return kOk;
}

}  // namespace

void add_convert(CLI::App& app, Action& action) {
  auto flags = std::make_shared<ConvertFlags>();
  CLI::App* convert = app.add_subcommand("convert",
                                         "write a scene as canonical Mitsuba 3 XML. Its files are copied to "
                                         "OUT's folder under the names that the scene "
                                         "has for them, unless they are there; a name that leads out of the "
                                         "folder becomes one in it. OUT has the same "
                                         "digest then, if no file had to be renamed; it is printed");
  convert->add_option("in", flags->in, "the scene")->required()->type_name("IN");
  convert->add_option("out", flags->out, "the XML file to write")->required()->type_name("OUT");
  convert->add_option("-D,--define", flags->defines, "sets the scene's $name")
      ->allow_extra_args(false)
      ->type_name("name=value");
  convert->add_flag("--strict", flags->strict, "warnings are errors");
  convert->add_flag("--quiet", flags->quiet, "only the digest, warnings and errors");
  convert->callback([flags, &action] { action = [flags] { return run(*flags); }; });
}

}  // namespace ls::cli
