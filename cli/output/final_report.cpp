#include "cli/output/final_report.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/output/console.h"
#include "cli/output/convergence_text.h"
#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

double number(const json& object, const char* key) { return number_field(object, key).value_or(0); }

// Describes the cost of reducing the error further, from the report's forecast.
std::string outlook(const json& report, bool doubtful) {
  const auto forecast = report.find("forecast");
  if (forecast == report.end() || !forecast->is_object()) return "";
  const double more = number(*forecast, "core_seconds");
  if (!(more > 0)) return "";
  std::string line = fmt::format("; {:.3g} would cost {}{} more on one core", number(*forecast, "target"),
                                 doubtful ? "at least " : "", show_seconds(more));
  if (const auto ci = pair_field(*forecast, "core_seconds_ci95"); ci && !doubtful)
    line += fmt::format(" ({} to {})", show_seconds(ci->first), show_seconds(ci->second));
  return line;
}

}  // namespace

Result<std::string> local_report(const std::string& report, const LocalFacts& facts) {
  json j = json::parse(report, nullptr, false);
  if (!j.is_object()) return fail(Errc::internal, "the coordinator's report cannot be read");
  // The report may be shared, so it should not contain the scene's local path.
  j["name"] = std::filesystem::path(text_field(j, "name")).filename().string();
  j["load_seconds"] = facts.load_seconds;
  j["peak_rss_bytes"] = facts.peak_rss_bytes;
  j["threads"] = facts.threads;
  if (facts.interrupted) j["stopped"] = "user";
  if (facts.instructions) {
    const double samples = number(j, "samples");
    j["instructions"] = {{"count", *facts.instructions}};
    if (samples > 0) j["instructions"]["per_sample"] = static_cast<double>(*facts.instructions) / samples;
  } else {
    j["instructions"] = {{"uncounted", facts.instructions.error().message}};
  }
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string report_summary(const std::string& report) {
  const json j = json::parse(report, nullptr, false);
  if (!j.is_object()) return "";
  std::string line =
      fmt::format("{:g} samples per pixel in {} ({} of loading)", number(j, "spp"),
                  show_seconds(number(j, "render_seconds")), show_seconds(number(j, "load_seconds")));
  if (const auto relmse = number_field(j, "relmse")) line += fmt::format(", relMSE {:.3g}", *relmse);
  const Verdict verdict = verdict_of_report(j);
  if (const auto ci = pair_field(j, "relmse_ci95"); ci && !verdict.doubtful)
    line += fmt::format(" ({:.3g} to {:.3g})", ci->first, ci->second);
  const auto reference = j.find("reference");
  const bool same_seed =
      reference != j.end() && reference->is_object() && flag_field(*reference, "same_seed");
  if (const std::string reference_error =
          reference_error_text(j, "true_relmse", "true_relmse_below_noise", same_seed);
      !reference_error.empty())
    line += ", true relMSE " + reference_error;
  if (const auto flip = number_field(j, "true_flip")) line += fmt::format(", FLIP {:.3g}", *flip);
  if (const std::string denoised = denoised_text(j); !denoised.empty()) line += ", " + denoised;
  if (const auto target = number_field(j, "target_error"))
    line += fmt::format(", target {:g}{}", *target,
                        text_field(j, "target_layer") == "denoised" ? " for the denoised layers" : "");
  const bool news = verdict.doubtful || text_field(j, "verdict_kind") != "early";
  if (news && !verdict.words.empty()) line += ": " + verdict.words;
  return line + outlook(j, verdict.doubtful);
}

void print_report_health(const std::string& report) {
  const json j = json::parse(report, nullptr, false);
  if (!j.is_object()) return;
  print_health(j);
  if (const auto cut = number(j, "clamped_values"); cut > 0)
    print_note(fmt::format(
        "{:.0f} values are above 65504, the largest of a half-precision image, and stand in it as that; "
        "--float keeps them",
        cut));
}

std::string pixels_digest(const std::string& report) {
  const json j = json::parse(report, nullptr, false);
  return j.is_object() ? text_field(j, "pixels_sha256") : "";
}

std::uint64_t peak_rss_bytes() {
  rusage own{}, children{};
  ::getrusage(RUSAGE_SELF, &own);
  ::getrusage(RUSAGE_CHILDREN, &children);
  return static_cast<std::uint64_t>(std::max(own.ru_maxrss, children.ru_maxrss)) << 10;
}

}  // namespace ls::cli
