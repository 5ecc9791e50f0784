// lightshaft verify: checks that an image is the result of its scene. An image's *seal*, one of its headers,
// contains the digest of each layer and of each other header.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>
#include <thread>

#include "cli/commands/commands.h"
#include "cli/local/local_scene.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "cli/output/interrupt.h"
#include "cli/output/job_options.h"
#include "cli/output/output_file.h"
#include "coordinator/admission/layer_names.h"
#include "coordinator/store/files.h"
#include "core/base/safe_text.h"
#include "core/image/film/film.h"
#include "core/image/frame/rounds.h"
#include "core/job/limits.h"
#include "core/job/sealed_image.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/json/serialize.h"
#include "worker/machine.h"
#include "worker/render/render.h"

namespace ls::cli {
namespace {

constexpr std::uint64_t kDefaultTiles = 4;

struct VerifyFlags {
  std::string image, scene, frame, tiles, seed;
  SceneChanges changes;
  std::vector<std::string> defines;
  int threads = 0;
  bool json = false;
};

Result<FinalPicture> open_image(const std::string& path) {
  const auto bytes = coordinator::read_file(path, kMaxFinalBytes);
  if (!bytes) return tl::unexpected(bytes.error());
  return read_final_exr(*bytes, path);
}

// The deep image of a job, beside its image.
struct DeepFile {
  std::string path;
  DeepPicture picture;
  std::vector<std::size_t> first;  // for each pixel the index of its first sample
};
// Reads the deep image beside the image of this name. Fails if it is not that of the same samples.
Result<DeepFile> open_deep(const std::string& image, const SealedImage& sealed) {
  DeepFile deep{deep_file(image).string(), {}, {}};
  const auto bytes = coordinator::read_file(deep.path, std::uint64_t{1} << 36);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto check = [&](const DeepPicture& header) -> Result<void> {
    if (header.rows.size != sealed.picture.size)
      return bad_argument(fmt::format("{}: it has another size than {}", deep.path, image));
    for (const char* name : {"lightshaft:scene", "lightshaft:job", "lightshaft:class", "lightshaft:tiles"}) {
      const auto ours = sealed.picture.strings.find(name);
      const auto theirs = header.strings.find(name);
      if (ours == sealed.picture.strings.end() || theirs == header.strings.end() ||
          ours->second != theirs->second)
        return bad_argument(
            fmt::format("{}: its header \"{}\" is not that of {}: it is the deep image of other "
                        "samples",
                        deep.path, name, image));
    }
    return {};
  };
  auto picture = read_deep_exr(*bytes, deep.path,
                               {static_cast<std::uint32_t>(sealed.settings.deep), kMaxFilmBytes, check});
  if (!picture) return tl::unexpected(picture.error());
  deep.picture = std::move(*picture);
  std::size_t first = 0;
  for (const std::uint32_t count : deep.picture.rows.counts) {
    deep.first.push_back(first);
    first += count;
  }
  return deep;
}

// Returns the first pixel of the tile whose samples in the deep image are not those of the film.
std::optional<std::pair<int, int>> deep_difference(const DeepFile& deep, const SealedImage& image,
                                                   const Film& film, TileIndex tile) {
  const int row = static_cast<int>(tile) / film.grid().columns(), top = row * film.grid().tile;
  const PixelRect rect = film.grid().rect(tile);
  ImageForm form = image.form;
  form.float_output = deep.picture.floats;
  const DeepRows ours = deep_rows(film.row(row), form);
  const auto width = static_cast<std::size_t>(ours.size.width);
  std::size_t at = 0;
  for (std::size_t i = 0; i < ours.counts.size(); at += ours.counts[i++]) {
    const int x = static_cast<int>(i % width), y = top + static_cast<int>(i / width);
    if (x < rect.x0 || x >= rect.x1) continue;
    const std::size_t theirs = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
    const auto begin = deep.picture.rows.samples.begin() + static_cast<std::ptrdiff_t>(deep.first[theirs]);
    if (deep.picture.rows.counts[theirs] != ours.counts[i] ||
        !std::equal(begin, begin + ours.counts[i], ours.samples.begin() + static_cast<std::ptrdiff_t>(at)))
      return std::pair(x, y);
  }
  return std::nullopt;
}

// Checks that the image was rendered from this scene, and that this machine has the image's numeric class.
Result<void> check_same(const SealedImage& image, const LocalScene& scene, const VerifyFlags& flags) {
  if (const Digest mine = digest_of(scene.scene); mine != image.scene)
    return bad_argument(fmt::format(
        "{} was rendered from scene {}, and {} is scene {}: give the same scene file, with the same -D, "
        "--techniques, --mix and --frame",
        flags.image, image.scene.hex(), flags.scene, mine.hex()));
  if (render::numeric_class() != image.numeric_class)
    return fail(
        Errc::failed_precondition,
        fmt::format(
            "{} was rendered in numeric class {} (build \"{}\"), and this machine and build are of class {}: "
            "bits can only be compared within one class. Run verify with that build, on such a machine",
            flags.image, image.numeric_class.hex().substr(0, 12), plain_text(image.build),
            render::numeric_class().hex().substr(0, 12)));
  return {};
}

struct VerifiedTile {
  TileIndex tile = 0;
  PixelRect rect;
  std::uint64_t spp = 0;
  // True if verification was interrupted before the tile was rendered: its result is unknown.
  bool stopped = false;
  TileError error;      // error of the tile, estimated from its samples
  std::string problem;  // what is wrong with the tile; empty: its digest and all layers match

