#include "cli/local/sequence_render.h"

#include <fmt/format.h>

#include "cli/output/console.h"
#include "cli/output/output_file.h"

namespace ls::cli {
namespace {

std::filesystem::path of_frame(const std::filesystem::path& path, std::uint32_t frame) {
  return numbered(path.string(), frame);
}

LocalRenderOptions of_frame(const LocalRenderOptions& options, std::uint32_t frame) {
  LocalRenderOptions o = options;
  o.spec.frames = FrameRange{frame, frame, 1};
  o.out = of_frame(options.out, frame);
  for (auto* path : {&o.report, &o.html, &o.partial_dir, &o.reference})
    if (*path) *path = of_frame(**path, frame);
  return o;
}

Result<void> check_frames_outputs(const FrameRange& frames, const LocalRenderOptions& options) {
  const auto check = [&](const char* option, const std::filesystem::path& path,
                         bool is_file) -> Result<void> {
    if (auto ok = check_numbered(option, path.string(), frames); !ok) return ok;
    for (const std::uint32_t frame : frames.frames())
      if (is_file)
        if (auto ok = check_output(option, of_frame(path, frame)); !ok) return ok;
    return {};
  };
  if (auto ok = check("-o", options.out, true); !ok) return ok;
  if (options.report)
    if (auto ok = check("--report", *options.report, true); !ok) return ok;
  if (options.html)
    if (auto ok = check("--html", *options.html, true); !ok) return ok;
  return options.partial_dir ? check("--partial-dir", *options.partial_dir, false) : Result<void>{};
}

}  // namespace

int render_sequence(const std::string& path, const FrameRange& frames, const LocalRenderOptions& options) {
  if (const auto ok = check_frames_outputs(frames, options); !ok) return print_error(ok.error());
  auto reader = SceneReader::open(path, options.spec.defines, options.strict);
  if (!reader) return print_rejected(reader.error());
  if (const auto all = reader->read_all(frames); !all) return print_rejected(all.error());
  for (const std::uint32_t frame : frames.frames()) {
    const auto scene = reader->read(frame);
    if (!scene) return print_rejected(scene.error());
    if (!options.quiet && frames.count() > 1) print_note(fmt::format("lightshaft: frame {}", frame));
    if (const int code = render_locally(*scene, of_frame(options, frame)); code != kOk) return code;
  }
  return kOk;
}

}  // namespace ls::cli
