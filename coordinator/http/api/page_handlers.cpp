// The report of a job as an HTML page.
#include <fmt/format.h>

#include "common/report/job_page.h"
#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/problem.h"

namespace ls::http {

Response get_report_page(Api& api, const Request& request, const Params& params) {
  const auto id = job_of(request, params);
  if (!id) return problem(id.error());
  auto image = api.coordinator().image_png(*id, 0);
  if (!image) return problem(image.error());
  auto report = api.coordinator().report_json(*id);
  if (!report) return problem(report.error());
  auto page = report::job_page({std::move(*report), std::move(*image),
                                api.coordinator().error_png(*id).value_or(std::vector<std::byte>{}),
                                api.coordinator().samples_png(*id).value_or(std::vector<std::byte>{})});
  if (!page) return problem(page.error());
  Response response = text_response(200, "text/html; charset=utf-8", std::move(*page));
  response.headers.emplace_back("Content-Security-Policy",
                                report::job_page_policy() + "; frame-ancestors 'none'");
  response.headers.emplace_back("Content-Disposition",
                                fmt::format("inline; filename=\"{}.html\"", id->value));
  return response;
}

}  // namespace ls::http
