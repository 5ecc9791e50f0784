#include <fmt/format.h>

#include <cmath>

#include "core/image/exr/final_image.h"
#include "util/report/html.h"
#include "util/report/job_sections.h"
#include "util/report/number_text.h"
#include "util/report/phrases.h"

namespace ls::report {

namespace {

std::string paragraph(const char* css_class, const std::string& markup) {
  return markup.empty() ? "" : fmt::format("<p class=\"{}\">{}</p>", css_class, markup);
}

std::string unreached(const Json& report) {
  const double missing = number(report, "pixels_without_samples");
  if (!(missing > 0)) return "";
  const auto size = interval(report, "size");
  return fmt::format("No sample has reached {}{} pixels yet: the error figures are of the others.",
                     count(missing), size ? " of " + count(size->first * size->second) : std::string());
}

std::string one_seed(const Json& report) {
  return flag(member(report, "reference"), "same_seed", false) ? escape_html(phrase("sameSeed")) : "";
}

}  // namespace

bool doubtful(const Json& report) {
  const std::string kind = text(report, "verdict_kind");
  return !flag(report, "trusted", true) || kind == "heavy_tail" || kind == "bias_floor";
}

bool denoised_target(const Json& report) { return text(report, "target_layer") == "denoised"; }

std::string verdict_words(const Json& report) {
  if (doubtful(report)) return "";
  std::string words = text(report, "verdict");
  if (words.empty()) words = text(report, "trend");
  if (words.empty()) return "";
  if (words[0] >= 'a' && words[0] <= 'z') words[0] = static_cast<char>(words[0] - 'a' + 'A');
  return escape_html(words) + ". ";
}

std::string verdict(const Json& report) {
  std::string out;
  if (doubtful(report)) {
    const std::string words = text(report, "verdict");
    out += fmt::format("<p class=\"verdict\" role=\"note\">{}</p>",
                       escape_html(words.empty() ? phrase("estimateInDoubt") : words));
    if (const std::string advice = text(report, "advice"); !advice.empty())
      out += fmt::format("<p class=\"verdict\" role=\"note\"><b>What to do</b>: {}</p>", escape_html(advice));
    // Prints a sentence on the convergence. If the report has convergence curves, the sentence is below the
    // curves instead.
  } else if (objects(report, "convergence").empty()) {
    out += paragraph("note", verdict_words(report));
  }
  return out + paragraph("note", unreached(report)) + paragraph("note", one_seed(report)) +
         paragraph("note", escape_html(text(report, "note")));
}

std::string failure(const Json& report) {
  const std::string why = text(report, "error");
  if (why.empty()) return "";
  return fmt::format("<div class=\"failure\" role=\"note\"><b>{}</b><pre>{}</pre></div>\n",
                     text(report, "state") == "failed" ? phrase("failed") : phrase("unwell"),
                     escape_html(why));
}

namespace {

std::string place_of(const Json& cause) {
  const std::vector<Json> first = objects(cause, "first");
  if (first.empty()) return "";
  const auto pixel = interval(first[0], "pixel");
  if (!pixel) return "";
  const double frame = number(cause, "frame");
  return fmt::format("; first {}at pixel {:.0f},{:.0f}, sample {}",
                     std::isfinite(frame) ? fmt::format("in frame {:.0f} ", frame) : "", pixel->first,
                     pixel->second, count(number(first[0], "sample")));
}

std::string cause_item(const Json& cause) {
  std::string out = "<li>" + escape_html(text(cause, "text")) + place_of(cause) + ".";
  if (const std::string replay = text(cause, "replay"); !replay.empty())
    out += "<p>See it again: <code>" + escape_html(replay) + "</code></p>";
  return out + "</li>\n";
}

std::string feature_list(const Json& report, bool used) {
  std::string items;
  const auto add = [&](const std::string& part, const std::string& why) {
    items += fmt::format("<li>{}{}</li>\n", escape_html(part),
                         why.empty() ? "" : fmt::format(" <span class=\"why\">{}</span>", escape_html(why)));
  };
  const std::vector<Json> parts = objects(member(report, "analysis"), "parts");
  for (const Json& part : parts)
    if (flag(part, "used", false) == used) add(text(part, "part"), text(part, "why"));
  if (parts.empty())
    for (const std::string& name : texts(report, used ? "features_used" : "features_left_out")) add(name, "");
  if (items.empty()) return "";
  return fmt::format("<div><h3>{}</h3><ul class=\"parts{}\">\n{}</ul></div>", used ? "At work" : "Left out",
                     used ? "" : " out", items);
}

// Lists the parts of the scene that were removed before storing and sending it, because they affect no pixel.
std::string pruned(const Json& report) {
  std::string items;
  for (const Json& one : objects(member(report, "analysis"), "left_out")) {
    const double n = number(one, "count"), bytes = number(one, "bytes");
    items += fmt::format("<li>{}{}{} <span class=\"why\">{}</span></li>\n", escape_html(text(one, "what")),
                         n > 1 ? " × " + count(n) : "", bytes > 0 ? ", " + byte_size(bytes) : "",
                         escape_html(text(one, "why")));
  }
  if (items.empty()) return "";
  return "<h3>Neither stored nor sent</h3><ul class=\"parts spaced\">\n" + items + "</ul>";
}

std::string row(const char* name, const std::string& value, bool code = false) {
  if (value.empty() || value == kAbsent) return "";
  const char* tag = code ? "code" : "span";
  return fmt::format("<div><dt>{}</dt><dd><{}>{}</{}></dd></div>\n", name, tag, escape_html(value), tag);
}

std::string whole(double n) { return std::isfinite(n) ? fmt::format("{:.0f}", n) : std::string(); }

// Returns the target error as text. A note is added if the target applies to the denoised layers.
std::string target_of(const Json& report) {
  const double target = number(report, "target_error");
  if (!(target > 0)) return "";
  return given(target) + (denoised_target(report) ? " of the denoised layers" : "");
}

// Lists what the job requested: limits of the path length, and conditions that end the job.
std::string asked(const Json& report) {
  const double depth = number(report, "max_depth"), spp = number(report, "spp_asked");
  const std::string roulette = whole(number(report, "rr_depth"));
  return row("Maximum depth", depth == -1 ? "unlimited" : whole(depth)) +
         row("Russian roulette", roulette.empty() ? "" : "from depth " + roulette) +
         row("Samples asked", spp > 0 ? count(spp) + " per pixel" : "") +
         row("Target relMSE", target_of(report)) + row("Time asked", duration(number(report, "time_asked")));
}

}  // namespace

std::string section(std::string_view title, std::string_view body, std::string_view css_class) {
  return fmt::format("<section{}><h2>{}</h2>\n{}\n</section>\n",
                     css_class.empty() ? "" : fmt::format(" class=\"{}\"", css_class), title, body);
}

std::string health(const Json& report) {
  const Json& state = member(report, "health");
  if (!state.is_object()) return "";
  std::string items;
  for (const Json& cause : objects(state, "causes")) items += cause_item(cause);
  if (const double cut = number(report, "clamped_values"); cut > 0)
    items += fmt::format(
        "<li>{} values are above 65504, the largest of a half-precision image, and stand in it as "
        "that.</li>\n",
        count(cut));
  if (const double few = number(report, "few_hits_pixels"); few > 0)
    items += fmt::format(
        "<li>In {} pixels too few samples found light for their error to be known; the error map flags "
        "them.</li>\n",
        count(few));
  if (items.empty())
    return section(
        "Numeric health",
        "<p class=\"good\">Clean: no sample was rejected, no bound was broken, no input was mended.</p>");
  return section("Numeric health", "<ul class=\"complaints\">\n" + items + "</ul>", "bad");
}

std::string features(const Json& report) {
  const std::string used = feature_list(report, true), out = feature_list(report, false);
  if (used.empty() && out.empty() && pruned(report).empty()) return "";
  return section("What the scene needs, and what was left out",
                 pruned(report) + "<div class=\"features\">" + used + out + "</div>");
}

std::string techniques(const Json& report) {
  std::string rows;
  for (const Json& one : objects(report, "techniques")) {
    const Json& off = member(one, "off");
    rows += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td "
        "class=\"why\"><code>{}=&quot;{}&quot;</code></td></tr>\n",
        escape_html(text(one, "name")), escape_html(text(one, "what")), escape_html(text(off, "parameter")),
        escape_html(text(off, "value")));
  }
  if (rows.empty()) return "";
  return section("How it looked for light",
                 "<div class=\"wide\"><table><caption class=\"unseen\">Techniques</caption><thead><tr><th "
                 "scope=\"col\">Technique</th><th scope=\"col\">What it does</th><th scope=\"col\">Switched "
                 "off by</th></tr></thead><tbody>\n" +
                     rows + "</tbody></table></div>");
}

std::string provenance(const Json& report) {
  std::string rows =
      row("Job", text(report, "job"), true) + row("Submitted", date_time(number(report, "submitted_unix"))) +
      row("Scene", text(report, "scene"), true) +
      row("Pixels (SHA-256)", text(report, "pixels_sha256"), true) +
      row("Numeric class", text(report, "numeric_class"), true) + row("Build", text(report, "build")) +
      row("Fake", flag(report, "fake", false) ? kFakePixels : "") +
      row("Integrator", text(report, "integrator")) + row("Seed", whole(number(report, "seed"))) +
      asked(report) + row("Threads", threads_words(number(report, "threads"))) +
      row("Reference", text(member(report, "reference"), "digest"), true);
  std::string warnings;
  for (const std::string& warning : texts(report, "warnings")) warnings += escape_html(warning) + "\n";
  if (!warnings.empty())
    warnings =
        "<details open><summary>Warnings about the scene</summary><pre>" + warnings + "</pre></details>";
  if (rows.empty() && warnings.empty()) return "";
  return section("Provenance", (rows.empty() ? "" : "<dl class=\"rows\">\n" + rows + "</dl>") + warnings);
}

}  // namespace ls::report
