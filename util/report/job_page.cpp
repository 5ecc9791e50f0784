#include "util/report/job_page.h"

#include <fmt/format.h>

#include <iterator>

#include "core/image/exr/final_image.h"
#include "util/report/html.h"
#include "util/report/job_sections.h"
#include "util/report/log_plot.h"
#include "util/report/number_text.h"
#include "util/report/phrases.h"

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

// Draws the colour scale of a map with its smallest and largest value as labels. The scale is logarithmic.
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
    out += fmt::format(
        "<figure><div class=\"image\">{}</div><figcaption>{}</figcaption></figure>\n",
        picture(page.image, escape_html(name_of(report)) + (page.denoised ? ", denoised" : ", the image")),
        page.denoised ? "Denoised; the maps are of the image as it was rendered." : "As it was rendered.");
  const bool flagged = number(report, "few_hits_pixels") > 0;
  const std::string maps =
      map(page.error_map, "error",
          flagged
              ? "of each pixel: its relative standard error; magenta: too few samples found light to know it"
              : "of each pixel: its relative standard error",
          legend(given(100 * kMapLeastError) + " %", given(100 * kMapMostError) + " % or more")) +
      map(page.samples_map, "samples", "of each pixel",
          legend(count(kMapLeastSamples), count(kMapMostSamples) + " or more"));
  return out + (maps.empty() ? "" : "<div class=\"pair\">" + maps + "</div>");
}

}  // namespace

Result<std::string> job_page(const JobPage& page) {
  const Json report = Json::parse(page.report, nullptr, false);
  if (!report.is_object()) return bad_argument("the report is no JSON object, so no page can be made of it");
  const std::string values = meters(report);
  const std::string body = "<main>\n" + header(report) + failure(report) +
                           (values.empty() ? pictures(page, report) : values) + figures(report) +
                           verdict(report) + curves(report) + time_split(report) + health(report) +
                           techniques(report) + features(report) + provenance(report) + "</main>";
  return document(name_of(report) + " · Lightshaft report", css(), body);
}

std::string job_page_policy() { return document_policy(css()); }

const Json& member(const Json& j, const char* key) {
  static const Json kNone;
  if (!j.is_object()) return kNone;
  const auto found = j.find(key);
  return found == j.end() ? kNone : *found;
}

