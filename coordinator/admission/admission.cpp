#include "coordinator/admission/admission.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <ranges>
#include <set>

#include "coordinator/admission/decoded_reference.h"
#include "coordinator/admission/layer_names.h"
#include "coordinator/base/limits.h"
#include "coordinator/store/jobs/job_store.h"
#include "core/base/file_form.h"
#include "core/base/text/name_forms.h"
#include "core/image/film/partial_size.h"
#include "core/job/health_notes.h"
#include "core/job/spec_draft.h"
#include "core/scene/analysis/camera_view.h"
#include "core/scene/analysis/light_groups.h"
#include "core/scene/analysis/needs.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/json/serialize.h"
#include "core/scene/limits.h"
#include "core/scene/schema/integrators.h"
#include "core/scene/schema/nori_integrators.h"
#include "core/scene/schema/validate.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {

// The stored analysis of a job (StoredJob::analysis) lists at most this many parts of the scene that are not
// rendered, so that it stays small
constexpr std::size_t kMostListed = 64;

// Returns the total size, in bytes, of the files that this part of the renderer reads; 0 for a part that
// reads no files. `part` is a name such as "meshes".
std::uint64_t bytes_of_files(const scene::Needs& needs, const std::string& part) {
  static const std::map<std::string, std::string> kReads = {{"meshes", "mesh"},
                                                            {"bitmap textures", "texture"},
                                                            {"environment map", "environment map"},
                                                            {"volume grids", "grid"}};
  const auto reads = kReads.find(part);
  if (reads == kReads.end()) return 0;
  std::uint64_t sum = 0;
  for (const scene::FileNeed& f : needs.files) {
    const auto used_so = [&](const std::string& use) { return use.starts_with(reads->second); };
    if (std::any_of(f.uses.begin(), f.uses.end(), used_so)) sum += f.bytes;
  }
  return sum;
}

// Describes for workers and users which features of the renderer the scene needs, and which parts of the
// scene are not rendered: sets needs, features_used, features_left_out and analysis of `job`. `pruned` is the
// part of the scene that the job's integrator uses, with a list of the rest.
void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job) {
  using nlohmann::json;
  const scene::Needs needs = scene::needs_of(pruned.scene, scene::sees_media(settings.integrator));
  job.needs = canonical_json(needs);
  const bool is_reported = std::ranges::any_of(
      job.warnings, [](const std::string& w) { return w.find(scene::kNoLight) != std::string::npos; });
  if (needs.lights.empty() && needs.area_lights == 0 && !needs.emission && !is_reported)
    job.warnings.push_back(fmt::format("{}: warning: {}", job.name, scene::kNoLight));
  json parts = json::array(), left_out = json::array();
  for (const scene::Need& part : in_words(needs)) {
    (part.used ? job.features_used : job.features_left_out).push_back(part.part);
    parts.push_back({{"part", part.part},
                     {"used", part.used},
                     {"why", part.why},
                     {"bytes", bytes_of_files(needs, part.part)}});
  }
  for (const scene::LeftOut& x : pruned.left_out) {
    if (left_out.size() == kMostListed) break;
    left_out.push_back({{"what", x.what}, {"why", x.why}, {"count", x.count}, {"bytes", x.bytes}});
  }
  job.analysis = json{{"parts", std::move(parts)}, {"left_out", std::move(left_out)}}.dump(
      -1, ' ', false, json::error_handler_t::replace);
}

// Gives the job this scene: its text and digest, the files that it uses, and what it needs.
void set_scene(const scene::Pruned& pruned, Admission& admission) {
  StoredJob& job = admission.job;
  job.assets.clear();
  for (const Asset& a : pruned.scene.assets)
    if (std::ranges::find(job.assets, a.digest, &BlobRef::digest) == job.assets.end())
      job.assets.push_back({a.digest, a.bytes, a.name});
  job.features_used.clear();
  job.features_left_out.clear();
  note_analysis(pruned, job.settings, job);
  admission.scene_json = serialize(pruned.scene);
  job.scene = sha256(admission.scene_json);
}

tl::unexpected<Error> invalid(std::string text) { return fail(Errc::invalid_argument, std::move(text)); }

