#include "cli/output/convergence_text.h"

#include <fmt/format.h>

#include "cli/output/console.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;

// Reads the verdict on a job's convergence from `object`: under `kind_key` its kind, such as "heavy_tail",
// under `words_key` its text, and the flag `trusted`. Older coordinators do not send the flag.
Verdict verdict(const json& object, const char* kind_key, const char* words_key) {
  const std::string kind = text_field(object, kind_key);
  const bool untrusted = object.value("trusted", json()) == json(false);
  Verdict out{untrusted || kind == "heavy_tail" || kind == "bias_floor",
              plain_text(text_field(object, words_key)), plain_text(text_field(object, "advice"))};
  if (out.doubtful && !out.words.starts_with(kDoubt))
    out.words = fmt::format("{}{}{}", kDoubt, out.words.empty() ? "" : ": ", out.words);
  return out;
}

// Returns the errors of the job's image against a reference image, each preceded by a comma and a space.
std::string reference_errors_text(const json& job) {
  const json* reference = object_field(job, "reference");
  if (!reference) return "";
  std::string out;
  const bool same_seed = flag_field(job, "reference_same_seed");
  if (const std::string relmse = reference_error_text(*reference, "relmse", "below_noise", same_seed);
      !relmse.empty())
    out += ", true relMSE " + relmse;
  if (const auto flip = number_field(*reference, "flip")) out += fmt::format(", FLIP {:.3g}", *flip);
  return out;
}

// Limits health_lines(), which has one or two lines for each cause of numeric problems: at most two lines for
// this many causes.
constexpr std::size_t kMostCauses = 64;

// Returns the causes of the job's numeric problems, such as invalid samples; an empty list if none are known.
const json& causes_of(const json& job) {
  static const json kNone = json::array();
  const json* health = object_field(job, "health");
  return health ? list_field(*health, "causes") : kNone;
}

// Returns, for example, "; first at pixel 3,4 sample 7"; empty for a cause without a location.
std::string place_of(const json& cause) {
  const json& first = list_field(cause, "first");
  if (first.empty() || !first[0].is_object()) return "";
  const json& spot = first[0];
  const auto pixel = pair_field(spot, "pixel");
  const auto sample = number_field(spot, "sample");
  if (!pixel || !sample) return "";
  const auto frame = number_field(cause, "frame");
  return fmt::format("; first {}at pixel {:.0f},{:.0f} sample {:.0f}",
                     frame ? fmt::format("in frame {:.0f} ", *frame) : "", pixel->first, pixel->second,
                     *sample);
}

}  // namespace

Verdict verdict_of(const json& job) {
  const json* found = object_field(job, "verdict");
  return found ? verdict(*found, "kind", "words") : Verdict{};
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
  // Doubt about the error makes the time doubtful only if the job ends at a target error. A job that ends
  // after a fixed number of samples takes the same time whatever its error.
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
  if (same_seed) return fmt::format("{:.{}g} ({})", *value, digits, report::phrase("oneSeed"));
  return flag_field(object, below) ? report::phrase("belowNoise") : fmt::format("{:.{}g}", *value, digits);
}

std::string error_text(const json& job) {
  const Verdict verdict = verdict_of(job);
  const auto relmse = number_field(job, "relmse");
  if (!relmse) return verdict.doubtful ? verdict.words : "";
  const std::string denoised = denoised_text(job);
  std::string out = denoised.empty() ? "" : fmt::format("denoised relMSE {}; as rendered ", denoised);
  out += fmt::format("relMSE {:.3g}", *relmse);
  if (const auto ci = pair_field(job, "relmse_ci95"); ci && !verdict.doubtful)
    out += fmt::format(" ({:.3g} to {:.3g})", ci->first, ci->second);
  out += reference_errors_text(job);
  return verdict.doubtful ? out + ": " + verdict.words : out;
}

std::string denoised_text(const json& of) {
  const json* denoised = object_field(of, "denoised");
  if (!denoised) return "";
  const auto relmse = number_field(*denoised, "relmse");
  if (!relmse) return "not denoised: " + plain_text(text_field(*denoised, "error"));
  if (const auto ci = pair_field(*denoised, "relmse_ci95"))
    return fmt::format("{:.3g} ({:.3g} to {:.3g})", *relmse, ci->first, ci->second);
  return fmt::format("{:.3g} (a few pixels carry its noise: no interval)", *relmse);
}

std::vector<std::string> health_lines(const json& job) {
  std::vector<std::string> lines;
  for (const json& cause : causes_of(job)) {
    if (!cause.is_object() || lines.size() >= 2 * kMostCauses) continue;
    lines.push_back(plain_text(text_field(cause, "text")) + place_of(cause));
    if (const std::string replay = text_field(cause, "replay"); !replay.empty())
      lines.push_back("  see it again: " + plain_text(replay));
  }
  return lines;
}

bool unclean(const json& job) { return !causes_of(job).empty(); }

void print_health(const json& job) {
  const auto lines = health_lines(job);
  if (lines.empty()) return;
  print_note("the numbers of this image are not clean:");
  for (const std::string& line : lines) print_note("  " + line);
}

}  // namespace ls::cli