  bool wrong() const { return !problem.empty(); }
};

// Returns `count` distinct tiles from 0 to `all` - 1, or all of them if there are fewer, in ascending order.
// The choice is a function of `seed`.
std::vector<TileIndex> random_tiles(TileIndex all, std::uint64_t count, std::uint64_t seed) {
  std::vector<TileIndex> tiles(all);
  std::iota(tiles.begin(), tiles.end(), TileIndex{0});
  if (count >= all) return tiles;
  std::mt19937_64 random(seed);
  std::vector<TileIndex> chosen;
  std::sample(tiles.begin(), tiles.end(), std::back_inserter(chosen), static_cast<std::ptrdiff_t>(count),
              random);
  return chosen;
}

// Renders all rounds of the tile again. Compares the hash chain over the rounds' digests with the chain
// stored in the image, and the values in every layer with the image's. The world must have been built from
// the image's scene and settings. `deep` is the deep image beside it, or null.
VerifiedTile verify_tile(const render::World& world, const SealedImage& image, const DeepFile* deep,
                         TileIndex tile, const std::atomic<bool>& stop) {
  VerifiedTile out{tile, image.grid().rect(tile), 0, false, {}};
  const auto spp = tile_samples(image, tile);
  if (!spp) {
    out.problem = spp.error().message;
    return out;
  }
  out.spp = *spp;
  const AovSet aovs = aovs_of(image.settings);
  Film film(image.grid(), aovs);
  const Digest settings = digest_of(image.settings);
  for (RoundIndex k = 0; *spp > 0 && k < round_count(*spp); ++k) {
    const SampleRange samples = cut_range(k, *spp);
    render::TileResult rendered = render::render_tile(world, out.rect, samples, &stop, nullptr);
    if (rendered.stopped) {
      out.stopped = true;
      return out;
    }
    const Partial partial{
        {image.scene, settings, image.numeric_class, out.rect, samples}, std::move(rendered.sums), aovs};
    if (const auto folded = film.fold(tile, k, partial); !folded) {
      out.problem = folded.error().message;
      return out;
    }
  }
  if (film.tile_digest(tile) != image.tiles[tile])
    out.problem = fmt::format("rendered again it has the digest {}, but the image's seal has {}",
                              film.tile_digest(tile).hex(), image.tiles[tile].hex());
  else if (const auto pixel = first_difference(image, film, tile))
    out.problem = fmt::format(
        "the seal is right, but pixel {},{} has another value in layer {} than its samples: the image was "
        "changed afterwards",
        pixel->x, pixel->y, pixel->layer);
  else if (const auto at = deep ? deep_difference(*deep, image, film, tile) : std::nullopt)
    out.problem = fmt::format("pixel {},{} of {} has other samples than the slices of this image", at->first,
                              at->second, deep->path);
  out.error = film.error(tile);
  return out;
}

// Returns, as "header NAME", the headers in the image that contradict its settings or the names in the scene.
// If `tiles` has all tiles of the image, also returns headers that contradict the tiles' samples. The other
// headers (seconds, health, ...) are not checked here: only the seal (the digests of all layers and headers)
// protects them.
std::vector<std::string> wrong_headers(const SealedImage& image, const LayerNames& names,
                                       const std::vector<VerifiedTile>& tiles) {
  auto expected = final_layers(Film(image.grid(), aovs_of(image.settings)).row(0), names, image.form).strings;
  expected["lightshaft:seed"] = fmt::format("{}", image.settings.seed);
  const bool all = tiles.size() == image.grid().count() &&
                   std::none_of(tiles.begin(), tiles.end(), [](const auto& t) { return t.stopped; });
  if (all) {
    TileError sums;
    std::uint64_t missing = 0;
    for (const VerifiedTile& t : tiles) {
      if (t.spp > 0) sums.add(t.error);
      if (t.spp == 0) missing += static_cast<std::uint64_t>(t.rect.pixels());
    }
    expected.merge(error_strings(sums, missing));
    // The verdict cannot be checked: it also depends on the convergence curve of the job, which is unknown
    // here.
    expected.erase("lightshaft:verdict");
  }
  std::vector<std::string> wrong;
  for (const auto& [name, value] : expected) {
    const auto found = image.picture.strings.find(name);
    if (found == image.picture.strings.end() || found->second != value) wrong.push_back("header " + name);
  }
  return wrong;
}

// The number of tiles with each result; `stopped` counts tiles that were not rendered, because the user
// interrupted the check.
struct Tally {
  std::size_t right = 0, wrong = 0, stopped = 0;
};
Tally tally_of(const std::vector<VerifiedTile>& tiles) {
  Tally t;
  for (const VerifiedTile& v : tiles) ++(v.stopped ? t.stopped : v.wrong() ? t.wrong : t.right);
  return t;
}

std::string tile_verdict(const VerifiedTile& t) {
  return t.stopped ? "stopped" : t.wrong() ? "fail" : "pass";
}

// The result of checking a whole file: whether it has a seal, and the layers and headers that differ from the
// seal or from their computed values.
struct Contents {
  bool sealed = false;
  std::vector<std::string> changed;  // changed parts, such as "layer depth.Z"