// Sets the integrator. The job's choice takes precedence over the scene's.
Result<void> choose_integrator(const Scene& scene, const JobSpec& spec, RenderSettings& settings,
                               std::vector<std::string>& warnings) {
  const std::string asked = spec.integrator.value_or(scene.integrator.name);
  const scene::IntegratorRow* known = scene::integrator_row(asked);
  const scene::nori::IntegratorRow* nori = known ? nullptr : scene::nori::integrator_row(asked);
  const auto names = std::views::transform(scene::integrators(), &scene::IntegratorRow::name);
  if (!known && !nori)
    return invalid(fmt::format("there is no integrator \"{}\"; there are {}", asked, fmt::join(names, ", ")));
  const std::string_view ours = known ? known->ours : nori->ours;
  if (!scene::sees_media(ours) && !scene.media.empty())
    warnings.push_back(
        fmt::format("the integrator `{}` renders without media: the scene's {} media are left out", ours,
                    scene.media.size()));
  settings.integrator = ours;
  settings.max_depth = (known ? known->max_depth : nori->max_depth).value_or(scene.integrator.max_depth);
  settings.rr_depth = scene.integrator.rr_depth;
  return {};
}

// Makes tiles smaller until the result of a unit fits into one message of a worker. Pixels do not depend on
// the tiles. Tiles keep multiples of 16 pixels, which is the side of the blocks that share paths.
void shrink_tiles(RenderSettings& settings) {
  constexpr int kSmallest = 16;
  const AovSet aovs = aovs_of(settings);
  const auto too_large = [&](int tile) {
    return most_partial_file_bytes(static_cast<std::uint64_t>(tile) * static_cast<std::uint64_t>(tile),
                                   aovs) > ls::limits::kPartialBytes;
  };
  while (settings.tile > kSmallest && too_large(settings.tile)) settings.tile /= 2;
}

tl::unexpected<Error> no_caught_shadows_in_deep() {
  return invalid(
      "the image has the shadows on shadow catchers, which are at no depth and have no place in a deep "
      "image: leave deep out, or shadow_catcher");
}

// Sets the AOVs: those of these names, and those that the denoiser needs. `light_groups` are the groups of
// the scene's lights.
Result<void> set_aovs(std::vector<std::string> names, bool denoise,
                      const std::vector<std::string>& light_groups, RenderSettings& settings) {
  if (denoise) std::ranges::move(names_of(aovs_of(AovKind::guide)), std::back_inserter(names));
  auto aovs = parse_aovs(names);
  if (!aovs) return tl::unexpected(aovs.error());
  // The light of a group's surfaces is the difference between the two layers.
  if (aovs->has(Aov::volume_light_groups)) *aovs = aovs->with(Aov::light_groups);
  settings.aov = names_of(*aovs);
  settings.light_groups.clear();
  if (!aovs->has(Aov::light_groups)) {
    if (settings.deep > 0) shrink_tiles(settings);
    return {};
  }
  if (light_groups.size() > kMostLightGroups)
    return invalid(fmt::format("the scene has {} light groups; layers can have at most {}",
                               light_groups.size(), kMostLightGroups));
  settings.light_groups = light_groups;
  shrink_tiles(settings);
  return {};
}

