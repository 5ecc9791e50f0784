// The request for a job, in two parts. RenderSettings determines the pixels of a unit (one tile and one range
// of samples). JobSpec has the whole request, also the settings that do not affect the pixels of a unit.
// `spp`, the number of samples per pixel, is in JobSpec only: if it is raised, the units that are already
// rendered stay valid.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/frame_range.h"
#include "core/base/light/light_mix.h"
#include "core/image/aov/aov.h"
#include "core/image/exr/final_image.h"
#include "core/image/frame/frame.h"
#include "core/job/techniques.h"

namespace ls {

// Everything except the scene that determines the value of a sample. The digest of its canonical JSON is part
// of every unit's header (core/image/film/partial.h).
struct RenderSettings {
  FrameSize size;
  int tile = 32;
  std::uint64_t seed = 0;
  std::string integrator;        // name of the integrator, as in IntegratorSettings::name; never empty
  int max_depth = -1;            // -1: unlimited; counts path segments, as in Mitsuba
  int rr_depth = 5;              // first depth at which Russian roulette may act
  std::vector<std::string> aov;  // sorted names of AOVs, as returned by names_of(AovSet); empty: colour only
  // Sorted names of the light groups, for AOVs of AovKind::groups; empty without such AOVs. A light whose
  // group is not in the list belongs to the group `other` if the list has it, and else to none.
  std::vector<std::string> light_groups;
  int deep = 0;             // number of slices of the deep image in each pixel; 0: there is none
  bool deep_alpha = false;  // true: the deep image has no colours
  int meters = 0;           // number of meters that the scene has; `size` is then that of their blocks
  bool operator==(const RenderSettings&) const = default;
};
AovSet aovs_of(const RenderSettings& settings);
inline TileGrid grid_of(const RenderSettings& s) { return {s.size, s.tile, s.meters > 0}; }

// Which layers must reach the target error: the image as rendered, or its denoised layers.
enum class TargetLayer { raw, denoised };
std::string_view to_string(TargetLayer layer);
std::optional<TargetLayer> parse_target_layer(std::string_view text);

// The whole request, as given in `spec` of the HTTP API or by the options of the command line. If a member
// that the scene also sets has no value, the scene's value applies.
struct JobSpec {
  std::optional<std::uint64_t> spp;
  // The job ends when its estimated relMSE (mean squared error relative to the brightness) is at most this.
  std::optional<double> target_error;
  TargetLayer target_layer = TargetLayer::raw;
  std::optional<double> time;  // seconds
  std::optional<std::uint64_t> seed;
  std::optional<FrameSize> size;
  std::optional<std::string> integrator;
  std::optional<TechniqueChoice> techniques;  // instead of what the scene's integrator says
  std::vector<std::string> aov;
  std::optional<std::uint32_t> deep;           // as in RenderSettings; nullopt: none, or as the earlier job
  bool deep_alpha = false;                     // as in RenderSettings
  std::optional<LightMix> mix;                 // factors of the light of the scene's light groups
  std::map<std::string, std::string> defines;  // values of the $name parameters in Mitsuba scenes, by name
  int priority = 0;
  bool float_output = false;
  ColourSpace colour_space = ColourSpace::rec709;  // of the image
  ExrCompression exr_compression = ExrCompression::zip;
  ExrParts exr_parts = ExrParts::one;
  // True: the image also has denoised layers (util/denoise/denoised_image.h). The coordinator computes them
  // from the film, to which it adds the AOVs that the denoiser needs.
  bool denoise = false;
  std::vector<std::string> tags;
  // The frame numbers of a sequence. Each frame is an image of its own. nullopt: the job is a single image.
  std::optional<FrameRange> frames;
  std::optional<double> fps;                 // frames of the sequence per second
  std::optional<std::uint32_t> max_workers;  // maximum number of workers at the same time
  std::optional<std::uint32_t> max_units;    // maximum number of units assigned to workers at the same time
  // Memory, in bytes, that a worker must have to get units of the job. If the job's files are larger than
  // this, the worker must have as much memory as the files.
  std::optional<std::uint64_t> memory;
  // The numeric class of the workers that may render the job; machines of one class compute the same bits.
  // The text is the beginning of the class's digest in hexadecimal, or the beginning of its platform
  // (WorkerHello::platform).
  std::optional<std::string> numeric_class;
  // Ids of jobs that must be done before this one begins. Of a job that the coordinator has taken: those that
  // are not done yet.
  std::vector<std::string> after;
  std::optional<Digest> reference;  // digest of the reference image, an EXR of the job's size
  bool operator==(const JobSpec&) const = default;
};

ImageForm form_of(const JobSpec& spec);

std::string canonical_json(const RenderSettings& settings);
Result<RenderSettings> parse_render_settings(std::string_view json);
Digest digest_of(const RenderSettings& settings);

// Checks that the film, the pixel sums of the whole image, is not larger than kMaxFilmBytes.
Result<void> check_film_size(const RenderSettings& settings);
// Checks size, tile, film, samples and the number of units against core/job/limits.h.
Result<void> check_job_size(const RenderSettings& settings, std::uint64_t spp);

std::string canonical_json(const JobSpec& spec);
// Parses a request. Unknown keys, wrong types and values out of range are errors that name the key.
Result<JobSpec> parse_job_spec(std::string_view json);
// The two steps of parse_job_spec(): parse_spec_object() parses the text as a JSON object (keys given twice
// and texts that are too long or too deeply nested are errors); job_spec_of() reads the request from the
// object.
Result<nlohmann::json> parse_spec_object(std::string_view text);
Result<JobSpec> job_spec_of(const nlohmann::json& object);

}  // namespace ls
