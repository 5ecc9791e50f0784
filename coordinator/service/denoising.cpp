#include "coordinator/service/denoising.h"

#include "coordinator/admission/admission.h"
#include "core/image/exr/final_image.h"

namespace ls::coordinator {

Result<void> Denoising::available() const {
  const auto denoiser = Denoiser::find(threads_, library_);
  if (!denoiser) return tl::unexpected(denoiser.error());
  return {};
}

Result<Denoised> Denoising::denoise(const Film& film) const {
  const TimePoint start = clock_.now();
  const auto denoiser = Denoiser::find(threads_, library_);
  if (!denoiser) return tl::unexpected(denoiser.error());
  auto image = denoised_image(film, *denoiser);
  if (!image) return tl::unexpected(image.error());
  Denoised out{std::move(*image), {}};
  out.figures = {out.image.by, {}, out.image.error, seconds(clock_.now() - start), {}};
  return out;
}

std::shared_ptr<const Denoised> Denoising::of(const Film& film) {
  const Digest pixels = pixels_sha256(film);
  const std::lock_guard lock(mutex_);
  if (last_ && last_pixels_ == pixels) return last_;
  last_.reset();  // frees the memory of the previous image first
  auto made = denoise(film);
  if (!made) {
    Denoised none;
    none.figures.trouble = made.error().message;
    // A failure is not cached: a later attempt may succeed
    return std::make_shared<const Denoised>(std::move(none));
  }
  last_ = std::make_shared<const Denoised>(std::move(*made));
  last_pixels_ = pixels;
  return last_;
}

std::shared_ptr<const Denoised> Denoising::of_job(const Film& film, ReportFacts& facts,
                                                  std::shared_ptr<const Denoised> made) {
  if (!facts.job.spec.denoise || facts.samples == 0) return nullptr;
  if (!made) made = of(film);
  facts.denoised = made->figures;
  if (made->image.rgb.empty() || !facts.job.spec.reference || facts.job.reference_same_seed ||
      facts.pixels_without_samples > 0)
    return made;
  if (const auto reference = load_reference(facts.job.spec, facts.job.settings.size, blobs_))
    facts.denoised->true_error = true_error(*reference, made->image.rgb);
  return made;
}

}  // namespace ls::coordinator
