// The table of a job's settings: names, meanings, units, ranges and options (setting.h). The default of a
// setting is its value in a default-constructed JobSpec. CONTRIBUTING.md says how to add a setting.
#pragma once

#include <concepts>
#include <type_traits>

#include "core/job/limits.h"
#include "core/job/setting.h"
#include "core/job/settings.h"
#include "core/job/values.h"

namespace ls::job {

template <class T, class U>
concept Of = std::same_as<std::remove_const_t<T>, U>;

// Returns the names of the values of an enumeration: "rec709, rec2020, ...".
template <class E>
std::string names_of_choices() {
  std::string names;
  for (const E one : offered(E{})) names += (names.empty() ? "" : ", ") + std::string(to_string(one));
  return names;
}
std::string integrator_names();  // returns "volpath, volpath_distant_mis, ..."

// Rows of settings that can also be changed later (coordinator/views/describe_change.h).
inline constexpr Setting kSpp{
    .name = "spp",
    .doc = "Samples per pixel; the scene's number if spp, a target error and a time are all missing.",
    .more = "With a target error, no pixel gets more samples than this.",
    .range = {1, kMaxSpp},
    .option = "--spp",
    .render = true,
    .again = true,
    .again_doc =
        "Samples per pixel. Without spp, a target error and a time, the new job ends as the earlier "
        "one was asked to."};
inline constexpr Setting kTargetError{
    .name = "target_error",
    .doc = "The job ends when the estimated relMSE of its image is at most this.",
    .more = "Tiles that need more samples for it get more.",
    .range = {0, static_cast<std::uint64_t>(kMaxTargetError)},
    .option = "--target-error",
    .placeholder = "E",
    .render = true,
    .again = true};
inline constexpr Setting kPriority{
    .name = "priority",
    .doc = "Jobs with a higher priority are rendered first.",
    .range = {-kMaxPriority, kMaxPriority},
    .option = "--priority",
    .who =
        "With a token of the role `submit`, at most the value of the coordinator's option "
        "`--user-priority`.",
    .again = true,
    .always = true};
inline constexpr Setting kAfter{
    .name = "after",
    .doc = "Ids of jobs that must be done before this job begins.",
    .more =
        "A frame of a sequence waits only for the frame with the same number if the other job is a "
        "sequence of the same frames; otherwise it waits for the whole job. A job that does not exist is "
        "an error (400), and so is one that has failed or was cancelled (409).",
    .option = "--after",
    .placeholder = "JOB,...",
    .again = true};

template <class V, Of<JobSpec> T>
void describe(V& v, T& s) {
  v.setting(kSpp, s.spp);
  v.setting(kTargetError, s.target_error);
  v.setting({.name = "target_layer",
             .doc = "The image whose error is compared with the target error: the image as rendered (raw) "
                    "or its denoised layers (denoised).",
             .more = "With \"denoised\" the image is denoised. 409 if the coordinator has no Open Image "
                     "Denoise.",
             .option = "--target-layer",
             .placeholder = "LAYER",
             .render = true},
            s.target_layer);
  v.setting({.name = "time",
             .doc = "The job ends this many seconds after its first ray.",
             .unit = "seconds",
             .range = {0, static_cast<std::uint64_t>(kMaxSeconds)},
             .option = "--time",
             .placeholder = "SECONDS",
             .render = true,
             .again = true},
            s.time);
  v.setting({.name = "seed",
             .doc = "Number from which all random numbers follow; another seed gives other noise.",
             .more = "Without it, the seed is 0.",
             .range = {0, UINT64_MAX},
             .option = "--seed",
             .absent = "0",
             .render = true,
             .again = true,
             .again_doc = "Number from which all random numbers follow. Without it, the seed of the earlier "
                          "job.",
             .pixels = true},
            s.seed);
  v.setting(
      {.name = "frames",
       .doc = "The frames of a sequence, such as 1-10 or, for every second frame, 1-10x2; # in the "
              "names of files and $frame in the scene stand for the frame's number.",
       .more = "Each frame is an image of its own; a sequence has at most 10000 frames. A run of # is "
               "replaced by the number with as many digits. Frame N has the seed `seed` + N. `time` and "
               "`target_error` apply to each frame. All frames are read, and all files checked, before "
               "the job is accepted.",
       .option = "--frames",
       .placeholder = "A-B",
       .render = true},
      s.frames);
  v.setting({.name = "fps",
             .doc = "Frames of the sequence per second, for the attribute framesPerSecond of the image.",
             .range = {0, static_cast<std::uint64_t>(kMaxFps)},
             .option = "--fps",
             .render = true},
            s.fps);
  v.setting({.name = "size",
             .doc = "Size of the image in pixels, instead of the size in the scene.",
             .option = "--size",
             .placeholder = "WxH",
             .render = true,
             .pixels = true},
            s.size);
  v.setting({.name = "integrator",
             .doc = "Integrator, instead of the one in the scene.",
             .option = "--integrator",
             .placeholder = "NAME",
             .choices = integrator_names,
             .render = true,
             .pixels = true},
            s.integrator);
  v.setting({.name = "techniques",
             .doc = "Sampling techniques that are used (+NAME) or not used (-NAME), for debugging.",
             .more = "Without it, they are chosen for the scene. Every image is right with any of them; only "
                     "its noise differs.",
             .option = "--techniques",
             .placeholder = "-NAME,+NAME",
             .choices = technique_names,
             .render = true,
             .pixels = true},
            s.techniques);
  v.setting({.name = "aov",
             .doc = "Further layers of the image (docs/reference/aovs.md).",
             .option = "--aov",
             .placeholder = "NAME,...",
             .choices = known_aovs,
             .render = true,
             .always = true},
            s.aov);
  v.setting(
      {.name = "deep",
       .doc = "The image also has a deep image, with at most this many slices in each pixel, and one "
              "behind them for the environment; 0: none (docs/guide/compositing.md).",
       .more = "Each slice takes 20 bytes a pixel in every unit's result and 40 in the coordinator's "
               "memory.",
       .range = {0, kMostDeepSlices},
       .option = "--deep",
       .placeholder = "SLICES",
       .render = true,
       .again = true,
       .again_doc = "The image also has a deep image, with at most this many slices in each pixel; 0: none. "
                    "Without it, as the earlier job."},
      s.deep);
  v.setting(
      {.name = "deep_alpha",
       .doc = "The deep image has alpha and depths, but no colours, as holdouts need it.",
       .more = "Each slice then takes 8 bytes a pixel in every unit's result and 16 in the coordinator's "
               "memory. Needs `deep`.",
       .option = "--deep-alpha",
       .render = true},
      s.deep_alpha);
  v.setting({.name = "mix",
             .doc = "Multiplies the light of the scene's light groups (docs/guide/light-groups.md): "
                    "key=2,fill=0.5:0.4:0.3 (R:G:B).",
             .more = "The groups are those of `light_group` in the scene; `other` is the light without one.",
             .option = "--mix",
             .placeholder = "GROUP=FACTOR,...",
             .render = true,
             .again = true,
             .again_doc = "Multiplies the light of the light groups of the earlier job's scene: "
                          "key=2,fill=0.5:0.4:0.3 (R:G:B).",
             .pixels = true},
            s.mix);
  v.setting({.name = "defines",
             .doc = "Values of the scene's $NAME parameters.",
             .query = "define",
             .option = "-D,--define",
             .placeholder = "NAME=VALUE",
             .render = true,
             .pixels = true,
             .always = true},
            s.defines);
  v.setting(kPriority, s.priority);
  v.setting({.name = "float",
             .doc = "The image has 32-bit numbers instead of 16-bit numbers.",
             .option = "--float",
             .render = true,
             .merge = true,
             .always = true},
            s.float_output);
  v.setting(
      {.name = "color_space",
       .doc = "Colour space of the image, to which its colours are converted when it is written.",
       .more = "The scene is rendered in Rec. 709 in any case, and PNGs, videos and the dashboard stay sRGB "
               "(docs/reference/image-file.md).",
       .option = "--color-space",
       .placeholder = "NAME",
       .choices = names_of_choices<ColourSpace>,
       .render = true,
       .merge = true},
      s.colour_space);
  v.setting(
      {.name = "exr_compression",
       .doc = "How the image is packed.",
       .more = "dwaa and dwab change the colours (lossy). They need exr_parts \"layers\", which keeps them "
               "away from the other layers, and such an image has no seal: `lightshaft verify` refuses it.",
       .option = "--exr-compression",
       .placeholder = "NAME",
       .choices = names_of_choices<ExrCompression>,
       .render = true,
       .merge = true},
      s.exr_compression);
  v.setting({.name = "exr_parts",
             .doc = "Parts of the image: one for all layers, or one for each of the layers.",
             .option = "--exr-parts",
             .placeholder = "one|layers",
             .render = true,
             .merge = true},
            s.exr_parts);
  v.setting(
      {.name = "denoise",
       .doc = "The image also has the layers denoised.R, denoised.G and denoised.B, whose error is in "
              "the report.",
       .more = "Needs Open Image Denoise (deploy/install-denoiser.sh); 409 if the coordinator does not "
               "have it.",
       .option = "--denoise",
       .render = true,
       .again = true,
       .again_doc = "The image also has the layers denoised.R, denoised.G and denoised.B, whose error is "
                    "in the report. Without it, the job has them if the earlier job has."},
      s.denoise);
  v.setting({.name = "tags",
             .doc = "Only workers that have all of these tags render the job.",
             .option = "--tags",
             .placeholder = "A,B",
             .always = true},
            s.tags);
  v.setting({.name = "max_workers",
             .doc = "At most this many workers render the job at the same time.",
             .range = {1, kMaxAtOnce},
             .option = "--max-workers"},
            s.max_workers);
  v.setting({.name = "max_units",
             .doc = "At most this many units of the job are assigned to workers at the same time.",
             .range = {1, kMaxAtOnce},
             .option = "--max-units"},
            s.max_units);
  v.setting({.name = "memory",
             .doc = "Only workers with at least this many bytes of memory render the job.",
             .more = "Without it, or if the job's files are larger, the workers need as much memory as the "
                     "files have bytes.",
             .unit = "bytes",
             .range = {1, kMaxMemory},
             .option = "--memory",
             .placeholder = "BYTES",
             .again = true,
             .again_doc = "Only workers with at least this many bytes of memory render the job. Without it, "
                          "the memory of the earlier job."},
            s.memory);
  v.setting({.name = "numeric_class",
             .doc = "Only workers of this numeric class render the job: the beginning of its digest or of "
                    "its platform, such as armv8-a.",
             .more = "`lightshaft workers` shows the classes.",
             .option = "--numeric-class",
             .placeholder = "CLASS"},
            s.numeric_class);
  v.setting(kAfter, s.after);
  v.setting({.name = "reference",
             .doc = "SHA-256 of the blob of a reference image, with which every checkpoint is compared.",
             .more = "The reference is an EXR of the job's size. If it has the layers stderr.R, stderr.G and "
                     "stderr.B, their square is subtracted from the squared difference. It must be "
                     "independent of the job, so it must have another seed. On the command line, "
                     "`--reference FILE` uploads the file."},
            s.reference);
}

}  // namespace ls::job
