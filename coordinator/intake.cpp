#include "coordinator/intake.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/job/replay_command.h"
#include "common/protocol/limits.h"
#include "common/scene/integrators.h"
#include "common/scene/nori_words.h"
#include "common/scene/serialize.h"
#include "coordinator/features.h"
#include "coordinator/limits.h"

namespace ls::coordinator {
namespace {

// "./a/b.obj" and "a/b.obj" are one name.
std::string plain_name(std::string_view name) {
  while (name.starts_with("./")) name.remove_prefix(2);
  return std::string(name);
}

class UploadedAssets final : public AssetSource {
 public:
  UploadedAssets(const std::map<std::string, Digest>& assets, const BlobStore& blobs) : blobs_(blobs) {
    for (const auto& [name, digest] : assets) assets_.emplace(plain_name(name), digest);
  }

  Result<Asset> find(std::string_view name) override {
    const auto found = assets_.find(plain_name(name));
    if (found == assets_.end())
      return fail(Errc::not_found,
                  fmt::format("\"{}\" was not sent along: name it among the assets, with its SHA-256{}", name,
                              offered()));
    const auto bytes = blobs_.size(found->second);
    if (!bytes)
      return fail(Errc::not_found,
                  fmt::format("the bytes of \"{}\" have not been uploaded: PUT them to /api/v1/blobs/{}",
                              name, found->second.hex()));
    return Asset{std::string(name), found->second, *bytes};
  }

