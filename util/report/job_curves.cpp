#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "util/report/html.h"
#include "util/report/job_sections.h"
#include "util/report/log_plot.h"
#include "util/report/number_text.h"
#include "util/report/phrases.h"

namespace ls::report {
namespace {

// Largest number of rows in the table. If there are more checkpoints, the table has the last ones.
constexpr std::size_t kMostRows = 256;

struct Clock {
  const char* key;
  const char* id;
  const char* name;
  const char* axis;
};
constexpr Clock kWall{"seconds", "wall", "wall clock", "time since the first ray"};
constexpr Clock kCores{"core_seconds", "cores", "core time", "core time spent on rendering"};

std::string range(const std::optional<std::pair<double, double>>& ci, std::string (*words)(double)) {
  return ci ? fmt::format("{} to {}", words(ci->first), words(ci->second)) : std::string();
}

// Returns the 95 % interval of the error that is shown at a checkpoint. `doubt`: the error estimate at the
// last checkpoint is not trusted. Then no checkpoint gets an interval, because the report does not judge the
// estimates at earlier checkpoints.
std::optional<std::pair<double, double>> shown_interval(const Json& point, bool doubt) {
  return doubt ? std::nullopt : interval(point, "relmse_ci95");
}

// Returns the time at which the error is predicted to reach the requested target. The report predicts the
// remaining core seconds. For the curve over wall-clock time they are converted by the ratio of wall-clock
// time to core seconds so far.
std::optional<Ahead> ahead_of(const Json& report, const Json& last, const Clock& clock) {
  const Json& forecast = member(report, "forecast");
  const double more = number(forecast, "core_seconds"), now = number(last, clock.key);
  if (!flag(forecast, "asked", false) || !(more > 0) || !(now > 0)) return std::nullopt;
  const double pace = clock.id == std::string_view(kCores.id) ? 1 : now / number(last, "core_seconds");
  if (!std::isfinite(pace)) return std::nullopt;
  Ahead ahead{now + pace * more};
  if (const auto ci = interval(forecast, "core_seconds_ci95"); ci && !doubtful(report)) {
    ahead.x_lo = now + pace * ci->first;
    ahead.x_hi = now + pace * ci->second;
  }
  return ahead;
}

LogPlot plot_of(const Json& report, const std::vector<Json>& points, const Clock& clock) {
  LogPlot plot;
  plot.id = clock.id;
  plot.title = fmt::format("relMSE against {}", clock.name);
  plot.x_title = clock.axis;
  plot.y_title = "relMSE";
  const bool doubt = doubtful(report);
  Curve estimate{doubt ? "estimate, not to be trusted yet" : "estimate, with its 95 % interval", {}};
  Curve reference_error{phrase("againstReference"), {}, true};
  for (const Json& p : points) {
    const double x = number(p, clock.key);
    const auto ci = shown_interval(p, doubt).value_or(std::pair(0.0, 0.0));
    estimate.points.push_back({x, number(p, "relmse"), ci.first, ci.second});
    const double error = number(p, "true_relmse");
    if (error > 0 && !flag(p, "true_relmse_below_noise", false)) reference_error.points.push_back({x, error});
  }
  const bool has_reference_error = !reference_error.points.empty();
  plot.curves.push_back(std::move(estimate));
  if (has_reference_error) plot.curves.push_back(std::move(reference_error));
  const Json& last = points.back();
  const double target = number(report, "target_error");
  if (target > 0 && !denoised_target(report)) plot.target = target;
  plot.ahead = ahead_of(report, last, clock);
  plot.summary = fmt::format("{} points; the last: relMSE {} after {}", points.size(),
                             figure(number(last, "relmse")), duration(number(last, clock.key)));
  return plot;
}

std::string cell(const std::string& words) { return "<td>" + words + "</td>"; }

std::string table(const std::vector<Json>& points, bool doubt) {
  const bool reference_error =
      std::any_of(points.begin(), points.end(), [](const Json& p) { return number(p, "true_relmse") > 0; });
  const bool flip =
      std::any_of(points.begin(), points.end(), [](const Json& p) { return number(p, "true_flip") >= 0; });
  std::string rows;
  for (std::size_t i = points.size() - std::min(points.size(), kMostRows); i < points.size(); ++i) {
    const Json& p = points[i];
    rows += "<tr>" + cell(duration(number(p, "seconds"))) + cell(duration(number(p, "core_seconds"))) +
            cell(given(number(p, "spp"))) + cell(figure(number(p, "rmse"))) +
            cell(figure(number(p, "relmse")));
    if (!doubt) rows += cell(range(shown_interval(p, doubt), figure));
    if (reference_error)
      rows += cell(true_figure(number(p, "true_relmse"), flag(p, "true_relmse_below_noise", false)));
    if (flip) rows += cell(figure(number(p, "true_flip")));
    rows += "</tr>\n";
  }
  std::string head;
  const auto column = [&](const char* name) { head += fmt::format("<th scope=\"col\">{}</th>", name); };
  for (const char* name : {"Time", "Core time", "Samples", "RMSE", "relMSE"}) column(name);
  if (!doubt) column("95 % interval");
  if (reference_error) column("True relMSE");
  if (flip) column("FLIP");
  const std::string title = points.size() > kMostRows
                                ? fmt::format("The last {} of {} points as a table", kMostRows, points.size())
                                : "The points as a table";
  return fmt::format(
      "<details><summary>{}</summary><div class=\"wide\"><table><caption "
      "class=\"unseen\">Error at each "
      "checkpoint</caption><thead><tr>{}</tr></thead><tbody>\n{}</tbody></table></div></details>",
      title, head, rows);
}

std::string slope(const Json& report) {
  const double value = number(report, "slope");
  const bool doubt = doubtful(report);
  const std::string verdict = doubt ? escape_html(phrase("noIntervals")) + " " : verdict_words(report);
  if (!std::isfinite(value)) return verdict;
  const auto with_sign = [](double x) { return fmt::format("{}{:.2f}", x < 0 ? "−" : "", std::abs(x)); };
  std::string out = fmt::format("Slope <b>{}</b>", with_sign(value));
  const auto ci = interval(report, "slope_ci95");
  if (ci)
    out += fmt::format(" ({}{})",
                       doubt ? "" : fmt::format("{} to {}; ", with_sign(ci->first), with_sign(ci->second)),
                       phrase("independentSamples"));
  return out + ". " + verdict;
}

}  // namespace

std::string outlook(const Json& report) {
  const Json& forecast = member(report, "forecast");
  const double target = number(forecast, "target"), more = number(forecast, "core_seconds");
  if (!(target > 0) || !(more > 0)) return "";
  const bool asked = flag(forecast, "asked", false);
  const char* least = doubtful(report) ? "at least " : "";
  std::string out = fmt::format("relMSE {} {} {}{} more of core time", asked ? given(target) : figure(target),
                                asked ? "needs" : "would need", least, duration(more));
  if (const std::string ci = range(interval(forecast, "core_seconds_ci95"), duration);
      !ci.empty() && !doubtful(report))
    out += fmt::format(" ({})", ci);
  if (const double spp = number(forecast, "spp"); spp > 0)
    out += fmt::format(", to {}{} samples per pixel", least, count(spp));
  return out + ".";
}

std::string curves(const Json& report) {
  const std::vector<Json> points = objects(report, "convergence");
  if (points.empty()) return "";
  std::string body = "<div class=\"pair\">";
  for (const Clock& clock : {kWall, kCores})
    body += fmt::format("<figure><figcaption>Against {}</figcaption>{}</figure>", clock.name,
                        svg_of(plot_of(report, points, clock)));
  body +=
      "</div><p class=\"note\">" + slope(report) + outlook(report) + "</p>" + table(points, doubtful(report));
  return section("Error against time", body);
}

}  // namespace ls::report
