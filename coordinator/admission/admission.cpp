#include "coordinator/admission/admission.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/job/health_notes.h"
#include "common/job/limits.h"
#include "common/protocol/limits.h"
#include "common/scene/analysis/needs.h"
#include "common/scene/analysis/prune.h"
#include "common/scene/json/serialize.h"
#include "common/scene/limits.h"
#include "common/scene/schema/integrators.h"
#include "common/scene/schema/nori_words.h"
#include "coordinator/admission/cryptomatte_manifests.h"
#include "coordinator/admission/scene_admission.h"
#include "coordinator/base/limits.h"
#include "coordinator/store/jobs/job_store.h"

namespace ls::coordinator {
namespace {

// At most this many items of the scene that are left out of the rendering are listed, so that a job's record
// stays small
constexpr std::size_t kMostListed = 64;

// Returns the total bytes of the files that only this part of the renderer reads.
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

// Sets needs, features and analysis of `job`: the renderer's features that the scene needs, and the parts of
// the scene that are left out of the rendering, for workers and as text for users. `pruned` is the part of
// the scene that the job's integrator uses.
void note_analysis(const scene::Pruned& pruned, const RenderSettings& settings, StoredJob& job) {
  using nlohmann::json;
  const scene::Needs needs = scene::needs_of(pruned.scene, scene::sees_media(settings.integrator));
  job.needs = canonical_json(needs);
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

Error invalid(std::string text) { return {Errc::invalid_argument, std::move(text)}; }

// Sets the integrator. The job's choice takes precedence over the scene's.
Result<void> choose_integrator(const Scene& scene, const JobSpec& spec, RenderSettings& settings,
                               std::vector<std::string>& warnings) {
  const std::string asked = spec.integrator.value_or(scene.integrator.name);
  const scene::IntegratorRow* known = scene::integrator_row(asked);
  const scene::nori::IntegratorRow* nori = known ? nullptr : scene::nori::integrator_row(asked);
  if (!known && !nori) {
    std::vector<std::string_view> names;
    for (const auto& row : scene::integrators()) names.push_back(row.name);
    return tl::unexpected(
        invalid(fmt::format("there is no integrator \"{}\"; there are {}", asked, fmt::join(names, ", "))));
  }
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

Result<void> check_size(FrameSize size) {
  if (size.width <= 0 || size.height <= 0)
    return tl::unexpected(invalid(fmt::format("an image of {} x {} has no pixels", size.width, size.height)));
  if (size.width > limits::kMaxFrameSide || size.height > limits::kMaxFrameSide ||
      std::int64_t{size.width} * size.height > limits::kMaxFramePixels)
    return fail(Errc::invalid_argument,
                fmt::format("an image of {} x {} is larger than {} a side or {} pixels", size.width,
                            size.height, limits::kMaxFrameSide, limits::kMaxFramePixels));
  return {};
}

Result<void> check_spec(const JobSpec& spec) {
  if (spec.target_error && !(std::isfinite(*spec.target_error) && *spec.target_error > 0))
    return tl::unexpected(invalid("target_error must be positive"));
  if (spec.target_layer == TargetLayer::denoised && !spec.target_error)
    return tl::unexpected(
        invalid("target_layer says which error target_error means, and there is no target_error: give one"));
  if (spec.time && !(std::isfinite(*spec.time) && *spec.time > 0 && *spec.time <= kMaxSeconds))
    return tl::unexpected(invalid(fmt::format("time must be between 0 and {} seconds", kMaxSeconds)));
  if (spec.spp && (*spec.spp == 0 || *spec.spp > limits::kMaxSpp))
    return fail(Errc::invalid_argument,
                fmt::format("{} samples per pixel: it must be 1 to {}", *spec.spp, limits::kMaxSpp));
  if (std::abs(spec.priority) > kMaxPriority)
    return tl::unexpected(invalid(fmt::format("priority must be within +-{}", kMaxPriority)));
  if (const auto aovs = parse_aovs(spec.aov); !aovs) return tl::unexpected(aovs.error());
  return {};
}

// Sets the AOVs: those that the job requests and those that the scene requests.
Result<void> choose_aovs(const Scene& scene, const JobSpec& spec, RenderSettings& settings) {
  std::vector<std::string> names = spec.aov;
  if (spec.denoise)
    for (std::string& name : names_of(aovs_of(AovKind::guide))) names.push_back(std::move(name));
  for (std::string_view rest = scene.aovs; !rest.empty();) {
    const auto end = std::min(rest.find(','), rest.size());
    names.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  const auto aovs = parse_aovs(names);
  if (!aovs) return tl::unexpected(aovs.error());
  settings.aov = names_of(*aovs);
  return {};
}

Result<RenderSettings> settings_of(const Scene& scene, const JobSpec& spec, std::uint32_t frame,
                                   std::vector<std::string>& warnings) {
  RenderSettings settings;
  settings.size = spec.size.value_or(scene.film.image_size());
  if (auto ok = check_size(settings.size); !ok) return tl::unexpected(ok.error());
  settings.seed = spec.seed.value_or(0) + frame;
  if (auto ok = choose_integrator(scene, spec, settings, warnings); !ok) return tl::unexpected(ok.error());
  if (auto ok = choose_aovs(scene, spec, settings); !ok) return tl::unexpected(ok.error());
  return settings;
}

// Returns the part of the scene that the job's integrator uses, or an error if a file of this part is not in
// the store.
tl::expected<scene::Pruned, Rejected> needed_part(const SubmitRequest& request, const BlobStore& blobs,
                                                  std::optional<std::uint32_t> frame,
                                                  const UploadedScene& read, const RenderSettings& settings) {
  const scene::PrunedFor whom = scene::pruned_for(settings.integrator, settings.max_depth);
  scene::Pruned pruned = scene::pruned(read.scene, whom);
  const auto missing = [&](const Asset& a) { return read.not_uploaded.contains(a.digest); };
  if (std::none_of(pruned.scene.assets.begin(), pruned.scene.assets.end(), missing)) return pruned;
  // Reading a second time, strictly, gives errors with the places in the scene that name the missing file
  const auto again = read_uploaded(request, blobs, frame, true);
  if (!again) return tl::unexpected(again.error());
  return scene::pruned(again->scene, whom);  // the file has arrived since the first reading
}

}  // namespace

tl::expected<Admission, Rejected> admit(const SubmitRequest& request, const BlobStore& blobs,
                                        std::optional<std::uint32_t> frame) {
  const auto refuse = [](Error error, std::vector<Diagnostic> found = {}) {
    return tl::unexpected(Rejected{std::move(error), std::move(found)});
  };
  if (request.scene_text.size() > scene::kMaxTextBytes)
    return refuse({Errc::invalid_argument, fmt::format("the scene text has {} bytes; {} are allowed",
                                                       request.scene_text.size(), scene::kMaxTextBytes)});
  if (request.assets.size() > limits::kMaxAssets)
    return refuse({Errc::invalid_argument, fmt::format("{} assets were named; {} are allowed",
                                                       request.assets.size(), limits::kMaxAssets)});
  if (auto ok = check_spec(request.spec); !ok) return refuse(ok.error());

  auto read = read_uploaded(request, blobs, frame, false);
  if (!read) return tl::unexpected(std::move(read.error()));

  Admission admission;
  StoredJob& job = admission.job;
  job.name = request.scene_name.substr(0, limits::kMaxShownName);
  job.owner = request.owner;
  for (const auto& d : read->warnings)
    if (job.warnings.size() < limits::kMaxWarnings) job.warnings.push_back(format_diagnostic(d));
  auto settings = settings_of(read->scene, request.spec, frame.value_or(0), job.warnings);
  if (!settings) return refuse(settings.error());
  job.settings = std::move(*settings);
  ReferenceOrigin origin;
  if (request.spec.reference) {
    auto right = load_reference(request.spec, job.settings.size, blobs);
    if (!right) return refuse(right.error());
    origin = std::move(right->origin);
  }
  if (!wants_labels(job.settings)) {  // unless there are cryptomattes, names are not part of the scene
    read->scene.shape_labels.clear();
    read->scene.instance_labels.clear();
  }
  job.spec = request.spec;
  job.spp = request.spec.spp;
  if (!job.spp && !request.spec.target_error && !request.spec.time) job.spp = read->scene.sample_count;
  if (job.spp && *job.spp > limits::kMaxSpp)
    return refuse({Errc::invalid_argument,
                   fmt::format("{} samples per pixel: at most {} are allowed", *job.spp, limits::kMaxSpp)});
  const auto pruned = needed_part(request, blobs, frame, *read, job.settings);
  if (!pruned) return tl::unexpected(pruned.error());
  const Scene& scene = pruned->scene;
  for (const Asset& a : scene.assets) {
    const auto known = [&](const BlobRef& b) { return b.digest == a.digest; };
    if (std::none_of(job.assets.begin(), job.assets.end(), known))
      job.assets.push_back({a.digest, a.bytes, a.name});
  }
  if (job.assets.size() > ls::limits::kAssetsPerJob)
    return refuse({Errc::invalid_argument,
                   fmt::format("the scene uses {} files; workers can be told of {}: merge some of its meshes",
                               job.assets.size(), ls::limits::kAssetsPerJob)});
  note_analysis(*pruned, job.settings, job);
  admission.text_bytes = request.scene_text.size() + read->text_bytes;
  admission.scene_json = serialize(scene);
  job.scene = sha256(admission.scene_json);
  job.reference_same_seed = same_noise(origin, job.scene, job.settings.seed);
  JobPlan plan = plan_of(job);
  plan.brief.job.value = "new";
  if (auto ok = check_plan(plan); !ok) return refuse(ok.error());
  return admission;
}

Result<Reference> load_reference(const JobSpec& spec, FrameSize size, const BlobStore& blobs) {
  const Digest& digest = *spec.reference;
  if (!blobs.has(digest))
    return fail(
        Errc::failed_precondition,
        fmt::format("the reference's blob {0} is not here: PUT /api/v1/blobs/{0} first", digest.hex()));
  ExrLimits limits;
  // The picture may have as many pixels as a reference of the right size. The limit is at least 2^22, so that
  // a slightly wrong size is reported as a wrong size and not as too large.
  limits.max_pixels = std::max<std::uint64_t>(
      static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height),
      std::uint64_t{1} << 22);
  const auto bytes = blobs.size(digest);
  if (!bytes) return tl::unexpected(bytes.error());
  if (*bytes > limits.max_bytes)
    return fail(Errc::invalid_argument,
                fmt::format("the reference has {} bytes; at most {} are read", *bytes, limits.max_bytes));
  const auto exr = blobs.read(digest, 0, *bytes);
  if (!exr) return tl::unexpected(exr.error());
  return read_reference(*exr, "the reference", size, limits);
}

std::string replay_of(const StoredJob& job) {
  const auto frame = frame_of(job.id);
  return replay_command(job.name, job.spec, frame ? std::optional(frame->frame) : std::nullopt);
}

// A world (the scene as loaded by a worker) takes at least as much memory as its files; the user may request
// workers with more memory.
std::uint64_t memory_need(const StoredJob& job) {
  std::uint64_t files = 0;
  for (const BlobRef& file : job.assets) files += file.bytes;
  return std::max(files, job.spec.memory.value_or(0));
}

JobPlan plan_of(const StoredJob& job) {
  JobPlan plan;
  plan.brief = {job.id, job.scene, job.settings, digest_of(job.settings), job.assets, job.needs};
  plan.grid = {job.settings.size, job.settings.tile};
  plan.spp = job.spp;
  plan.target_error = job.spec.target_error;
  plan.target_denoised = job.spec.target_layer == TargetLayer::denoised;
  plan.time = job.spec.time;
  plan.priority = job.spec.priority;
  plan.tags = job.spec.tags;
  plan.owner = job.owner;
  plan.replay = replay_of(job);
  if (const auto frame = frame_of(job.id)) plan.group = frame->sequence.value;
  plan.max_workers = job.spec.max_workers.value_or(0);
  plan.max_units = job.spec.max_units.value_or(0);
  plan.memory_bytes = memory_need(job);
  plan.class_asked = job.spec.numeric_class.value_or("");
  plan.focus = job.focus;
  return plan;
}

}  // namespace ls::coordinator
