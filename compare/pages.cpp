// Writes the results of a comparison of integrators (races on one or more scenes) as CSV tables, as Markdown
// and as an HTML page.
#include <fmt/format.h>

#include <cmath>

#include "common/report/html.h"
#include "common/report/log_plot.h"
#include "compare/results.h"

namespace ls::race {
namespace {

using report::escape_html;

constexpr const char* kTitle = "Error against time";

constexpr std::string_view kCss = R"(
:root { color-scheme: light dark; --ink: #1c2024; --quiet: #5f6a74; --line: #d5dbe0; --paper: #fff; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6eaee; --quiet: #9aa6b1; --line: #39424a; --paper: #14181c; } }
body { margin: 0 auto; max-width: 72rem; padding: 1.5rem; font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
p { max-width: 60rem; } .quiet { color: var(--quiet); font-size: .9rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 28rem), 1fr)); gap: 1.5rem; }
.plots svg { width: 100%; height: auto; }
)";

// Returns the text for a cell or a line of Markdown: characters that are markup are escaped, and a line break
// becomes a space.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::string_view("\\`*_[]<>|#").find(c) != std::string_view::npos) out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

std::string row_of(const std::vector<std::string>& cells) {
  std::string out = "|";
  for (const std::string& cell : cells) out += " " + plain(cell) + " |";
  return out + "\n";
}

std::string markdown(const Table& table) {
  std::string out = row_of(table.head) + "|";
  for (std::size_t i = 0; i < table.head.size(); ++i) out += "---|";
  out += "\n";
  for (const auto& row : table.rows) out += row_of(row);
  return out;
}

std::string html_row(const std::vector<std::string>& cells, const char* tag) {
  std::string out = "<tr>";
  for (const std::string& cell : cells) out += fmt::format("<{0}>{1}</{0}>", tag, escape_html(cell));
  return out + "</tr>\n";
}

std::string html(const Table& table) {
  std::string out =
      "<div class=\"wide\"><table>\n<thead>" + html_row(table.head, "th") + "</thead>\n<tbody>\n";
  for (const auto& row : table.rows) out += html_row(row, "td");
  return out + "</tbody></table></div>\n";
}

std::string paragraph(const std::string& text, const char* kind = "") {
  return fmt::format("<p{}>{}</p>\n", kind, escape_html(text));
}

// Returns a text as a field of a CSV table, in quotes where RFC 4180 requires them.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::string field(double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : ""; }

// Returns an estimate as three fields of a CSV table: the value, and the lower and the upper end of its
// interval. All three are empty for nullopt.
std::string fields(const std::optional<Estimate>& e) {
  return e ? fmt::format("{},{},{}", field(e->value), field(e->lo), field(e->hi)) : ",,";
}

std::string entrant_field(const Race& race, std::size_t entrant) {
  return field(race.entrants[entrant].name);
}

double root(double square) { return square > 0 ? std::sqrt(square) : NAN; }

}  // namespace

std::string points_csv(const Results& results) {
  std::string out =
      "scene,entrant,seed,spp,wall_seconds,cpu_seconds,seconds,relmse,rmse,estimated_relmse,estimated_lo,"
      "estimated_hi,last\n";
  for (const Race& race : results.races)
    for (const JudgedLane& lane : race.lanes)
      for (const JudgedPoint& p : lane.points) {
        const std::string estimate =
            p.estimate ? fmt::format("{},{},{}", field(p.estimate->relmse), field(p.estimate->relmse_lo),
                                     field(p.estimate->relmse_hi))
                       : ",,";
        out += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", field(race.scene),
                           entrant_field(race, lane.entrant), results.first_seed + lane.seed, field(p.spp),
                           field(p.cost.wall), field(p.cost.cpu), field(p.seconds), field(p.relmse),
                           field(root(p.mse)), estimate, p.last ? 1 : 0);
      }
  return out;
}

std::string summary_csv(const Results& results) {
  std::string out =
      "scene,entrant,seeds,spp,seconds,relmse,relmse_lo,relmse_hi,efficiency,efficiency_lo,efficiency_hi,"
      "slope,slope_lo,slope_hi,ratio,ratio_lo,ratio_hi,spread\n";
  for (const Race& race : results.races)
    for (const Row& row : rows_of(race))
      out +=
          fmt::format("{},{},{},{},{},{},{},{},{},{}\n", field(race.scene), entrant_field(race, row.entrant),
                      row.seeds, field(row.spp), field(row.seconds), fields(row.relmse),
                      fields(row.efficiency), fields(row.slope), fields(row.ratio), field(row.spread));
  return out;
}

std::string forecasts_csv(const Results& results) {
  std::string out = "scene,entrant,seed,spp,spent,target,predicted,lo,hi,actual,within\n";
  for (const Race& race : results.races)
    for (const Prediction& p : predictions_of(race))
      out += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", field(race.scene),
                         entrant_field(race, p.entrant), results.first_seed + p.seed, field(p.spp),
                         field(p.spent), field(p.target), field(p.predicted), field(p.lo), field(p.hi),
                         field(p.actual.value_or(NAN)), p.within() ? 1 : 0);
  return out;
}

std::string markdown(const Results& results) {
  std::string out = fmt::format("# {}\n\n", kTitle);
  for (const std::string& text : paragraphs_before(results)) out += plain(text) + "\n\n";
  out += markdown(summary_table(results)) + "\n" + plain(wide_words()) + "\n";
  if (const Table table = forecast_table(results); !table.rows.empty())
    out +=
        fmt::format("\n## Predicted and actual\n\n{}\n\n{}", plain(forecast_words(results)), markdown(table));
  for (const Race& race : results.races) {
    out += fmt::format("\n## {0}\n\n![{0}: error against time]({1}.svg)\n\n", plain(race.scene),
                       file_name(race.scene));
    for (const std::string& text : remarks_on(race)) out += plain(text) + "\n\n";
  }
  out += "\nEvery point is in points.csv, the first table in summary.csv";
  if (!forecast_words(results).empty()) out += ", every prediction in forecasts.csv";
  return out + ". How it is done: `lightshaft compare --help` and the page about it.\n";
}

std::string html_page(const Results& results) {
  std::string body = fmt::format("<h1>{}</h1>\n", kTitle);
  for (const std::string& text : paragraphs_before(results)) body += paragraph(text);
  body += html(summary_table(results)) + paragraph(wide_words(), " class=\"quiet\"");
  if (const Table table = forecast_table(results); !table.rows.empty())
    body += "<h2>Predicted and actual</h2>\n" + paragraph(forecast_words(results)) + html(table);
  body += "<div class=\"plots\">\n";
  for (const Race& race : results.races) {
    body += fmt::format("<section><h2>{}</h2>\n{}\n", escape_html(race.scene), report::svg_of(plot_of(race)));
    for (const std::string& text : remarks_on(race)) body += paragraph(text, " class=\"quiet\"");
    body += "</section>\n";
  }
  body += "</div>\n";
  return report::document(kTitle, std::string(kCss) + std::string(report::plot_css()), body);
}

std::map<std::string, std::string> files_of(const Results& results) {
  std::map<std::string, std::string> files{{"points.csv", points_csv(results)},
                                           {"summary.csv", summary_csv(results)},
                                           {"forecasts.csv", forecasts_csv(results)},
                                           {"report.md", markdown(results)},
                                           {"index.html", html_page(results)}};
  for (const Race& race : results.races) files[file_name(race.scene) + ".svg"] = plot_svg(race);
  return files;
}

}  // namespace ls::race
