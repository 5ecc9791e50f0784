// Admission of sequences (jobs with frames): the scene is read once per frame, and either all frames are
// admitted or none.
#include <fmt/format.h>

#include <set>

#include "coordinator/admission/admission.h"
#include "coordinator/base/limits.h"
#include "core/job/frame_diagnostics.h"

namespace ls::coordinator {
namespace {

constexpr std::uint32_t kMostBadFrames = 64;  // reading ends when this many frames have errors

// Removes from each frame those warnings that an earlier frame also has, so that the sequence has each once.
void merge_warnings(std::vector<Admission>& frames) {
  std::set<std::string> reported;
  for (Admission& f : frames)
    std::erase_if(f.job.warnings, [&](const std::string& w) { return !reported.insert(w).second; });
}

void note_if_all_are_one(std::vector<Admission>& frames) {
  if (frames.size() < 2) return;
  for (const Admission& f : frames)
    if (f.job.scene != frames.front().job.scene) return;
  frames.front().job.warnings.push_back(fmt::format(
      "{}: warning: all {} frames are the same scene, but for their noise: nothing in it asks for "
      "$frame or has # in the name of a file",
      frames.front().job.name, frames.size()));
}

// Returns the bytes of scene text that all frames are expected to have together, from kProbes of them that
// are spread evenly: reading thousands of frames takes long, only to refuse them. 0 if one cannot be read, or
// if there are few.
std::uint64_t expected_size(const SubmitRequest& request, const BlobStore& blobs, const SceneReader& read,
                            const std::vector<std::uint32_t>& numbers) {
  constexpr std::size_t kProbes = 8;
  constexpr double kTolerance = 1.25;  // other frames may be smaller than those that were looked at
  if (numbers.size() < 4 * kProbes) return 0;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kProbes; ++i) {
    const auto frame = admit(request, blobs, read, numbers[i * (numbers.size() - 1) / (kProbes - 1)]);
    if (!frame) return 0;
    sum += std::max(frame->text_bytes, frame->scene_json.size());
  }
  return static_cast<std::uint64_t>(static_cast<double>(sum) / kProbes / kTolerance *
                                    static_cast<double>(numbers.size()));
}

}  // namespace

tl::expected<std::vector<Admission>, Rejected> admit_sequence(const SubmitRequest& request,
                                                              const BlobStore& blobs,
                                                              const SceneReader& read) {
  const auto numbers = request.spec.frames.value().frames();
  const auto too_much = [&](std::string_view what, std::uint64_t most) {
    return rejected({Errc::invalid_argument,
                     fmt::format("{} frames have more than {} {} together: make several jobs of them",
                                 numbers.size(), most, what)});
  };
  if (request.scene_text.size() > limits::kMaxSequenceText / numbers.size())
    return too_much("bytes of scene text", limits::kMaxSequenceText);
  if (const auto size = expected_size(request, blobs, read, numbers); size > limits::kMaxSequenceText)
    return too_much("bytes of scene text", limits::kMaxSequenceText);
  std::uint64_t text = 0, kept = 0, files = 0, tiles = 0;  // totals of all frames
  std::vector<Admission> frames;
  FrameDiagnostics found;
  std::uint32_t bad = 0;
  for (const std::uint32_t frame : numbers) {
    auto taken = admit(request, blobs, read, frame);
    if (!taken && taken.error().diagnostics.empty()) {
      if (frame != numbers.front())
        taken.error().error.message = fmt::format("frame {}: {}", frame, taken.error().error.message);
      return rejected(std::move(taken.error().error));
    }
    if (!taken) {
      found.add(frame, taken.error().diagnostics);
      frames.clear();
      if (++bad == kMostBadFrames || found.full()) break;
      continue;
    }
    found.add(frame, {});
    if (bad > 0) continue;
    text += taken->text_bytes;
    kept += taken->scene_json.size();
    files += taken->job.assets.size();
    tiles += grid_of(taken->job.settings).count();
    if (text > limits::kMaxSequenceText || kept > limits::kMaxSequenceText)
      return too_much("bytes of scene text", limits::kMaxSequenceText);
    if (files > limits::kMaxSequenceFiles) return too_much("files", limits::kMaxSequenceFiles);
    if (tiles > limits::kMaxSequenceTiles) return too_much("tiles", limits::kMaxSequenceTiles);
    frames.push_back(std::move(*taken));
  }
  if (bad > 0)
    return rejected(
        {Errc::invalid_argument,
         fmt::format("the scene {} cannot be read for {} of its {} frames{}", request.scene_name, bad,
                     numbers.size(), bad == kMostBadFrames || found.full() ? " at least" : "")},
        found.take());
  merge_warnings(frames);
  note_if_all_are_one(frames);
  return frames;
}

}  // namespace ls::coordinator
