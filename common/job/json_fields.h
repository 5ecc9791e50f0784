// Taking fields out of a JSON object strictly: every key must be known, every value of its type and range,
// and the first thing wrong is told with the key's name. For the .cpp files of this folder.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/error.h"
#include "common/image/frame.h"

namespace ls::job {

using Json = nlohmann::json;

// For messages: cut to `most` bytes, and ASCII, so that it can stand in a log line or a JSON string whatever
// was sent.
std::string printable(std::string_view text, std::size_t most);

// Refuses what is no object, keys given twice, over-long and deeply nested texts. `what`: "spec", for the
// messages.
Result<Json> parse_object(std::string_view text, std::string_view what);

class Fields {
 public:
  Fields(const Json& object, std::string_view what, std::vector<std::string> known);

  const std::optional<Error>& error() const { return error_; }  // the first one

  // Nothing if the key is absent or wrong.
  std::optional<std::uint64_t> whole(const char* key, std::uint64_t least, std::uint64_t most);
  std::optional<std::int64_t> integer(const char* key, std::int64_t least, std::int64_t most);
  std::optional<double> positive(const char* key, double most);
  std::optional<bool> boolean(const char* key);
  std::optional<std::string> name(const char* key);
  std::optional<std::vector<std::string>> names(const char* key);
  std::optional<FrameSize> size(const char* key);  // [w, h] or "WxH"
  const Json* find(const char* key) const;         // null: absent
  void wrong(std::string_view key, std::string_view problem);
  void require(const char* key);

 private:
  const Json& object_;
  std::string what_;
  std::optional<Error> error_;
};

}  // namespace ls::job