double number(const Json& j, const char* key) {
  const Json& value = member(j, key);
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::string text(const Json& j, const char* key) {
  const Json& value = member(j, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}

bool flag(const Json& j, const char* key, bool otherwise) {
  const Json& value = member(j, key);
  return value.is_boolean() ? value.get<bool>() : otherwise;
}

std::optional<std::pair<double, double>> interval(const Json& j, const char* key) {
  const Json& value = member(j, key);
  if (!value.is_array() || value.size() != 2 || !value[0].is_number() || !value[1].is_number())
    return std::nullopt;
  return std::pair(value[0].get<double>(), value[1].get<double>());
}

std::vector<Json> objects(const Json& j, const char* key) {
  std::vector<Json> all;
  if (const Json& list = member(j, key); list.is_array())
    for (const Json& one : list)
      if (one.is_object()) all.push_back(one);
  return all;
}

std::vector<std::string> texts(const Json& j, const char* key) {
  std::vector<std::string> all;
  if (const Json& list = member(j, key); list.is_array())
    for (const Json& one : list)
      if (one.is_string()) all.push_back(one.get<std::string>());
  return all;
}

std::string_view page_css() {
  return R"(
:root{--paper:#fffdf9;--card:#fff;--ink:#2b2a27;--soft:#6a675f;--edge:#e5dfd2;--light:#a55c14;--good:#2c7a4b;--warn:#93560a;--veil:#fdf3e2;--bad:#a8321f;
--t0:#8a7a12;--t1:#8e4fa8;--t2:#c0701c;--t3:#2a6fb0;--t4:#2c7a4b;--t5:#c9c3b6;--beam:#e9a94f}
@media (prefers-color-scheme:dark){:root{--paper:#0f1116;--card:#14171d;--ink:#ece9e2;--soft:#a3a8b3;--edge:#2a303b;--light:#ffe3b3;--good:#93d2a6;--warn:#f2b45c;--veil:#1f1b14;--bad:#ff9482;
--t0:#d6e36b;--t1:#c9a7ff;--t2:#f4c27a;--t3:#7cc4ff;--t4:#8fdca0;--t5:#4a5161;--beam:#f4c27a}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:400 16px/1.55 Inter,"Segoe UI","Helvetica Neue",Cantarell,"Noto Sans",system-ui,"DejaVu Sans",sans-serif}
main{max-width:1080px;margin:0 auto;padding:clamp(1rem,4vw,3rem) clamp(1rem,4vw,2.5rem) 4rem}
h1{margin:.2rem 0 0;font-size:clamp(1.6rem,4.5vw,2.4rem);font-weight:400;letter-spacing:-.02em;line-height:1.15;overflow-wrap:anywhere}
h2{margin:0 0 1rem;font-size:1.15rem;font-weight:500;letter-spacing:-.01em}
h3{margin:0 0 .5rem;font-size:.85rem;font-weight:600;color:var(--soft)}
p,dl,dd,figure,ul{margin:0;padding:0}
header{margin-bottom:1.75rem}
.brand{display:flex;align-items:center;gap:.5rem;color:var(--soft);font-size:.85rem}
.brand svg{width:1.5rem;height:1.5rem}.beam{fill:var(--beam);opacity:.35}.window{fill:var(--beam)}
.sub,.note,.why,small,figcaption{color:var(--soft)}.sub{margin-top:.35rem}
section{margin-top:2.75rem;padding-top:1.5rem;border-top:1px solid var(--edge)}
.image{background:#050608;border-radius:10px;overflow:hidden;text-align:center;line-height:0}
.image img{width:100%;max-height:80vh;object-fit:contain}
.map img{width:100%;border-radius:8px;background:#050608}
.legend{display:flex;align-items:center;gap:.7rem;margin-top:.3rem;font-variant-numeric:tabular-nums}.ramp{flex:1;height:.6rem;border-radius:3px}
.map figcaption b{color:var(--ink);font-weight:500;text-transform:capitalize}
figcaption{font-size:.85rem;margin:.35rem 0}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1.25rem 2rem;margin-top:1.25rem}
section .pair{margin-top:0}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(9.5rem,1fr));gap:1.25rem 1.5rem;margin-top:2rem}
.figures dt{color:var(--soft);font-size:.8rem}
.figures b{display:block;font-weight:500;font-variant-numeric:tabular-nums;white-space:nowrap}
.figures .key b{font-size:1.75rem;font-weight:400;letter-spacing:-.02em;line-height:1.3;color:var(--light)}
.figures small{display:block;font-size:.8rem}
.lesser{margin-top:1.5rem;padding-top:1.25rem;border-top:1px solid var(--edge)}
.verdict{margin-top:1.5rem;padding:.8rem 1.1rem;border:1px solid var(--warn);border-radius:8px;background:var(--veil);color:var(--warn)}
.failure{margin:1.5rem 0;padding:.8rem 1.1rem;border:1px solid var(--bad);border-radius:8px}.failure b{color:var(--bad);font-weight:500}
caption{caption-side:bottom;text-align:left;color:var(--soft);padding-top:.5rem}
.note{margin-top:.9rem;font-size:.92rem}.note b{color:var(--ink);font-weight:500}
.good{color:var(--good)}.bad h2{color:var(--bad)}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{padding:.3rem 1.4rem .3rem 0;text-align:left;white-space:nowrap;font-weight:400}
thead th{color:var(--soft);font-size:.8rem}tbody tr{border-top:1px solid var(--edge)}
.wide{overflow-x:auto}details{margin-top:1rem}summary{cursor:pointer;color:var(--light)}
summary:focus-visible{outline:2px solid var(--light);outline-offset:3px;border-radius:3px}
.bar{display:block;width:100%;height:26px;border-radius:6px;margin-bottom:1rem}
.swatch{width:.75rem;height:.75rem;margin-right:.55rem}
.t0{fill:var(--t0)}.t1{fill:var(--t1)}.t2{fill:var(--t2)}.t3{fill:var(--t3)}.t4{fill:var(--t4)}.t5{fill:var(--t5)}
.split .why{white-space:normal}
ul{list-style:none}.complaints li{padding:.5rem 0;overflow-wrap:anywhere}
.features{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1.5rem 2rem}
.parts{font-size:.92rem}.parts li{padding:.15rem 0}.parts .why{font-size:.85rem}.parts .why::before{content:"· "}.out li{color:var(--soft)}.spaced{margin-bottom:1.5rem}
.rows div{display:grid;grid-template-columns:10rem 1fr;gap:.2rem 1rem;padding:.35rem 0;border-top:1px solid var(--edge);font-size:.92rem}
.rows div:first-child{border:0}.rows dt{color:var(--soft)}
code,pre{font-family:"JetBrains Mono","SF Mono","Noto Sans Mono",ui-monospace,"DejaVu Sans Mono",monospace;font-size:.85em;overflow-wrap:anywhere}
pre{white-space:pre-wrap;margin:.5rem 0 0}
.unseen{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
@media (max-width:36rem){.rows div{grid-template-columns:1fr}.split .why{display:none}.figures{grid-template-columns:1fr 1fr}.figures .key b{font-size:1.4rem}}
@media print{body{font-size:12px}section{break-inside:avoid}.image img{max-height:14cm}}
)";
}

}  // namespace ls::report
