#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "util/report/html.h"
#include "util/report/job_sections.h"
#include "util/report/number_text.h"
#include "util/report/phrases.h"

namespace ls::report {
namespace {

struct Part {
  const char* name;  // name of this part of the time; also its key in the report
  const char* meaning;
};
constexpr std::array kParts{
    Part{"load", phrase("timeLoad")},     Part{"build", phrase("timeBuild")},
    Part{"render", phrase("timeRender")}, Part{"transfer", phrase("timeTransfer")},
    Part{"merge", phrase("timeMerge")},   Part{"idle", phrase("timeIdle")},
};

std::string fact(const char* name, const std::string& value, const std::string& note,
                 const char* css_class = "") {
  if (value == kAbsent) return "";
  return fmt::format("<div{}><dt>{}</dt><dd><b>{}</b>{}</dd></div>", css_class, name, value,
                     note.empty() ? "" : "<small>" + note + "</small>");
}

std::string within(const Json& report, const char* key) {
  if (doubtful(report)) return escape_html(phrase("doubt"));
  const auto ci = interval(report, key);
  return ci ? fmt::format("95 %: {} to {}", figure(ci->first), figure(ci->second)) : std::string();
}

std::string denoised_figure(const Json& report, const std::string& note, const char* css_class = "") {
  const Json& denoised = member(report, "denoised");
  if (!denoised.is_object() || !denoised.contains("relmse")) return "";
  const auto ci = interval(denoised, "relmse_ci95");
  std::string notes = ci ? fmt::format("95 %: {} to {}", figure(ci->first), figure(ci->second)) : "";
  if (!note.empty()) notes += (notes.empty() ? "" : "; ") + note;
  return fact("relMSE, denoised", figure(number(denoised, "relmse")), notes, css_class);
}

std::string key_figures(const Json& report) {
  constexpr const char* kKey = " class=\"key\"";
  const double target = number(report, "target_error");
  const std::string note = target > 0 ? fmt::format("target {}", given(target)) : "";
  // The error of the denoised layers comes first: a user who denoises an image looks at these layers.
  std::string out = denoised_figure(report, denoised_target(report) ? note : "", kKey);
  std::string raw = fact("relMSE", figure(number(report, "relmse")), within(report, "relmse_ci95"), kKey);
  if (!denoised_target(report) && !note.empty() && !raw.empty())
    raw.insert(raw.rfind("</dd>"), fmt::format("<small>{}</small>", note));
  out += raw;
  out += fact("Samples per pixel", given(number(report, "spp")), "", kKey);
  out += fact("Render time", duration(number(report, "render_seconds")), "first ray to last fold", kKey);
  return out + fact("Core time", duration(number(report, "core_seconds")), "spent on rendering", kKey);
}

std::string true_figures(const Json& report) {
  const Json& reference = member(report, "reference");
  const bool nested = reference.is_object();
  const double relmse = nested ? number(reference, "relmse") : number(report, "true_relmse");
  const double rmse = nested ? number(reference, "rmse") : number(report, "true_rmse");
  const double noise = number(reference, "noise_relmse");
  const std::string note = flag(reference, "same_seed", false) ? phrase("oneSeed")
                           : noise > 0 ? fmt::format("the reference's own, {}, taken off", figure(noise))
                                       : phrase("againstReference");
  return fact("True relMSE", true_figure(relmse, flag(reference, "below_noise", false)), note) +
         fact("True RMSE", true_figure(rmse, flag(reference, "rmse_below_noise", false)), "") +
         fact("FLIP", figure(number(reference, "flip")), "0: looks the same");
}

std::string threads_of(const Json& report) {
  const double threads = number(report, "threads");
  return threads > 0 ? fmt::format(", {} thread{}", threads_words(threads), threads == 1 ? "" : "s")
                     : std::string();
}

// The mean of the image as "R, G, B", with the largest half width of its three intervals.
std::string mean_figure(const Json& report) {
  const Json &mean = member(report, "mean"), &intervals = member(report, "mean_ci95");
  if (!mean.is_array() || mean.size() != 3) return "";
  std::string text;
  double half = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!mean[c].is_number()) return "";
    text += (c == 0 ? "" : ", ") + figure(mean[c].get<double>());
    if (!intervals.is_array() || intervals.size() != 3) continue;
    const Json& ends = intervals[c];
    if (!ends.is_array() || ends.size() != 2 || !ends[0].is_number() || !ends[1].is_number()) continue;
    half = std::max(half, (ends[1].get<double>() - ends[0].get<double>()) / 2);
  }
  const std::string note = doubtful(report) ? escape_html(phrase("doubt"))
                           : half > 0       ? fmt::format("95 %: ± {} at most", figure(half))
                                            : "";
  return fact("Mean of the image", text, note);
}

