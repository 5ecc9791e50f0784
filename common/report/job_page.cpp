#include "common/report/job_page.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "common/image/exr/final_image.h"
#include "common/report/html.h"
#include "common/report/job_sections.h"
#include "common/report/log_plot.h"
#include "common/report/number_text.h"
#include "common/report/phrases.h"

namespace ls::report {
namespace {

std::string css() { return std::string(page_css()) + std::string(plot_css()); }

std::string size_of(const Json& report) {
  const auto size = interval(report, "size");
  return size ? fmt::format("{:.0f} × {:.0f}", size->first, size->second) : std::string();
}

std::string name_of(const Json& report) {
  for (const char* key : {"name", "job"})
    if (std::string name = text(report, key); !name.empty()) return name;
  return "render";
}

std::string how_it_ended(const Json& report) {
  const std::string state = text(report, "state"), stopped = text(report, "stopped");
  const std::string why = stopped == "spp"                                ? phrase("stoppedSpp")
                          : stopped == "error" && denoised_target(report) ? phrase("stoppedErrorDenoised")
                          : stopped == "error" && doubtful(report)        ? phrase("stoppedErrorInDoubt")
                          : stopped == "error"                            ? phrase("stoppedError")
                          : stopped == "time"                             ? phrase("stoppedTime")
                          : stopped == "user"                             ? phrase("stoppedUser")
                                                                          : "";
  if (state == "running") return "running: figures so far";
  return why.empty() ? state : (state.empty() ? "done" : state) + ": " + why;
}

std::string header(const Json& report) {
  std::string sub;
  for (const std::string& part :
       {how_it_ended(report), size_of(report), date_time(number(report, "submitted_unix"))})
    if (!part.empty() && part != kAbsent) sub += (sub.empty() ? "" : " · ") + escape_html(part);
  return fmt::format(
      "<header><p class=\"brand\"><svg viewBox=\"0 0 32 32\" aria-hidden=\"true\"><path class=\"beam\" "
      "d=\"M8 5 L15 3 L30 29 L13 "
      "29 Z\"/><path class=\"window\" d=\"M8 5 L15 3 L16.4 5.5 L8.6 7.8 Z\"/></svg>Lightshaft "
      "report</p><h1>{}</h1><p "
      "class=\"sub\">{}</p></header>\n",
      escape_html(name_of(report)), sub);
}

std::string picture(const std::vector<std::byte>& png, const std::string& alt) {
  return fmt::format("<img alt=\"{}\" src=\"{}\">", alt, data_url("image/png", png));
}

// Draws the colour scale of the maps, divided in equal factors.
std::string legend(const std::string& least, const std::string& most) {
  std::string out = R"(<svg class="ramp" viewBox="0 0 64 4" preserveAspectRatio="none" aria-hidden="true">)";
  for (int i = 0; i < 64; ++i) {
    const auto c = map_colour((i + 0.5) / 64);
    fmt::format_to(std::back_inserter(out),
                   R"(<rect x="{}" width="1.1" height="4" fill="#{:02x}{:02x}{:02x}"/>)", i, c[0], c[1],
                   c[2]);
  }
  return fmt::format("<span class=\"legend\">{}{}</svg>{}</span>", least, out, most);
}

std::string map(const std::vector<std::byte>& png, const char* name, const char* meaning,
                const std::string& ramp) {
  if (png.empty()) return "";
  return fmt::format("<figure class=\"map\">{}<figcaption><b>{}</b> {}{}</figcaption></figure>\n",
                     picture(png, fmt::format("Map of the {} over the image", name)), name, meaning, ramp);
}

std::string pictures(const JobPage& page, const Json& report) {
  std::string out;
  if (!page.image.empty())
    out += "<figure class=\"image\">" + picture(page.image, escape_html(name_of(report)) + ", the image") +
           "</figure>\n";
  const bool flagged = number(report, "few_hits_pixels") > 0;
  const std::string maps =
      map(page.error_map, "error",
          flagged ? "of each pixel: its relative standard error; magenta: too few hits to know it"
                  : "of each pixel: its relative standard error",
          legend(given(100 * kMapLeastError) + " %", given(100 * kMapMostError) + " % or more")) +
      map(page.samples_map, "samples", "of each pixel",
          legend(count(kMapLeastSamples), count(kMapMostSamples) + " or more"));
  return out + (maps.empty() ? "" : "<div class=\"pair\">" + maps + "</div>");
}

}  // namespace

Result<std::string> job_page(const JobPage& page) {
  const Json report = Json::parse(page.report, nullptr, false);
  if (!report.is_object())
    return fail(Errc::invalid_argument, "the report is no JSON object, so no page can be made of it");
  const std::string body = "<main>\n" + header(report) + failure(report) + pictures(page, report) +
                           figures(report) + verdict(report) + curves(report) + time_split(report) +
                           health(report) + techniques(report) + features(report) + provenance(report) +
                           "</main>";
  return document(name_of(report) + " · Lightshaft report", css(), body);
}

std::string job_page_policy() { return document_policy(css()); }

}  // namespace ls::report
