#include "core/job/spec_draft.h"

#include <nlohmann/json.hpp>
#include <type_traits>

#include "core/base/text/utf8.h"
#include "core/job/describe.h"
#include "core/scene/schema/describe_fields.h"

namespace ls::job {
namespace {

constexpr std::string_view kWhat = "spec";

// Returns an error about the setting of this name.
tl::unexpected<Error> wrong(std::string_view name, Form form, std::string_view problem) {
  std::string message;
  const JobSpec any;
  for_each_setting(any, [&](const Setting& s, const auto&) {
    // A spec that comes from a query may also come from JSON, so both are called alike.
    if (s.name == name) message = called(s, form == Form::option ? form : Form::json, kWhat);
  });
  return bad_argument(fmt::format("{} {}", message, problem));
}

}  // namespace

std::string integrator_names() { return std::string(scene::kInfo<IntegratorSettings>.plugins); }

Result<bool> SpecDraft::add(std::string_view key, std::string_view text) {
  bool known = false;
  Result<void> done;
  for_each_setting(spec_, [&]<class T>(const Setting& s, T& value) {
    if (key != (form_ == Form::query ? s.query_name() : s.name)) return;
    known = true;
    const bool first = given_.insert(s.name).second;
    if (find_invalid_utf8(text) != text.npos) {
      done = good_or("is not UTF-8", s, form_, kWhat);
      return;
    }
    done = good_or(first || std::is_same_v<T, Defines> ? read(s, form_, text, value) : "is given twice", s,
                   form_, kWhat);
  });
  if (!done) return tl::unexpected(done.error());
  return known;
}

Result<void> SpecDraft::add(const Json& object, Chosen chosen) {
  Result<void> done = check_keys<JobSpec>(object, kWhat, chosen);
  for_each_setting(spec_, [&]<class T>(const Setting& s, T& value) {
    const auto found = object.find(s.name);
    if (!done || found == object.end()) return;
    if (given_.insert(s.name).second || std::is_same_v<T, Defines>)
      done = good_or(read(s, *found, value), s, Form::json, kWhat);
  });
  return done;
}

Result<JobSpec> SpecDraft::finish() const {
  JobSpec spec = spec_;
  if (spec.target_layer == TargetLayer::denoised) {
    if (given("denoise") && !spec.denoise)
      return wrong("denoise", form_,
                   "is false, but target_layer is \"denoised\": leave it out, or set it to true");
    spec.denoise = true;
  }
  // An archive and the query are within the limits each; here both are added up.
  if (spec.defines.size() > kMaxDefines)
    return wrong("defines", form_, fmt::format("has more than {} entries", kMaxDefines));
  if (canonical_json(spec).size() > kMaxSpecBytes)
    return bad_argument(fmt::format("{}: has more than {} bytes", kWhat, kMaxSpecBytes));
  if (spec.frames && spec.defines.contains("frame"))
    return wrong("defines", form_, "gives $frame, which in a job with frames is the number of the frame");
  if (spec.reference && spec.frames && spec.frames->count() > 1)
    return wrong("reference", form_, "is one image, and the job has several frames: submit them one by one");
  return spec;
}

Result<void> check_spec(const JobSpec& spec, Form form) {
  if (auto ok = check_ranges(spec, kWhat); !ok) return ok;
  if (spec.target_layer == TargetLayer::denoised && !spec.target_error)
    return wrong("target_layer", form,
                 "says which error the target error means, and there is no target error: give that, too");
  if (is_lossy(spec.exr_compression) && spec.exr_parts != ExrParts::layers)
    return wrong("exr_compression", form,
                 fmt::format("is {}, which in one part would also change standard errors, positions and "
                             "identifiers: give exr_parts \"layers\", too, or choose a lossless one (zip)",
                             to_string(spec.exr_compression)));
  if (spec.deep_alpha && !(spec.deep > 0))
    return wrong("deep_alpha", form, "says how the deep image is, and there is none: give deep, too");
  if (const auto aovs = parse_aovs(spec.aov); !aovs)
    return wrong("aov", form, "is not possible: " + aovs.error().message);
  return {};
}

}  // namespace ls::job
