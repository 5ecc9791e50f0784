#include "cli/output/convergence_text.h"

#include <fmt/format.h>

#include "cli/output/console.h"
#include "cli/output/reply_fields.h"
#include "common/base/plain_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;

// Reads a verdict. `object` has the fields `trusted` and, under `kind_key`, the kind; older coordinators send
// only the kind.
Verdict verdict(const json& object, const char* kind_key, const char* words_key) {
  const std::string kind = text_field(object, kind_key);
  const bool untrusted = object.value("trusted", json()) == json(false);
  Verdict out{untrusted || kind == "heavy_tail" || kind == "bias_floor",
              plain_text(text_field(object, words_key))};
  if (out.doubtful && !out.words.starts_with(kDoubt))
    out.words = fmt::format("{}{}{}", kDoubt, out.words.empty() ? "" : ": ", out.words);
  return out;
}

// Returns the errors against a reference image, each preceded by a comma.
std::string reference_errors_text(const json& job) {
  const auto reference = job.find("reference");
  if (reference == job.end() || !reference->is_object()) return "";
  std::string out;
  const bool same_seed = flag_field(job, "reference_same_seed");
  if (const std::string relmse = reference_error_text(*reference, "relmse", "below_noise", same_seed);
      !relmse.empty())
    out += ", true relMSE " + relmse;
  if (const auto flip = number_field(*reference, "flip")) out += fmt::format(", FLIP {:.3g}", *flip);
  return out;
}

}  // namespace

Verdict verdict_of(const json& job) {
  const auto found = job.find("verdict");
  return found != job.end() && found->is_object() ? verdict(*found, "kind", "words") : Verdict{};
}

Verdict verdict_of_report(const json& report) { return verdict(report, "verdict_kind", "verdict"); }

std::string estimate_text(const json& job, const char* key, const char* interval) {
  const auto value = number_field(job, key);
  if (!value) return "-";
  const std::string text = fmt::format("{:.4g}", *value);
  if (verdict_of(job).doubtful) return fmt::format("{} ({})", text, kDoubt);
  const auto ci = pair_field(job, interval);
  return ci ? fmt::format("{} ({:.4g} to {:.4g})", text, ci->first, ci->second) : text;
}

std::string time_left_text(const json& job, const json& times, const char* key, const char* interval) {
  const auto value = number_field(times, key);
  if (!value) return "-";
  // A job that ends after a fixed number of samples takes the same time whatever the error.
  if (number_field(job, "target_error") && verdict_of(job).doubtful)
    return "at least " + show_seconds(*value);
  const auto ci = interval ? pair_field(times, interval) : std::nullopt;
  return show_seconds(*value) +
         (ci ? fmt::format(" ({} to {})", show_seconds(ci->first), show_seconds(ci->second)) : std::string());
}

std::string reference_error_text(const json& object, const char* key, const char* below, bool same_seed,
                                 int digits) {
  const auto value = number_field(object, key);
  if (!value) return "";
  if (same_seed)
    return fmt::format("{:.{}g} (not to be trusted: the reference has this job's seed)", *value, digits);
  return flag_field(object, below) ? "below the reference's noise" : fmt::format("{:.{}g}", *value, digits);
}

std::string error_text(const json& job) {
  const Verdict verdict = verdict_of(job);
  const auto relmse = number_field(job, "relmse");
  if (!relmse) return verdict.doubtful ? verdict.words : "";
  std::string out = fmt::format("relMSE {:.3g}", *relmse);
  if (const auto ci = pair_field(job, "relmse_ci95"); ci && !verdict.doubtful)
    out += fmt::format(" ({:.3g} to {:.3g})", ci->first, ci->second);
  out += reference_errors_text(job);
  return verdict.doubtful ? out + ": " + verdict.words : out;
}

std::string denoised_text(const json& report) {
  const auto denoised = report.find("denoised");
  if (denoised == report.end() || !denoised->is_object()) return "";
  const auto relmse = number_field(*denoised, "relmse");
  if (!relmse) return "not denoised: " + text_field(*denoised, "error");
  if (const auto ci = pair_field(*denoised, "relmse_ci95"))
    return fmt::format("denoised {:.3g} ({:.3g} to {:.3g})", *relmse, ci->first, ci->second);
  return fmt::format("denoised {:.3g} (a few pixels carry its noise: no interval)", *relmse);
}

}  // namespace ls::cli