  Result<std::string> text(std::string_view name) override {
    const auto asset = find(name);
    if (!asset) return tl::unexpected(asset.error());
    if (asset->bytes > limits::kMaxIncludeBytes)
      return fail(Errc::invalid_argument, fmt::format("\"{}\" has {} bytes; an included scene may have {}",
                                                      name, asset->bytes, limits::kMaxIncludeBytes));
    const auto bytes = blobs_.read(asset->digest, 0, asset->bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    text_bytes_ += bytes->size();
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  }

  std::size_t text_bytes() const { return text_bytes_; }

 private:
  std::string offered() const {
    if (assets_.empty()) return "; no assets were named";
    std::string names;
    std::size_t shown = 0;
    for (const auto& [name, digest] : assets_) {
      if (++shown > 5) return "; named were" + names + fmt::format(" and {} more", assets_.size() - 5);
      names += fmt::format(" \"{}\"", name);
    }
    return "; named were" + names;
  }

  std::map<std::string, Digest> assets_;
  std::size_t text_bytes_ = 0;
  const BlobStore& blobs_;
};

Error invalid(std::string text) { return {Errc::invalid_argument, std::move(text)}; }

// The job's choice before the scene's.
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
  if (ours == "path" && !scene.media.empty())
    warnings.push_back("the integrator `path` renders without media: the scene's " +
                       std::to_string(scene.media.size()) + " media are left out");
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
  if (spec.time && !(std::isfinite(*spec.time) && *spec.time > 0 && *spec.time <= limits::kMaxTimeSeconds))
    return tl::unexpected(
        invalid(fmt::format("time must be between 0 and {} seconds", limits::kMaxTimeSeconds)));
  if (spec.spp && (*spec.spp == 0 || *spec.spp > limits::kMaxSpp))
    return fail(Errc::invalid_argument,
                fmt::format("{} samples per pixel: it must be 1 to {}", *spec.spp, limits::kMaxSpp));
  if (std::abs(spec.priority) > limits::kMaxPriority)
    return tl::unexpected(invalid(fmt::format("priority must be within +-{}", limits::kMaxPriority)));
  if (!spec.aov.empty())
    return tl::unexpected(invalid(fmt::format(
        "there is no output \"{}\"; this version writes colour, stderr and spp", spec.aov.front())));
  return {};
}

Result<RenderSettings> settings_of(const Scene& scene, const JobSpec& spec, std::uint32_t frame,
                                   std::vector<std::string>& warnings) {
  RenderSettings settings;
  settings.size = spec.size.value_or(scene.film.image_size());
  if (auto ok = check_size(settings.size); !ok) return tl::unexpected(ok.error());
  settings.seed = spec.seed.value_or(0) + frame;
  if (auto ok = choose_integrator(scene, spec, settings, warnings); !ok) return tl::unexpected(ok.error());
  return settings;
}

Rejected rejected(Error error, std::vector<Diagnostic> diagnostics = {}) {
  return {std::move(error), std::move(diagnostics)};
}

}  // namespace

tl::expected<Intake, Rejected> take_in(const SubmitRequest& request, const BlobStore& blobs,
                                       std::optional<std::uint32_t> frame) {
  const auto refuse = [](Error error, std::vector<Diagnostic> found = {}) {
    return tl::unexpected(rejected(std::move(error), std::move(found)));
  };
  if (request.scene_text.size() > limits::kMaxSceneText)
    return refuse({Errc::invalid_argument, fmt::format("the scene text has {} bytes; {} are allowed",
                                                       request.scene_text.size(), limits::kMaxSceneText)});
  if (request.assets.size() > limits::kMaxAssets)
    return refuse({Errc::invalid_argument, fmt::format("{} assets were named; {} are allowed",
                                                       request.assets.size(), limits::kMaxAssets)});
  if (auto ok = check_spec(request.spec); !ok) return refuse(ok.error());

  UploadedAssets assets(request.assets, blobs);
  ReadResult read = read_scene(request.scene_name, request.scene_text, assets, {request.spec.defines, false, frame});
  if (!read.scene)
    return refuse(invalid(fmt::format("the scene {} cannot be read", request.scene_name)),
                  std::move(read.diagnostics));
  const Scene& scene = *read.scene;

  Intake intake;
  StoredJob& job = intake.job;
  job.name = request.scene_name.substr(0, limits::kMaxNameBytes);
  for (const auto& d : read.diagnostics)
    if (job.warnings.size() < limits::kMaxWarnings) job.warnings.push_back(format_diagnostic(d));
  auto settings = settings_of(scene, request.spec, frame.value_or(0), job.warnings);
  if (!settings) return refuse(settings.error());
  job.settings = std::move(*settings);
  job.spec = request.spec;
  job.spp = request.spec.spp;
  if (!job.spp && !request.spec.target_error && !request.spec.time) job.spp = scene.sample_count;
  if (job.spp && *job.spp > limits::kMaxSpp)
    return refuse({Errc::invalid_argument,
                   fmt::format("{} samples per pixel: at most {} are allowed", *job.spp, limits::kMaxSpp)});
  for (const Asset& a : scene.assets) {
    const auto known = [&](const BlobRef& b) { return b.digest == a.digest; };
    if (std::none_of(job.assets.begin(), job.assets.end(), known))
      job.assets.push_back({a.digest, a.bytes, a.name});
  }
  if (job.assets.size() > ls::limits::kAssetsPerJob)
    return refuse({Errc::invalid_argument,
                   fmt::format("the scene uses {} files; workers can be told of {}: merge some of its meshes",
                               job.assets.size(), ls::limits::kAssetsPerJob)});
  const SceneFeatures features = features_of(scene);
  job.features_used = features.used;
  job.features_left_out = features.left_out;
  intake.text_bytes = request.scene_text.size() + assets.text_bytes();
  intake.scene_json = serialize(scene);
  job.scene = sha256(intake.scene_json);
  JobPlan plan = plan_of(job);
  plan.brief.job.value = "new";
  if (auto ok = check_plan(plan); !ok) return refuse(ok.error());
  return intake;
}

std::string replay_of(const StoredJob& job) {
  const auto frame = frame_of(job.id);
  return replay_command(job.name, job.spec, frame ? std::optional(frame->frame) : std::nullopt);
}

JobPlan plan_of(const StoredJob& job) {
  JobPlan plan;
  plan.brief = {job.id, job.scene, job.settings, digest_of(job.settings), job.assets};
  plan.grid = {job.settings.size, job.settings.tile};
  plan.spp = job.spp;
  plan.target_error = job.spec.target_error;
  plan.time = job.spec.time;
  plan.priority = job.spec.priority;
  plan.tags = job.spec.tags;
  plan.replay = replay_of(job);
  return plan;
}

}  // namespace ls::coordinator
