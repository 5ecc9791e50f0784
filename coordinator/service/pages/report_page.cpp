#include "coordinator/service/pages/report_page.h"

#include "coordinator/domain/job_state.h"
#include "coordinator/service/coordinator.h"
#include "util/report/job_page.h"

namespace ls::coordinator {

Result<std::string> report_page(const Coordinator& coordinator, const JobId& job, std::string report) {
  const auto view = coordinator.job(job);
  if (!view) return tl::unexpected(view.error());
  report::JobPage page{.report = std::move(report)};
  // While a job renders, nobody who reads its report has to wait until it is denoised.
  if (view->denoise && is_terminal(view->state))
    if (auto denoised = coordinator.image_png(job, {.denoised = true})) {
      page.image = std::move(*denoised);
      page.denoised = true;
    }
  if (!page.denoised) {
    auto image = coordinator.image_png(job);
    if (!image) return tl::unexpected(image.error());
    page.image = std::move(*image);
  }
  page.error_map = coordinator.error_png(job).value_or(std::vector<std::byte>{});
  page.samples_map = coordinator.samples_png(job).value_or(std::vector<std::byte>{});
  return report::job_page(page);
}

}  // namespace ls::coordinator
