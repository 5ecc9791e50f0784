// What a job asks for, in two parts: what a unit's pixels depend on (RenderSettings), and what only the job
// as a whole depends on (JobSpec). Raising a job's samples must not rename its units, so spp stands in the
// second.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/frame_range.h"
#include "common/image/aov.h"
#include "common/image/frame.h"

namespace ls {

// Everything but the scene that decides the value of a sample. Its canonical JSON is hashed into every unit.
struct RenderSettings {
  FrameSize size;
  int tile = 32;
  std::uint64_t seed = 0;
  std::string integrator;        // as IntegratorSettings::name: resolved, never empty
  int max_depth = -1;            // -1: unlimited; as in the dialect: number of path segments
  int rr_depth = 5;              // first depth at which Russian roulette may act
  std::vector<std::string> aov;  // sorted names, as of names_of(AovSet); empty: colour only
  bool operator==(const RenderSettings&) const = default;
};
AovSet aovs_of(const RenderSettings& settings);

// The request, as in the HTTP contract's `spec` and the command line's options. Absent means: as the scene
// says.
struct JobSpec {
  std::optional<std::uint64_t> spp;
  std::optional<double> target_error;  // relMSE
  std::optional<double> time;          // seconds
  std::optional<std::uint64_t> seed;
  std::optional<FrameSize> size;
  std::optional<std::string> integrator;
  std::vector<std::string> aov;
  std::map<std::string, std::string> defines;  // Mitsuba's $name parameters
  int priority = 0;
  bool float_output = false;
  std::vector<std::string> tags;
  std::optional<FrameRange> frames;          // a sequence: one film per frame; absent: one image
  std::optional<std::uint32_t> max_workers;  // that may render it at once
  std::optional<std::uint32_t> max_units;    // of work lent to workers at once
  std::optional<std::uint64_t> memory;       // bytes that a worker must have; at least its files' anyway
  std::optional<Digest> reference;           // blob of the right image, an EXR of the job's size
  bool operator==(const JobSpec&) const = default;
};

std::string canonical_json(const RenderSettings& settings);
Result<RenderSettings> parse_render_settings(std::string_view json);
Digest digest_of(const RenderSettings& settings);

// Is this much work at all possible? Size, tile, samples and the number of units against common/job/limits.h.
Result<void> check_job_size(const RenderSettings& settings, std::uint64_t spp);

std::string canonical_json(const JobSpec& spec);
// Unknown keys, wrong types and values out of range are errors that name the key.
Result<JobSpec> parse_job_spec(std::string_view json);

}  // namespace ls