// Sets the AOVs: those that the job requests, those that the scene requests, and alpha for a transparent
// film, and the shadows on shadow catchers.
Result<void> choose_aovs(const Scene& scene, const JobSpec& spec, RenderSettings& settings) {
  std::vector<std::string> names = spec.aov;
  if (scene.film.transparent) names.emplace_back(row_of(Aov::alpha).name);
  if (std::ranges::any_of(scene.shapes, [&](const Shape& s) { return catches_shadows(scene, s); })) {
    if (settings.deep > 0) return no_caught_shadows_in_deep();
    names.emplace_back(row_of(Aov::shadow_catcher).name);
  }
  for (std::string_view rest = scene.aovs; !rest.empty();) {
    const auto end = std::min(rest.find(','), rest.size());
    names.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return set_aovs(std::move(names), spec.denoise, scene::light_groups_of(scene), settings);
}

Result<RenderSettings> settings_of(const Scene& scene, const JobSpec& spec, std::uint32_t frame,
                                   std::vector<std::string>& warnings) {
  RenderSettings settings;
  settings.size = spec.size.value_or(scene.film.image_size());
  if (!job::fits({}, settings.size))
    return invalid("the image's size " +
                   job::must_be(job::allowed<FrameSize>({}, job::Form::query), job::text_of(settings.size)));
  settings.meters = static_cast<int>(scene::meter_count(scene));
  if (settings.meters > 0 && spec.size)
    return invalid("the scene has meters and no camera, so there is no image of a size: leave the size out");
  if (settings.meters > 0 && (!spec.aov.empty() || spec.denoise))
    return invalid("the scene has meters and no camera, so there is no image with AOVs or denoised layers");
  if (settings.meters > 0 && spec.deep > 0)
    return invalid("the scene has meters and no camera, so there is no deep image: leave deep out");
  settings.deep = static_cast<int>(spec.deep.value_or(0));
  settings.deep_alpha = spec.deep_alpha;
  settings.seed = spec.seed.value_or(0) + frame;
  if (auto ok = choose_integrator(scene, spec, settings, warnings); !ok) return tl::unexpected(ok.error());
  if (auto ok = choose_aovs(scene, spec, settings); !ok) return tl::unexpected(ok.error());
  return settings;
}

// Returns the name without leading "./": "./a/b.obj" and "a/b.obj" are the same file.
std::string plain_name(std::string_view name) {
  while (name.starts_with("./")) name.remove_prefix(2);
  return std::string(name);
}

class UploadedAssets final : public AssetSource {
 public:
  UploadedAssets(const std::map<std::string, Digest>& assets, const BlobStore& blobs, bool strict)
      : blobs_(blobs), strict_(strict) {
    for (const auto& [name, digest] : assets) {
      assets_.emplace(plain_name(name), digest);
      by_plain_text_.emplace(composed(with_slashes(plain_name(name))), digest);
    }
  }

  Result<Asset> find(std::string_view name) override { return find(name, false); }

  Result<std::string> text(std::string_view name) override {
    const auto asset = find(name, true);
    if (!asset) return tl::unexpected(asset.error());
    if (asset->bytes > scene::kMaxTextBytes)
      return invalid(fmt::format("\"{}\" has {} bytes; an included scene may have {}", name, asset->bytes,
                                 scene::kMaxTextBytes));
    const auto bytes = blobs_.read(asset->digest, 0, asset->bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    auto text = plain_bytes(name, std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()),
                            scene::kMaxTextBytes);
    if (text) text_bytes += text->size();
    return text;
  }

  std::size_t text_bytes = 0;     // bytes of the scene files that the main file includes
  std::set<Digest> not_uploaded;  // digests of files that the scene names but that are not in the store

 private:
  Result<Asset> find(std::string_view name, bool of_text) {
    const Digest* found = digest_of(plain_name(name));
    if (!found)
      return fail(Errc::not_found,
                  fmt::format("\"{}\" was not sent along: name it among the assets, with its SHA-256{}", name,
                              offered()));
    const auto bytes = blobs_.size(*found);
    if (!bytes && (strict_ || of_text))
      return fail(Errc::not_found,
                  fmt::format("the bytes of \"{}\" have not been uploaded: PUT them to /api/v1/blobs/{}",
                              name, found->hex()));
    if (!bytes) not_uploaded.insert(*found);
    return Asset{std::string(name), *found, bytes.value_or(0)};
  }

  // Returns the digest of the file of this name or, if there is none, of the only one whose name is the same
  // but for backslashes between folders and for how its letters are composed (name_forms.h).
  const Digest* digest_of(const std::string& name) const {
    if (const auto found = assets_.find(name); found != assets_.end()) return &found->second;
    const auto [first, last] = by_plain_text_.equal_range(composed(with_slashes(name)));
    return first != last && std::next(first) == last ? &first->second : nullptr;
  }

  std::string offered() const {
    if (assets_.empty()) return "; no assets were named";
    std::string names = "; named were";
    std::size_t shown = 0;
    for (const auto& [name, digest] : assets_) {
      if (++shown > 5) return names + fmt::format(" and {} more", assets_.size() - 5);
      names += fmt::format(" \"{}\"", name);
    }
    return names;
  }

  std::map<std::string, Digest> assets_;
  std::multimap<std::string, Digest> by_plain_text_;
  const BlobStore& blobs_;
  const bool strict_;
};

struct UploadedScene {
  Scene scene;
  std::vector<Diagnostic> warnings;
  std::size_t text_bytes = 0;     // bytes of the scene files that the main file includes
  std::set<Digest> not_uploaded;  // digests of files that the scene names but that are not in the store
};

// Reads the request's scene. `strict`: a file that is not in the store is an error, with its place in the
// scene. Otherwise it is listed in not_uploaded, and the caller decides whether it is needed. A scene file
// that the scene includes must be in the store in any case.
tl::expected<UploadedScene, Rejected> read_uploaded(const SubmitRequest& request, const BlobStore& blobs,
                                                    const SceneReader& read_scene,
                                                    std::optional<std::uint32_t> frame, bool strict) {
  UploadedAssets assets(request.assets, blobs, strict);
  auto read =
      read_scene(request.scene_name, request.scene_text, assets, {request.spec.defines, false, frame, true});
  if (!read) return rejected(read.error());
  if (!read->scene)
    return rejected({Errc::invalid_argument, fmt::format("the scene {} cannot be read", request.scene_name)},
                    std::move(read->diagnostics));
  return UploadedScene{std::move(*read->scene), std::move(read->diagnostics), assets.text_bytes,
                       std::move(assets.not_uploaded)};
}

// Returns the part of the scene that the job's integrator uses, or an error if a file of this part is not in
// the store.
tl::expected<scene::Pruned, Rejected> needed_part(const SubmitRequest& request, const BlobStore& blobs,
                                                  const SceneReader& read_scene,
                                                  std::optional<std::uint32_t> frame,
                                                  const UploadedScene& read, const RenderSettings& settings) {
  const scene::PrunedFor whom = scene::pruned_for(settings.integrator, settings.max_depth);
  scene::Pruned pruned = scene::pruned(read.scene, whom);
  const auto missing = [&](const Asset& a) { return read.not_uploaded.contains(a.digest); };
  if (std::ranges::none_of(pruned.scene.assets, missing)) return pruned;
  // Read again with `strict`, the scene gives an error at each place that names a missing file. If there is
  // no error now, the missing files have arrived meanwhile.
  const auto again = read_uploaded(request, blobs, read_scene, frame, true);
  if (!again) return tl::unexpected(again.error());
  return pruned;
}

Result<void> check_job(const StoredJob& job) {
  if (auto ok = check_film_size(job.settings); !ok) return ok;
  JobPlan plan = plan_of(job);
  plan.brief.job.value = "new";
  return check_plan(plan);
}

}  // namespace

