// What S3Link asks and hears. Of s3_link.cpp and s3_parts.cpp alone.
#pragma once

#include "coordinator/store/s3_link.h"

namespace ls::coordinator {

inline constexpr const char* kNoBytes = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

struct S3Link::Request {
  const char* method = "GET";
  std::string key;                  // empty: the bucket
  std::string query;                // sorted and escaped, as it is signed; each name with '='
  std::filesystem::path file = {};  // of a PUT: `bytes` of it from `offset` on
  std::uint64_t offset = 0, bytes = 0;
  std::string body = {};           // of a POST
  std::string payload = kNoBytes;  // digest of what is sent
  long most_seconds = 0;           // for all of it; 0: as long as bytes come
  const Sink* sink = nullptr;
  const std::function<Result<void>()>* restart = nullptr;
};
struct S3Link::Answer {
  int status = 0;  // 0: none came
  std::uint64_t length = 0;
  std::string etag;
  std::string text;              // what did not go to a sink; without an answer why
  std::optional<Error> refused;  // by the sink
};

// The text of the first element of this name, from *at on, which is set behind it (npos: there is none);
// enough of XML for what S3 answers.
std::string xml_element(std::string_view xml, std::string_view name, std::size_t* at = nullptr);
// As a value in a query.
std::string query_value(std::string_view text);

}  // namespace ls::coordinator
