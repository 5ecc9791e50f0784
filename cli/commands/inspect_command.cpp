// lightshaft inspect: lists the parts of the renderer that a scene uses, those that it does not use and why,
// and the cost in bytes and instructions. It is printed as JSON, or as text for users.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>

#include "cli/commands/commands.h"
#include "cli/local/instructions.h"
#include "cli/local/local_world.h"
#include "cli/output/console.h"
#include "cli/output/job_options.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"
#include "core/scene/analysis/prune.h"
#include "worker/machine.h"
#include "worker/render/base/work_counters.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

struct InspectFlags {
  std::string scene, frame;
  std::vector<std::string> defines;
  bool json = false, strict = false, variants = false, work = false;
};

// Longer side, in pixels, of the small image that --variants and --work render: large enough that paths hit
// all parts of a scene, and small enough to be fast.
constexpr int kSmallSide = 32;
constexpr SampleRange kSmallSamples{0, 4};

FrameSize small(FrameSize size) {
  const int longer = std::max(size.width, size.height);
  const auto scaled = [&](int x) { return longer <= kSmallSide ? x : std::max(1, x * kSmallSide / longer); };
  return {scaled(size.width), scaled(size.height)};
}

// Builds the world for a small image of the scene. If path_reuse is 0, the renderer decides by the image's
// size whether pixels share the tails of their paths. The small image uses the decision for the full size.
tl::expected<std::shared_ptr<const render::World>, coordinator::Rejected> small_world(
    LocalScene scene, const LocalWorld& whole) {
  int& path_reuse = scene.scene.integrator.path_reuse;
  const bool shared = render::techniques_of(*whole.world).has(Technique::path_reuse);
  if (path_reuse == 0) path_reuse = shared ? kUsualPathReuse : -1;
  RenderSettings settings = whole.job.settings;
  if (settings.meters == 0) settings.size = small(settings.size);  // meters have the size of their blocks
  scene.scene = scene::pruned(scene.scene, scene::pruned_for(settings.integrator, settings.max_depth)).scene;
  return build_world_again(scene, settings, worker::usable_cpus());
}

// Renders a small image with every variant of the integrator that has the scene's features. (A variant is
// compiled for a subset of the features that scenes can have.) Returns, for each variant, the digest of its
// pixel sums and its instructions per path.
tl::expected<VariantBitsList, coordinator::Rejected> render_variants(const LocalScene& scene,
                                                                     const LocalWorld& whole) {
  const auto world = small_world(scene, whole);
  if (!world) return tl::unexpected(world.error());
  const FrameSize size = small(whole.job.settings.size);
  const PixelRect all{0, 0, size.width, size.height};
  const double paths =
      static_cast<double>(all.pixels()) * static_cast<double>(kSmallSamples.s1 - kSmallSamples.s0);
  return measure_variants(render::covering_variants(**world), paths, InstructionCounter::open(),
                          [&](const std::string& name) {
                            const auto tile = render::render_tile_as(**world, name, all, kSmallSamples);
                            return sha256(std::as_bytes(std::span(tile.sums)));
                          });
}

// Renders a small image, and returns how often each kind of work was done, such as shadow rays or image
// lookups. invalid_argument: this build does not count work.
tl::expected<ordered_json, coordinator::Rejected> count_work([[maybe_unused]] const LocalScene& scene,
                                                             [[maybe_unused]] const LocalWorld& whole) {
#ifdef LIGHTSHAFT_COUNT
  const auto world = small_world(scene, whole);
  if (!world) return tl::unexpected(world.error());
  const FrameSize size = small(whole.job.settings.size);
  render::work_counters() = {};
  render::render_tile(**world, {0, 0, size.width, size.height}, kSmallSamples, nullptr, nullptr);
  ordered_json work;
  for (const auto& [name, counter] : render::kWorkCounters) work[name] = render::work_counters().*counter;
  return work;
#else
  return coordinator::rejected(
      {Errc::invalid_argument, "this build does not count work: configure one with -DLIGHTSHAFT_COUNT=ON"});
#endif
}

// Bytes per pixel of the coordinator's film: R, G and B sums of the two halves of the samples, in double.
constexpr std::uint64_t kFilmBytesPerPixel = 6 * sizeof(double);

