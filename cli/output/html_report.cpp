#include "cli/output/html_report.h"

#include "cli/output/output_file.h"
#include "common/report/job_page.h"

namespace ls::cli {

Result<void> save_html_report(const std::filesystem::path& file, const coordinator::Coordinator& coordinator,
                              const JobId& job, const std::string& report) {
  auto image = coordinator.image_png(job, 0);
  if (!image) return tl::unexpected(image.error());
  const auto page = report::job_page({report, std::move(*image),
                                      coordinator.error_png(job).value_or(std::vector<std::byte>{}),
                                      coordinator.samples_png(job).value_or(std::vector<std::byte>{})});
  return page ? save_result(file, *page) : tl::unexpected(page.error());
}

}  // namespace ls::cli
