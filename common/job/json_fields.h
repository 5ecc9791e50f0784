// Reads fields from a JSON object and accepts no others: every key must be known, and every value must have
// the right type and range. The first error is recorded with the key's name. Used by the .cpp files of this
// folder only.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame/frame.h"

namespace ls::job {

using Json = nlohmann::json;

// Returns `text` truncated to `most` bytes and made ASCII, so that it can be part of a log line or a JSON
// string.
std::string printable(std::string_view text, std::size_t most);

// Parses the text of a JSON object. Errors: other JSON values, duplicate keys, and texts that are too long or
// too deeply nested. `what` is the name of the text for messages, such as "spec".
Result<Json> parse_object(std::string_view text, std::string_view what);

class Fields {
 public:
  Fields(const Json& object, std::string_view what, std::vector<std::string> known);

  const std::optional<Error>& error() const { return error_; }  // the first error; nullopt: no error so far

  // Each of these returns nullopt if the key is absent or its value is wrong. A wrong value is recorded as an
  // error.
  std::optional<std::uint64_t> whole(const char* key, std::uint64_t least, std::uint64_t most);
  std::optional<std::int64_t> integer(const char* key, std::int64_t least, std::int64_t most);
  std::optional<double> positive(const char* key, double most);
  std::optional<bool> boolean(const char* key);
  std::optional<std::string> name(const char* key);
  std::optional<std::vector<std::string>> names(const char* key);
  std::optional<FrameSize> size(const char* key);  // parses [w, h] or "WxH"
  const Json* find(const char* key) const;         // returns null if the key is absent
  void wrong(std::string_view key, std::string_view problem);
  void require(const char* key);

 private:
  const Json& object_;
  std::string what_;
  std::optional<Error> error_;
};

}  // namespace ls::job
