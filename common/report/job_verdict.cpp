#include <fmt/format.h>

#include "common/report/html.h"
#include "common/report/job_sections.h"
#include "common/report/number_text.h"
#include "common/report/phrases.h"

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
  } else if (objects(report, "convergence").empty()) {  // otherwise the words are below the curves
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

}  // namespace ls::report
