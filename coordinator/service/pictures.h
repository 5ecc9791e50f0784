// Reads the output of jobs: images, maps, tiles, the report, the log. Images of running jobs are copied under
// the lock; images of ended jobs are read from disk.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/assemble/stored_layers.h"
#include "coordinator/service/denoising.h"
#include "coordinator/service/state/job_files.h"
#include "coordinator/service/state/job_table.h"
#include "core/base/guarded.h"
#include "core/image/exr/final_image.h"
#include "core/image/light_mix/light_mix.h"
#include "util/display/display_views.h"

namespace ls::coordinator {

struct Core;

class Pictures {
 public:
  Pictures(Guarded<Core>& core, const JobStore& store, const JobFiles& files, const BlobStore& blobs,
           Denoising& denoising, const DisplayViews* views, const Clock& clock)
      : core_(core),
        store_(store),
        files_(files),
        blobs_(blobs),
        denoising_(denoising),
        views_(views),
        clock_(clock) {}

  // `mix`: the image with other factors of its light groups, instead of the image itself.
  Result<std::vector<std::byte>> image_exr(const JobId& id, const std::optional<LightMix>& mix) const;
  // Writing a large deep image takes minutes and gigabytes, so of jobs that go on there is one only if
  // `while_rendering`; and one is written at a time.
  Result<std::vector<std::byte>> deep_exr(const JobId& id, bool while_rendering) const;
  Result<std::vector<std::byte>> image_png(const JobId& id, const Look& look,
                                           const std::optional<LightMix>& mix) const;
  Result<std::string> mix_json(const JobId& id, const LightMix& mix) const;  // the error of a mix
  Result<std::vector<std::byte>> thumbnail_png(const JobId& id) const;
  // A job's tone-mapped picture for screens, reduced to the finest mip level at which neither side has more
  // than `most_side` pixels. `rgb` holds 8 bits each of R, G and B for every pixel, row by row. Pixels
  // without samples are black.
  struct Shown {
    FrameSize size;
    std::vector<std::uint8_t> rgb;
  };
  Result<Shown> shown(const JobId& id, const Look& look, int most_side) const;
  // Returns the transform of a Look's view. Error: there is no such view.
  Result<ToCodes> codes_of(const std::string& view) const;
  // Returns the table of a view (DisplayView::cube()). Error: there is no such view.
  Result<std::vector<std::uint16_t>> cube_of(const std::string& view) const;
  Result<std::vector<std::byte>> error_png(const JobId& id) const;
  Result<std::vector<std::byte>> samples_png(const JobId& id) const;
  // The layers of an image, and their pixels as numbers (pictures_pixels.cpp)
  Result<std::string> layers_json(const JobId& id) const;
  Result<std::vector<std::byte>> pixels(const JobId& id, const PixelsAsked& asked) const;
  Result<std::vector<TileView>> tiles(const JobId& id) const;
  // The report of a sequence has the values of each frame and those of all frames together.
  Result<std::string> report_json(const JobId& id) const;
  // Returns {"meters": [...]}, with what each meter has measured so far; of a job with an image the list is
  // empty.
  Result<std::string> meters_json(const JobId& id) const;
  // The log of a sequence has the lines of all frames, ordered by time.
  Result<std::string> log(const JobId& id) const;
  // Returns the path of the file `name` (image.exr, deep.exr or report.json) in the folder of a done job.
  // Empty if the job is not done, or if everything is in memory.
  std::filesystem::path final_file(const JobId& id, const std::string& name) const;

 private:
  struct Picture {
    Film film;
    ReportFacts facts;
    std::optional<ImageError> error_of_mix;  // set if the film is a mix
  };
  // The denoised image that clients requested last. While its job runs, requests get this image until its age
  // is kDenoisedAge times the time that denoising took, although the job's image changes meanwhile.
  struct DenoisedView {
    std::string key;  // the job's id while it runs, then JobFiles::image_version()
    TimePoint made{};
    Duration cost{};
    std::shared_ptr<const Denoised> image;  // null: no samples yet
  };
  Result<Picture> picture(const JobId& id, const std::optional<LightMix>& mix = {}) const;
  Result<std::shared_ptr<const Denoised>> denoised_view(const JobId& id) const;
  Result<LayerMosaic> mosaic_of(const JobId& id, const PixelLayer& layer, int level) const;
  std::string sequence_report(const JobView& view) const;

  Guarded<Core>& core_;
  const JobStore& store_;
  const JobFiles& files_;
  const BlobStore& blobs_;
  Denoising& denoising_;
  const DisplayViews* const views_;  // null: only sRGB
  const Clock& clock_;
  mutable StoredImages stored_images_;
  mutable std::mutex deep_mutex_;      // held while a deep image is written
  mutable std::mutex denoised_mutex_;  // held while an image is denoised
  mutable DenoisedView denoised_;
};

}  // namespace ls::coordinator
