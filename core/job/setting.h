// A setting of a job, as a row of a table. describe(visitor, spec) (describe.h) calls
// visitor.setting(Setting{...}, spec.member) for each setting. JSON, the query string, the options of the
// command line and their help, range checks, openapi.json and docs/reference/job-settings.md all visit this
// table.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ls::job {

// How a value was given.
enum class Form { json, query, option };

// The range of a number. A whole number is from `least` to `most`; any other number is above 0 and at most
// `most`. Of a text, the range of its length in bytes; a text without a range is a name (is_name in
// values.h).
struct Range {
  std::int64_t least = 0;
  std::uint64_t most = 0;
};

struct Setting {
  std::string_view name;       // the key in JSON and, unless `query` says otherwise, the query parameter
  std::string_view doc;        // what it does, in one sentence
  std::string_view more = {};  // further sentences, for openapi.json and the reference page
  std::string_view unit = {};
  Range range = {};                    // of a number or a text
  std::string_view query = {};         // name of the query parameter, if it is not `name`
  std::string_view option = {};        // option of the command line; empty: it is not given as an option
  std::string_view placeholder = "N";  // stands for the value of the option in the help
  std::string_view absent = {};        // the value of a new job for which an optional setting is not given
  std::string_view who = {};           // who may set it; empty: everyone who may submit or change the job
  std::string (*choices)() = nullptr;  // returns the values that are possible, as a list for the help
  // Commands that have the option: `submit` always, `render`, `again` and `merge` as these members say. A
  // request to submit a job again also accepts only the settings with `again`.
  bool render = false;
  bool again = false;
  bool merge = false;
  // Sentences that replace `doc` and `more` in a request to submit a job again; empty: these apply there, too
  std::string_view again_doc = {};
  bool pixels = false;  // the command that renders one sample again needs this setting
  // The key is in canonical JSON also if the setting has its default value. Digests and stored jobs depend on
  // that text, so a new setting leaves this false.
  bool always = false;

  std::string_view query_name() const { return query.empty() ? name : query; }
};

}  // namespace ls::job
