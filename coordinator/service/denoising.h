// Denoised images of jobs. Denoising an image takes seconds, gigabytes of memory and all cores, so only one
// image is denoised at a time. The latest denoised image is kept: if a job's report, image and preview are
// requested in the same state of the job, they all need this image. Thread-safe.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "coordinator/assemble/job_report.h"
#include "coordinator/store/blobs/blob_store.h"
#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/image/film/film.h"
#include "util/denoise/denoised_image.h"

namespace ls::coordinator {

struct Denoised {
  DenoisedImage image;  // without pixels if denoising failed; the reason is in figures.trouble
  DenoisedFigures figures;
};

class Denoising {
 public:
  // `library` is the file of Open Image Denoise; empty: it is searched for (util/denoise/denoiser.h).
  Denoising(int threads, std::string library, const Clock& clock, const BlobStore& blobs)
      : threads_(threads), library_(std::move(library)), clock_(clock), blobs_(blobs) {}

  // Returns the error of Denoiser::find() if this machine cannot denoise.
  Result<void> available() const;

  // Denoises the film (an image in memory), which must have the AOVs that the denoiser needs. The error in
  // the figures is estimated from the samples; the true error is not set, because it needs a reference image.
  std::shared_ptr<const Denoised> of(const Film& film);
  // Returns the denoised image of a job with JobSpec::denoise, and puts its figures into `facts` (the values
  // for the job's report). `made`: this image, if it has been made already. Null if the job was submitted
  // without denoising or has no samples yet.
  std::shared_ptr<const Denoised> of_job(const Film& film, ReportFacts& facts,
                                         std::shared_ptr<const Denoised> made = nullptr);

 private:
  Result<Denoised> denoise(const Film& film) const;

  const int threads_;
  const std::string library_;
  const Clock& clock_;
  const BlobStore& blobs_;
  std::mutex mutex_;  // held while an image is denoised
  Digest last_pixels_;
  std::shared_ptr<const Denoised> last_;
};

}  // namespace ls::coordinator