ordered_json files_that_stay(const LocalScene& scene, const JobSpec& spec) {
  ordered_json stay = ordered_json::array();
  for (const auto& [name, file] : scene.files)
    if (!is_needed(scene, spec, file)) stay.push_back({{"name", name}, {"bytes", file.bytes}});
  return stay;
}

std::string times(std::uint64_t count, const std::string& what) {
  return count == 1 ? what : fmt::format("{} x {}", count, what);
}

using Rows = std::vector<std::vector<std::string>>;

// Returns the rows as a list with a title; an empty text if there are no rows.
std::string titled(const std::string& title, const Rows& rows) {
  return rows.empty() ? "" : "\n" + title + "\n" + aligned(rows, "  ") + "\n";
}

std::string text_at(const ordered_json& j, const char* key) {
  return plain_text(j.at(key).get<std::string>());
}
std::uint64_t sum_of_bytes(const ordered_json& list) {
  std::uint64_t sum = 0;
  for (const auto& x : list) sum += x.at("bytes").get<std::uint64_t>();
  return sum;
}

std::string head(const ordered_json& j) {
  const std::string spp = j.at("spp").is_null() ? "as many as needed" : j.at("spp").dump();
  return fmt::format(
      "{}\n{} x {} pixels, {} samples per pixel, integrator {}\nvariant of the renderer: {} (of {})\n",
      text_at(j, "scene"), j.at("size")[0].get<int>(), j.at("size")[1].get<int>(), spp,
      text_at(j, "integrator"), text_at(j, "variant"), j.at("variants").get<int>());
}

std::string parts(const ordered_json& j, bool used) {
  Rows rows;
  for (const auto& part : j.at("parts"))
    if (part.at("used") == used) {
      const std::uint64_t bytes = part.at("bytes");
      std::vector<std::string> row{text_at(part, "part"), text_at(part, "why")};
      if (used) row.insert(row.begin() + 1, bytes > 0 ? show_bytes(bytes) : "-");
      rows.push_back(std::move(row));
    }
  return titled(used ? "parts in use, and the bytes of files that they read" : "parts that are left out",
                rows);
}

// Lists the renderer's optional features that the scene uses and those that it does not use, such as grids, a
// light tree or equi-angular sampling. They are known only after the scene's files have been loaded.
std::string made_ready(const ordered_json& j) {
  const auto listed = [&](const char* key) {
    std::vector<std::string> all;
    for (const auto& x : j.at(key)) all.push_back(plain_text(x.get<std::string>()));
    return all.empty() ? std::string("nothing") : fmt::format("{}", fmt::join(all, "; "));
  };
  return fmt::format("\nthe loaded scene has: {}\nand does without: {}\n", listed("features_used"),
                     listed("features_left_out"));
}

std::string technique_table(const ordered_json& j) {
  Rows rows;
  for (const auto& t : j.at("techniques"))
    rows.push_back(
        {text_at(t, "name"),
         fmt::format("{}=\"{}\"", text_at(t.at("off"), "parameter"), text_at(t.at("off"), "value")),
         text_at(t, "what")});
  return titled("techniques in use, and the integrator's parameter that switches each off", rows);
}

std::string pruned(const ordered_json& j) {
  Rows rows;
  for (const auto& x : j.at("pruned")) {
    const std::uint64_t bytes = x.at("bytes");
    rows.push_back(
        {times(x.at("count"), text_at(x, "what")), bytes > 0 ? show_bytes(bytes) : "", text_at(x, "why")});
  }
  return titled("removed from the scene, because no pixel depends on it", rows);
}

std::string files(const ordered_json& j) {
  const auto& travel = j.at("assets");
  const auto& stay = j.at("files_left_out");
  const std::string scene = show_bytes(j.at("scene_bytes"));
  Rows going, staying;
  for (const auto& file : travel)
    going.push_back({text_at(file, "name"), show_bytes(file.at("bytes")), text_at(file, "uses")});
  for (const auto& file : stay) staying.push_back({text_at(file, "name"), show_bytes(file.at("bytes"))});
  return (travel.empty() ? fmt::format("\nsent to workers: {} of scene, no files\n", scene)
                         : titled(fmt::format("sent to workers: {} in {} files, and {} of scene",
                                              show_bytes(sum_of_bytes(travel)), travel.size(), scene),
                                  going)) +
         titled(fmt::format("not sent: {} in {} files that nothing uses", show_bytes(sum_of_bytes(stay)),
                            stay.size()),
                staying);
}