  bool as_sealed() const { return sealed && changed.empty(); }
  std::string verdict() const { return !changed.empty() ? "fail" : sealed ? "pass" : "unsealed"; }
};
Contents contents_of(const FinalPicture& picture) {
  return {picture.changed.has_value(), picture.changed.value_or(std::vector<std::string>{})};
}

std::string line_of(const Contents& c) {
  if (!c.changed.empty()) return fmt::format("differs from the seal: {}", fmt::join(c.changed, ", "));
  if (c.sealed) return "all layers and headers match the seal";
  return "the image has no seal of its layers and headers: tiles that were not rendered again may have been "
         "changed";
}

nlohmann::ordered_json to_json(const std::vector<VerifiedTile>& tiles, const Contents& contents,
                               std::uint64_t seed) {
  nlohmann::ordered_json j{{"seed", seed}, {"tiles", nlohmann::ordered_json::array()}};
  for (const VerifiedTile& t : tiles) {
    j["tiles"].push_back({{"tile", t.tile},
                          {"rect", {t.rect.x0, t.rect.y0, t.rect.x1, t.rect.y1}},
                          {"spp", t.spp},
                          {"verdict", tile_verdict(t)},
                          {"problem", t.problem}});
  }
  j["contents"] = {{"verdict", contents.verdict()}, {"changed", contents.changed}};
  const Tally tally = tally_of(tiles);
  j["verdict"] = tally.wrong > 0 ? "fail" : tally.stopped > 0 ? "stopped" : contents.verdict();
  if (!contents.changed.empty()) j["verdict"] = "fail";
  return j;
}

std::string line_of(const VerifiedTile& t) {
  return fmt::format("tile {} [{},{} to {},{}), {} samples: {}", t.tile, t.rect.x0, t.rect.y0, t.rect.x1,
                     t.rect.y1, t.spp, t.wrong() ? t.problem : "as sealed");
}

// Verifies the tiles in parallel; each thread renders one tile at a time.
std::vector<VerifiedTile> verify_all(const render::World& world, const SealedImage& image,
                                     const DeepFile* deep, const std::vector<TileIndex>& tiles, int threads,
                                     bool quiet, const std::atomic<bool>& stop) {
  std::vector<VerifiedTile> out(tiles.size());
  std::atomic<std::size_t> next{0};
  std::mutex printing;
  const auto work = [&] {
    for (std::size_t i = next++; i < tiles.size(); i = next++) {
      out[i] = verify_tile(world, image, deep, tiles[i], stop);
      const std::lock_guard lock(printing);
      if (!quiet && !out[i].stopped) print(line_of(out[i]));
    }
  };
  std::vector<std::jthread> team;
  for (int k = 1; k < std::min<int>(threads, static_cast<int>(tiles.size())); ++k) team.emplace_back(work);
  work();
  team.clear();
  return out;
}

struct Numbers {
  std::uint64_t tiles = kDefaultTiles, seed = 0;
  std::optional<std::uint32_t> frame;
};
Result<Numbers> numbers_of(const VerifyFlags& flags) {
  Numbers n;
  n.seed = std::random_device{}();
  for (const auto& ok :
       {take(flags.tiles, n.tiles, whole("--tiles", 1, UINT32_MAX)),
        take(flags.seed, n.seed, whole("--seed", 0, UINT64_MAX)), take(flags.frame, n.frame, parse_frame)})
    if (!ok) return tl::unexpected(ok.error());
  return n;
}

int run(const VerifyFlags& flags) {
  if (flags.scene.empty())
    return usage_error(
        fmt::format("the scene is missing: lightshaft verify {} --scene SCENE.xml", shell_word(flags.image)));
  // Declared before `interrupt`, so that it outlives the thread of `interrupt`, which sets it.
  std::atomic<bool> stop{false};
  Interrupt interrupt;
  interrupt.on_signal([&] { stop = true; });
  const auto numbers = numbers_of(flags);
  if (!numbers) return print_error(numbers.error());
  const auto defines = parse_defines(flags.defines);
  if (!defines) return print_error(defines.error());
  auto picture = open_image(flags.image);
  if (!picture) return print_error(picture.error());
  Contents contents = contents_of(*picture);
  // A changed file is reported at once, since the next steps may fail because of the change.
  if (!contents.changed.empty()) complain(fmt::format("{}: {}", flags.image, line_of(contents)));
  const auto image = read_sealed_image(std::move(*picture), flags.image);
  if (!image) return print_error(image.error());
  std::optional<DeepFile> deep;
  if (image->settings.deep > 0) {
    auto beside = open_deep(flags.image, *image);
    if (!beside && beside.error().code != Errc::not_found) return print_error(beside.error());
    if (beside) deep = std::move(*beside);
    if (!deep)
      print_note(
          fmt::format("{} is not there: the deep image is not verified", deep_file(flags.image).string()));
    if (deep && !deep->picture.changed)
      contents.sealed = false;
    else if (deep)
      for (const std::string& changed : *deep->picture.changed)
        contents.changed.push_back(fmt::format("{} of {}", changed, deep->path));
  }
  auto scene = read_local_scene(flags.scene, *defines, false, numbers->frame,
                                coordinator::wants_labels(image->settings));
  if (!scene) return print_rejected(scene.error());
  if (const auto ok = change_scene(flags.changes, scene->scene); !ok) return print_error(ok.error());
  // A job renders its scene pruned: without what its integrator and max_depth do not need.
  scene->scene =
      scene::pruned(scene->scene, scene::pruned_for(image->settings.integrator, image->settings.max_depth))
          .scene;
  if (const auto same = check_same(*image, *scene, flags); !same) return print_error(same.error());
  const int threads = flags.threads > 0 ? flags.threads : worker::usable_cpus();
  const auto limit = render::limit_threads(threads);
  const auto world = build_world_again(*scene, image->settings, threads);
  if (!world) return print_rejected(world.error());
  const auto tiles = random_tiles(image->grid().count(), numbers->tiles, numbers->seed);
  const auto verified =
      verify_all(**world, *image, deep ? &*deep : nullptr, tiles, threads, flags.json, stop);
  for (std::string& header :
       wrong_headers(*image, coordinator::layer_names_of(scene->scene, image->settings), verified))
    if (std::find(contents.changed.begin(), contents.changed.end(), header) == contents.changed.end())
      contents.changed.push_back(std::move(header));
  if (flags.json) print(to_json(verified, contents, numbers->seed).dump(2));
  const Tally tally = tally_of(verified);
  if (!flags.json) {
    print(line_of(contents));
    print(fmt::format(
        "{} of {} tiles match the seal{} ({} in the image; --seed {} chooses the same tiles again)",
        tally.right, verified.size(),
        tally.stopped > 0 ? fmt::format(", {} were not rendered because the run was stopped", tally.stopped)
                          : "",
        image->grid().count(), numbers->seed));
  }
  return tally.right == verified.size() && contents.as_sealed() ? kOk : kFailed;
}

}  // namespace

void add_verify(CLI::App& app, Action& action) {
  const auto [verify, flags] = add_command<VerifyFlags>(
      app, action, "verify",
      "render random tiles of a finished image again and compare them with the digests sealed in it", run);
  add_option(*verify, "image", flags->image, "OUT.exr", "a finished EXR")->required();
  add_option(*verify, "--scene", flags->scene, "SCENE", "the scene it was rendered from");
  add_option(*verify, "--tiles", flags->tiles, "K",
             fmt::format("number of tiles (default {})", kDefaultTiles));
  add_option(*verify, "--seed", flags->seed, "N",
             "seed for the choice of tiles; default: another one each time");
  add_defines(*verify, flags->defines);
  add_scene_changes(*verify, flags->changes);
  add_option(*verify, "--frame", flags->frame, "N", "for a sequence: only this frame");
  add_option(*verify, "--threads", flags->threads, "N", "default: all")->check(CLI::Range(1, 1024));
  verify->add_flag("--json", flags->json, "as JSON");
}

}  // namespace ls::cli
