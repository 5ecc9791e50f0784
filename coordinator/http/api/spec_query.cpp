#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "coordinator/http/api/handlers.h"
#include "core/job/describe.h"
#include "core/job/spec_draft.h"

namespace ls::http {
namespace {

// Returns the names of all query parameters, for a message.
std::string known_parameters(std::string_view also) {
  std::vector<std::string_view> names;
  if (!also.empty()) names.push_back(also);
  const JobSpec any;
  job::for_each_setting(any, [&](const job::Setting& s, const auto&) { names.push_back(s.query_name()); });
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

Result<JobSpec> spec_from_query(const Fields& query, std::string_view also, const std::string& base) {
  const auto object = parse_spec_object(base);
  if (!object) return tl::unexpected(object.error());
  // A wrong value in `base` is an error even if the query replaces this value.
  if (const auto alone = job_spec_of(*object); !alone) return alone;
  job::SpecDraft draft(job::Form::query);
  for (const auto& [key, text] : query) {
    if (!also.empty() && key == also) continue;
    const auto known = draft.add(key, text);
    if (!known) return tl::unexpected(known.error());
    if (!*known)
      return bad_argument(
          fmt::format("unknown query parameter '{}'; known: {}", key, known_parameters(also)));
  }
  if (auto ok = draft.add(*object); !ok) return tl::unexpected(ok.error());
  return draft.finish();
}

}  // namespace ls::http
