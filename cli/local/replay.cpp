#include "cli/local/replay.h"

#include <fmt/format.h>

#include "cli/local/local_world.h"
#include "cli/output/console.h"

namespace ls::cli {

int replay_sample(const LocalScene& scene, const JobSpec& spec, int threads, std::pair<int, int> pixel,
                  std::uint64_t sample) {
  const auto built = build_local_world(scene, spec, threads);
  if (!built) return print_rejected(built.error());
  const auto [x, y] = pixel;
  const FrameSize size = built->job.settings.size;
  if (x >= size.width || y >= size.height)
    return usage_error(
        fmt::format("--pixel {},{}: the image is {} x {}, counted from 0", x, y, size.width, size.height));
  const render::SampleValue value = render::render_sample(*built->world, x, y, sample);
  print(fmt::format("pixel {},{} sample {}: {:.9g} {:.9g} {:.9g}", x, y, sample, value.rgb[0], value.rgb[1],
                    value.rgb[2]));
  for (const auto& [cause, entry] : value.health.causes) print(sentence(cause, entry.count));
  return kOk;
}

}  // namespace ls::cli
