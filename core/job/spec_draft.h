// Puts a JobSpec together from values that users give as query parameters, options or JSON.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "core/base/error.h"
#include "core/job/objects.h"
#include "core/job/settings.h"

namespace ls::job {

class SpecDraft {
 public:
  // `form` is the form of the texts for add(key, text).
  explicit SpecDraft(Form form) : form_(form) {}

  // Reads the text of a setting, which may be given once; only definitions may be given one by one. `key` is
  // the name of the query parameter or, for options, of the setting. Returns false if there is no such
  // setting.
  Result<bool> add(std::string_view key, std::string_view text);
  // Reads the settings in the JSON object, except those that have been given already.
  Result<void> add(const Json& object, Chosen chosen = nullptr);

  bool given(std::string_view name) const { return given_.contains(name); }
  // Checks what the settings require of each other, and returns the spec.
  Result<JobSpec> finish() const;

 private:
  Form form_;
  JobSpec spec_;
  std::set<std::string_view> given_;  // names of settings
};

// Checks a spec before the job is accepted: ranges, the names of AOVs, and that a target layer has a target.
Result<void> check_spec(const JobSpec& spec, Form form = Form::json);

}  // namespace ls::job
