#include "cli/commands/compare_scenes.h"

#include <fmt/format.h>

#include <set>

#include "cli/local/local_scene.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "common/scene/schema/integrators.h"
#include "compare/picture.h"
#include "compare/racer.h"

namespace ls::cli {
namespace {

using coordinator::rejected;
using coordinator::Rejected;

class SceneRace {
 public:
  SceneRace(const CompareOptions& options, const std::string& name, const LocalScene& scene)
      : options_(options), scene_(scene) {
    race_.scene = name;
    race_.conditions = options.conditions;
  }

  tl::expected<race::Race, Rejected> run(const std::atomic<bool>& stop) {
    if (auto ok = line_up(); !ok) return tl::unexpected(std::move(ok.error()));
    auto reference = read_reference();
    if (!reference) return rejected(reference.error());
    auto scratch = race::Scratch::make();
    if (!scratch) return rejected(scratch.error());
    folder_ = scratch->folder();
    const auto make = [this](std::size_t entrant, std::size_t seed) { return racer(entrant, seed); };
    std::set<std::size_t> reported;
    const auto lanes = race::run_lanes(
        race_.entrants.size(), options_.seeds, make, stop, [&](std::size_t seed, std::size_t, double) {
          if (reported.insert(seed).second && !options_.quiet)
            print_note(fmt::format("lightshaft: {}: seed {} of {}", race_.scene, seed + 1, options_.seeds));
        });
    if (!lanes) return rejected(lanes.error());
    if (auto ok = race::judge(race_, *lanes, options_.seeds, *reference); !ok) return rejected(ok.error());
    return std::move(race_);
  }

 private:
  struct Ours {
    std::string name;
    JobSpec spec;
    std::optional<LocalWorld>
        world;  // the scene ready to trace, built for the first seed; nullopt: not kept, or already used
  };

  // Builds the world (the scene ready to trace) for each integrator that will be compared, so that errors are
  // found before hours of rendering. Keeps only the first world: all of them together would take too much
  // memory.
  tl::expected<void, Rejected> line_up() {
    std::vector<std::string> wanted = options_.integrators;
    if (wanted.empty()) wanted.emplace_back();
    bool first = true;
    for (const std::string& integrator : wanted) {
      Ours ours{integrator, {}, {}};
      ours.spec.defines = options_.defines;
      ours.spec.size = options_.size;
      ours.spec.seed = options_.first_seed;
      if (!integrator.empty()) ours.spec.integrator = integrator;
      auto world = build_local_world(scene_, ours.spec, options_.conditions.threads);
      if (!world) return tl::unexpected(std::move(world.error()));
      if (first) race_.conditions.size = world->job.settings.size;
      scenes_.push_back(world->job.scene);
      if (ours.name.empty()) ours.name = world->job.settings.integrator;
      const bool whole = scene_.scene.media.empty() || scene::sees_media(world->job.settings.integrator);
      race_.entrants.push_back({"Lightshaft " + ours.name, whole});
      if (first) ours.world = std::move(*world);
      ours_.push_back(std::move(ours));
      first = false;
    }
    return {};
  }

  Result<std::optional<race::Reference>> read_reference() {
    std::vector<std::filesystem::path> files = options_.reference;
    if (!options_.references.empty()) files = references_in(options_.references, race_.scene);
    if (files.empty()) {
      if (auto possible = race::judges_itself(race_, options_.seeds); !possible)
        return tl::unexpected(possible.error());
      return std::optional<race::Reference>();
    }
    std::vector<race::ReferenceFile> read;
    for (const auto& file : files) {
      auto picture = race::read_reference(file, race_.conditions.size);
      if (!picture) return bad_argument("--reference: " + picture.error().message);
      if (auto own = refuse_own_noise(*picture); !own) return tl::unexpected(own.error());
      read.push_back(std::move(*picture));
    }
    race_.reference = race::describe(read);
    return std::optional(race::combine(read));
  }

  // Rejects a reference image that was rendered from this scene with one of the seeds of the images that are
  // compared with it. The reference would have the same noise as the image with that seed, whose error would
  // therefore seem much smaller than it is.
  Result<void> refuse_own_noise(const race::ReferenceFile& file) const {
    for (const Digest& scene : scenes_)
      for (std::size_t i = 0; i < options_.seeds; ++i)
        if (const std::uint64_t seed = options_.first_seed + i; same_noise(file.picture.origin, scene, seed))
          return bad_argument(fmt::format(
              "--reference: {} was rendered from this scene with seed {}, which races, too: its noise is "
              "the same noise; race other seeds (--seed {})",
              file.name, seed, seed + 1));
    return {};
  }

  Result<std::unique_ptr<race::Racer>> racer(std::size_t entrant, std::size_t seed) {
    const std::string name = fmt::format("{}-{}", entrant, seed);
    Ours& ours = ours_[entrant];
    ours.spec.seed = options_.first_seed + seed;
    std::optional<LocalWorld> world = std::exchange(ours.world, std::nullopt);
    if (!world) {
      auto built = build_local_world(scene_, ours.spec, options_.conditions.threads);
      if (!built) return tl::unexpected(built.error().error);
      world = std::move(*built);
    }
    const RenderSettings& settings = world->job.settings;
    return race::make_render_racer({world->world, {settings.size, settings.tile}, name, folder_},
                                   race_.conditions);
  }

  const CompareOptions& options_;
  const LocalScene& scene_;
  race::Race race_;
  std::vector<Ours> ours_;
  // Digests of the scene, one per integrator, because the scene is reduced to what the integrator can see.
  // They are compared with the digest in a reference file, which identifies the scene that it shows.
  std::vector<Digest> scenes_;
  std::filesystem::path folder_;
};

}  // namespace

std::vector<std::string> scene_names(const std::vector<std::string>& files) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const std::string& file : files) {
    const auto path = std::filesystem::absolute(file).lexically_normal();
    const std::string stem = path.stem().string(), folder = path.parent_path().filename().string();
    const std::string name = stem == "scene" && !folder.empty() ? folder : stem;
    std::string unique = name;
    for (int k = 2; !taken.insert(unique).second; ++k) unique = fmt::format("{}-{}", name, k);
    names.push_back(unique);
  }
  return names;
}

std::vector<std::filesystem::path> references_in(const std::filesystem::path& folder,
                                                 const std::string& name) {
  std::error_code none;
  const auto first = folder / (name + ".0.exr"), second = folder / (name + ".1.exr"),
             only = folder / (name + ".exr");
  if (std::filesystem::exists(first, none) && std::filesystem::exists(second, none)) return {first, second};
  if (std::filesystem::exists(only, none)) return {only};
  return {};
}

tl::expected<race::Race, Rejected> race_scene(const CompareOptions& options, const std::string& file,
                                              const std::string& name, const std::atomic<bool>& stop) {
  const auto scene = read_local_scene(file, options.defines, options.strict);
  if (!scene) return tl::unexpected(scene.error());
  return SceneRace(options, name, *scene).run(stop);
}

}  // namespace ls::cli