// Draws a bar whose length is proportional to `bytes`: 24 marks for `largest`, and at least one mark unless
// `bytes` is 0.
std::string bar(std::uint64_t bytes, std::uint64_t largest) {
  if (bytes == 0 || largest == 0) return "";
  const auto marks =
      static_cast<std::size_t>(24. * static_cast<double>(bytes) / static_cast<double>(largest) + .5);
  return std::string(std::max<std::size_t>(1, marks), '#');
}

std::string memory(const ordered_json& j) {
  const auto& all = j.at("structures");
  std::uint64_t largest = 0;
  for (const auto& s : all) largest = std::max(largest, s.at("bytes").get<std::uint64_t>());
  Rows rows;
  for (const auto& s : all) {
    const std::uint64_t bytes = s.at("bytes");
    rows.push_back(
        {text_at(s, "name"), bytes > 0 ? show_bytes(bytes) : "-", bar(bytes, largest), text_at(s, "detail")});
  }
  return titled(fmt::format("memory of a worker: {}", show_bytes(sum_of_bytes(all))), rows) +
         fmt::format("memory of the coordinator: {} of film\n", show_bytes(j.at("film_bytes")));
}

// Describes a variant's instructions per path, and by how many percent they exceed those of the cheapest
// variant. An argument is JSON null if the instructions could not be counted.
std::string instructions(const ordered_json& per_path, const ordered_json& cheapest) {
  if (per_path.is_null()) return "";
  const double n = per_path;
  const std::string more = cheapest.is_null() || cheapest == per_path
                               ? ""
                               : fmt::format(", {:+.1f} %", 100 * (n / cheapest.get<double>() - 1));
  return fmt::format("{:.0f} instructions a path{}", n, more);
}

std::string variants(const ordered_json& j) {
  const auto& rendered = j.find("variant_bits");
  if (rendered == j.end()) return "";
  Rows rows;
  const auto& first = rendered->front().at("instructions_per_path");
  for (const auto& v : *rendered)
    rows.push_back({text_at(v, "variant"), text_at(v, "sums_sha256"),
                    instructions(v.at("instructions_per_path"), first)});
  const std::string uncounted =
      j.contains("uncounted") ? fmt::format("instructions are not counted: {}\n", text_at(j, "uncounted"))
                              : "";
  return titled("all variants of the renderer that can render the scene, on a small image", rows) +
         (j.at("variants_agree") ? "the same bits\n" : "DIFFERENT BITS: this is a bug\n") + uncounted;
}

ordered_json inspection(const LocalScene& scene, const LocalWorld& built, const VariantBitsList& rendered) {
  const coordinator::StoredJob& job = built.job;
  const render::WorldReport world = render::describe(*built.world);
  const auto size = job.settings.size;
  const json analysis = json::parse(job.analysis);
  ordered_json j{{"scene", scene.name},
                 {"scene_sha256", job.scene.hex()},
                 {"size", {size.width, size.height}},
                 {"spp", job.spp ? ordered_json(*job.spp) : ordered_json()},
                 {"integrator", job.settings.integrator},
                 {"max_depth", job.settings.max_depth},
                 {"variant", world.variant},
                 {"variants", world.variants},
                 {"features_used", world.used},
                 {"features_left_out", world.left_out},
                 {"techniques", ordered_json::parse(techniques_json(render::techniques_of(*built.world),
                                                                    job.settings.integrator))},
                 {"needs", ordered_json::parse(job.needs)},
                 {"parts", analysis.at("parts")},
                 {"pruned", analysis.at("left_out")},
                 {"scene_bytes", built.scene_bytes},
                 {"assets", ordered_json::array()},
                 {"files_left_out", files_that_stay(scene, job.spec)},
                 {"structures", ordered_json::array()},
                 {"film_bytes", kFilmBytesPerPixel * static_cast<std::uint64_t>(size.width) *
                                    static_cast<std::uint64_t>(size.height)},
                 {"clamped_inputs", world.clamped_inputs},
                 {"warnings", job.warnings}};
  for (const scene::FileNeed& file : built.needs.files)
    j["assets"].push_back({{"name", file.name},
                           {"bytes", file.bytes},
                           {"sha256", file.digest.hex()},
                           {"uses", fmt::format("{}", fmt::join(file.uses, ", "))}});
  for (const auto& s : world.structures)
    j["structures"].push_back({{"name", s.name}, {"bytes", s.bytes}, {"detail", s.detail}});
  if (rendered.all.empty()) return j;
  j["variant_bits"] = ordered_json::array();
  bool same = true;
  for (const VariantBits& v : rendered.all) {
    j["variant_bits"].push_back(
        {{"variant", v.name},
         {"sums_sha256", v.sums.hex()},
         {"instructions_per_path", v.instructions ? ordered_json(*v.instructions) : ordered_json()}});
    same = same && v.sums == rendered.all.front().sums;
  }
  j["variants_agree"] = same;
  if (!rendered.uncounted.empty()) j["uncounted"] = rendered.uncounted;
  return j;
}