std::string lesser_figures(const Json& report) {
  std::string out = fact("RMSE", figure(number(report, "rmse")), within(report, "rmse_ci95"));
  out += fact("relMSE, 16 x 16", figure(number(report, "relmse_16")), within(report, "relmse_16_ci95"));
  out += mean_figure(report);
  out += true_figures(report);
  out +=
      fact("Efficiency", figure(number(report, "efficiency")), "1 / (relMSE × seconds)" + threads_of(report));
  out += fact("Efficiency per core", figure(number(report, "efficiency_per_core")),
              "1 / (relMSE × core seconds)");
  out += fact("Samples", count(number(report, "samples")), "");
  out += fact("Loading", duration(number(report, "load_seconds")), "");
  return out + fact("Memory", byte_size(number(report, "peak_rss_bytes")), "at its peak");
}

// Draws a stacked bar. Widths are attributes of SVG elements, because the page's policy forbids style
// attributes.
std::string bar(const Json& time, double total) {
  std::string out =
      R"(<svg class="bar" viewBox="0 0 1000 26" preserveAspectRatio="none" aria-hidden="true">)";
  double x = 0;
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    const double seconds = number(time, kParts[i].name);
    if (!(seconds > 0)) continue;
    const double width = 1000 * seconds / total;
    fmt::format_to(std::back_inserter(out),
                   R"(<rect class="t{}" x="{:.2f}" y="0" width="{:.2f}" height="26"/>)", i, x, width);
    x += width;
  }
  return out + "</svg>";
}

}  // namespace

std::string meters(const Json& report) {
  constexpr std::size_t kMost = 500;
  const std::vector<Json> all = objects(report, "meters");
  std::string rows;
  for (std::size_t i = 0; i < all.size() && i < kMost; ++i) {
    const Json& m = all[i];
    const auto ci = interval(m, "luminance_ci95");
    rows += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                        escape_html(text(m, "name")), figure(number(m, "luminance")),
                        ci ? fmt::format("{} to {}{}", figure(ci->first), figure(ci->second),
                                         flag(m, "trusted", false) ? "" : ": don't trust yet")
                           : "no sample has found light",
                        escape_html(text(m, "unit")));
  }
  if (rows.empty()) return "";
  if (all.size() > kMost) rows += fmt::format("<tr><th>and {} more</th></tr>\n", all.size() - kMost);
  return section(
      "Measured values",
      "<div class=\"wide\"><table><caption class=\"unseen\">Measured values</caption><thead><tr><th "
      "scope=\"col\">Meter</th><th scope=\"col\">Luminance</th><th scope=\"col\">95 % interval</th><th "
      "scope=\"col\">Unit</th></tr></thead><tbody>\n" +
          rows + "</tbody></table></div>");
}

std::string figures(const Json& report) {
  const std::string keys = key_figures(report), others = lesser_figures(report);
  std::string out = keys.empty() ? "" : "<dl class=\"figures\">" + keys + "</dl>";
  return out + (others.empty() ? "" : "<dl class=\"figures lesser\">" + others + "</dl>");
}

std::string time_split(const Json& report) {
  const Json& time = member(report, "time");
  double total = 0;
  for (const Part& part : kParts)
    if (const double seconds = number(time, part.name); std::isfinite(seconds) && seconds > 0)
      total += seconds;
  if (!(total > 0) || !std::isfinite(total)) return "";
  std::string rows;
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    const double seconds = number(time, kParts[i].name);
    if (!(seconds >= 0)) continue;
    rows += fmt::format(
        "<tr><th scope=\"row\"><svg class=\"swatch\" viewBox=\"0 0 10 10\" aria-hidden=\"true\"><rect "
        "class=\"t{}\" width=\"10\" "
        "height=\"10\" rx=\"2\"/></svg>{}</th><td>{}</td><td>{}</td><td class=\"why\">{}</td></tr>\n",
        i, kParts[i].name, duration(seconds), escape_html(percent(seconds / total)), kParts[i].meaning);
  }
  return section("Where the time went",
                 bar(time, total) +
                     fmt::format("<table class=\"split\"><caption>{}</caption><tbody>\n{}</tbody></table>",
                                 phrase("timeUnit"), rows));
}

}  // namespace ls::report