tl::expected<Admission, Rejected> admit(const SubmitRequest& request, const BlobStore& blobs,
                                        const SceneReader& read_scene, std::optional<std::uint32_t> frame) {
  if (request.scene_text.size() > scene::kMaxTextBytes)
    return rejected({Errc::invalid_argument, fmt::format("the scene text has {} bytes; {} are allowed",
                                                         request.scene_text.size(), scene::kMaxTextBytes)});
  if (request.assets.size() > limits::kMaxAssets)
    return rejected({Errc::invalid_argument, fmt::format("{} assets were named; {} are allowed",
                                                         request.assets.size(), limits::kMaxAssets)});
  if (auto ok = job::check_spec(request.spec); !ok) return rejected(ok.error());
  auto read = read_uploaded(request, blobs, read_scene, frame, false);
  if (!read) return tl::unexpected(std::move(read.error()));

  Admission admission;
  StoredJob& job = admission.job;
  job.name = request.scene_name.substr(0, limits::kMaxShownName);
  job.owner = request.owner;
  job.warnings = request.warnings;
  for (const auto& d : read->warnings)
    if (job.warnings.size() < limits::kMaxWarnings) job.warnings.push_back(format_diagnostic(d));
  auto settings = settings_of(read->scene, request.spec, frame.value_or(0), job.warnings);
  if (!settings) return rejected(settings.error());
  job.settings = std::move(*settings);
  if (request.spec.techniques)
    read->scene.integrator = with_choice(read->scene.integrator, *request.spec.techniques);
  if (request.spec.mix)
    if (auto ok = scene::multiply_light(*request.spec.mix, read->scene); !ok) return rejected(ok.error());
  ReferenceOrigin origin;
  if (request.spec.reference) {
    auto right = load_reference(request.spec, job.settings.size, blobs);
    if (!right) return rejected(right.error());
    origin = std::move(right->origin);
  }
  if (!wants_labels(job.settings)) {  // labels, the names of objects, are only for cryptomattes
    read->scene.shape_labels.clear();
    read->scene.instance_labels.clear();
  }
  job.spec = request.spec;
  job.spp = request.spec.spp;
  if (!job.spp && !request.spec.target_error && !request.spec.time) job.spp = read->scene.sample_count;
  if (job.spp && *job.spp > limits::kMaxSpp)
    return rejected({Errc::invalid_argument,
                     fmt::format("{} samples per pixel: at most {} are allowed", *job.spp, limits::kMaxSpp)});
  const auto pruned = needed_part(request, blobs, read_scene, frame, *read, job.settings);
  if (!pruned) return tl::unexpected(pruned.error());
  const Scene& scene = pruned->scene;
  set_scene(*pruned, admission);
  if (job.assets.size() > ls::limits::kAssetsPerJob)
    return rejected(
        {Errc::invalid_argument,
         fmt::format("the scene uses {} files; a message to a worker holds {}: merge some of its meshes",
                     job.assets.size(), ls::limits::kAssetsPerJob)});
  job.meters = meter_groups(scene);
  if (job.settings.meters == 0)
    job.camera = scene::camera_matrices(scene.sensor, scene.film, job.settings.size);
  admission.text_bytes = request.scene_text.size() + read->text_bytes;
  job.reference_same_seed = same_noise(origin, job.scene, job.settings.seed);
  if (auto ok = check_job(job); !ok) return rejected(ok.error());
  return admission;
}