// Formats the result of inspection() as text. Every line ends with a newline.
std::string inspection_text(const ordered_json& j) {
  std::string out = head(j) + parts(j, true) + parts(j, false) + made_ready(j) + technique_table(j) +
                    pruned(j) + files(j) + memory(j) + variants(j);
  if (const auto work = j.find("work"); work != j.end()) {
    Rows rows;
    for (const auto& [name, count] : work->items()) rows.push_back({name, count.dump()});
    out += titled("work of a small image", rows);
  }
  if (const std::uint64_t clamped = j.at("clamped_inputs"); clamped > 0)
    out += fmt::format("\n{} inputs were clamped (negative densities and texels, degenerate triangles)\n",
                       clamped);
  return out;
}

int run(const InspectFlags& flags) {
  JobSpec spec;
  auto defines = parse_defines(flags.defines);
  if (!defines) return print_error(defines.error());
  spec.defines = std::move(*defines);
  std::optional<std::uint32_t> frame;
  if (const auto ok = take(flags.frame, frame, parse_frame); !ok) return print_error(ok.error());
  const auto scene = read_local_scene(flags.scene, spec.defines, flags.strict, frame);
  if (!scene) return print_rejected(scene.error());
  const auto built = build_local_world(*scene, spec, worker::usable_cpus());
  if (!built) return print_rejected(built.error());
  for (const std::string& warning : built->job.warnings)
    fmt::print(stderr, "{}{}", warning, warning.ends_with('\n') ? "" : "\n");
  VariantBitsList variants;
  if (flags.variants) {
    auto rendered = render_variants(*scene, *built);
    if (!rendered) return print_rejected(rendered.error());
    variants = std::move(*rendered);
  }
  auto report = inspection(*scene, *built, variants);
  if (flags.work) {
    const auto work = count_work(*scene, *built);
    if (!work) return print_rejected(work.error());
    report["work"] = *work;
  }
  const auto text = flags.json ? dump(report) + "\n" : inspection_text(report);
  fmt::print("{}", text);
  return report.value("variants_agree", true) ? kOk : kFailed;
}

}  // namespace

void add_inspect(CLI::App& app, Action& action) {
  const auto [inspect, flags] = add_command<InspectFlags>(
      app, action, "inspect", "read and check a scene without rendering, and print what it needs", run);
  add_option(*inspect, "scene", flags->scene, "SCENE", "Mitsuba XML, .pbrt, .gltf or .glb")->required();
  add_defines(*inspect, flags->defines);
  add_option(*inspect, "--frame", flags->frame, "N", "for a sequence: only this frame");
  inspect->add_flag("--strict", flags->strict, "treat warnings as errors");
  inspect->add_flag("--variants", flags->variants,
                    "render a small image with every variant of the renderer that can render the scene, "
                    "compare their bits, and count their instructions if this machine can");
  inspect->add_flag("--work", flags->work,
                    "count the work for a small image (only in builds with LIGHTSHAFT_COUNT)");
  inspect->add_flag("--json", flags->json, "as JSON");
}

}  // namespace ls::cli