namespace {

// Gives the job another scene: its own with the light of its groups multiplied.
Result<void> mix_again(const LightMix& mix, const BlobStore& blobs, Admission& admission) {
  StoredJob& job = admission.job;
  const auto size = blobs.size(job.scene);
  const auto json = size ? blobs.read(job.scene, 0, *size) : tl::unexpected(size.error());
  if (!json) return tl::unexpected(json.error());
  auto scene = deserialize_scene({reinterpret_cast<const char*>(json->data()), json->size()});
  if (!scene) return tl::unexpected(scene.error());
  if (auto ok = scene::multiply_light(mix, *scene); !ok) return ok;
  set_scene(scene::pruned(*scene, scene::pruned_for(job.settings.integrator, job.settings.max_depth)),
            admission);
  job.spec.mix = job.spec.mix ? product(*job.spec.mix, mix) : mix;
  return {};
}

}  // namespace

Result<Admission> admit_again(const StoredJob& before, const JobSpec& changes, const BlobStore& blobs,
                              std::optional<std::uint32_t> frame) {
  Admission admission;
  StoredJob& job = admission.job;
  job = {.name = before.name,
         .scene_name = before.scene_name,
         .scene = before.scene,
         .settings = before.settings,
         .spec = before.spec,
         .spp = before.spp,
         .assets = before.assets,
         .meters = before.meters,
         .warnings = before.warnings,
         .features_used = before.features_used,
         .features_left_out = before.features_left_out,
         .needs = before.needs,
         .camera = before.camera,
         .analysis = before.analysis};
  if (!frame) job.spec.frames = {};  // a single image, even if the old job was a frame of a sequence
  if (changes.spp || changes.target_error || changes.time) {
    job.spp = job.spec.spp = changes.spp;
    job.spec.target_error = changes.target_error;
    if (!changes.target_error) job.spec.target_layer = TargetLayer::raw;
    job.spec.time = changes.time;
  }
  if (changes.memory) job.spec.memory = changes.memory;
  job.spec.priority = changes.priority;
  job.spec.after = changes.after;
  if (changes.seed) job.settings.seed = *(job.spec.seed = changes.seed) + frame.value_or(0);
  if (changes.deep) {
    if (job.settings.meters > 0 && changes.deep > 0)
      return invalid("the job measures, so there is no deep image: leave deep out");
    // The scene is not read again, but shadows that it catches are layers of the earlier job.
    if (changes.deep > 0 && before.settings.deep == 0 && aovs_of(before.settings).has(Aov::shadow_catcher))
      return no_caught_shadows_in_deep();
    job.spec.deep = changes.deep;
    job.settings.deep = static_cast<int>(*changes.deep);
    if (changes.deep == 0) job.settings.deep_alpha = job.spec.deep_alpha = false;
  }
  if (changes.denoise) job.spec.denoise = true;
  if (job.spec.denoise != before.spec.denoise || changes.deep) {
    const std::vector<std::string> groups = job.settings.light_groups;
    if (auto ok = set_aovs(job.settings.aov, job.spec.denoise, groups, job.settings); !ok)
      return tl::unexpected(ok.error());
  }
  for (const BlobRef& asset : job.assets)
    if (!blobs.has(asset.digest))
      return fail(Errc::failed_precondition,
                  fmt::format("the file {} of the scene is not here any more: PUT /api/v1/blobs/{} first",
                              asset.name, asset.digest.hex()));
  if (!blobs.has(job.scene))
    return fail(Errc::failed_precondition, "the scene of this job is not here any more: submit it again");
  if (changes.mix)
    if (auto ok = mix_again(*changes.mix, blobs, admission); !ok) return tl::unexpected(ok.error());
  if (job.spec.reference) {
    const auto reference = load_reference(job.spec, job.settings.size, blobs);
    if (!reference) return tl::unexpected(reference.error());
    job.reference_same_seed = same_noise(reference->origin, job.scene, job.settings.seed);
  }
  if (auto ok = check_job(job); !ok) return tl::unexpected(ok.error());
  return admission;
}

Result<Reference> load_reference(const JobSpec& spec, FrameSize size, const BlobStore& blobs) {
  const Digest& digest = *spec.reference;
  if (!blobs.has(digest))
    return fail(
        Errc::failed_precondition,
        fmt::format("the reference's blob {0} is not here: PUT /api/v1/blobs/{0} first", digest.hex()));
  ExrLimits limits;
  // A reference must have the size of the image. This limit is checked before the file is decoded, since a
  // huge image would exhaust the memory. It is at least 2^22 pixels: a smaller picture of a wrong size is
  // decoded, so that the error can name its size.
  limits.max_pixels =
      std::max(std::uint64_t{1} << 22, static_cast<std::uint64_t>(std::int64_t{size.width} * size.height));
  const auto bytes = blobs.size(digest);
  if (!bytes) return tl::unexpected(bytes.error());
  if (*bytes > limits.max_bytes)
    return invalid(fmt::format("the reference has {} bytes; at most {} are read", *bytes, limits.max_bytes));
  const auto exr = blobs.read_whole(digest, *bytes);
  if (!exr) return tl::unexpected(exr.error());
  return decode_reference(*exr, size, limits);
}

std::string replay_of(const StoredJob& job) {
  const auto frame = frame_of(job.id);
  return replay_command(scene_file_of(job), job.spec, frame ? std::optional(frame->frame) : std::nullopt);
}

// Returns the total size of the job's files, or the memory that the user requests if that is more. A loaded
// scene takes at least as much memory as its files.
std::uint64_t memory_need(const StoredJob& job) {
  std::uint64_t files = 0;
  for (const BlobRef& file : job.assets) files += file.bytes;
  return std::max(files, job.spec.memory.value_or(0));
}

JobPlan plan_of(const StoredJob& job) {
  const auto frame = frame_of(job.id);
  return {.brief = {job.id, job.scene, job.settings, digest_of(job.settings), job.assets, job.needs},
          .grid = grid_of(job.settings),
          .spp = job.spp,
          .target_error = job.spec.target_error,
          .target_denoised = job.spec.target_layer == TargetLayer::denoised,
          .time = job.spec.time,
          .priority = job.spec.priority,
          .tags = job.spec.tags,
          .replay = replay_of(job),
          .owner = job.owner,
          .group = frame ? frame->sequence.value : "",
          .max_workers = job.spec.max_workers.value_or(0),
          .max_units = job.spec.max_units.value_or(0),
          .memory_bytes = memory_need(job),
          .class_asked = job.spec.numeric_class.value_or(""),
          .focus = job.focus,
          .held = !job.spec.after.empty()};
}

}  // namespace ls::coordinator
