// Requests and answers of S3Link; used by s3_link.cpp and s3_parts.cpp only.
#pragma once

#include "coordinator/store/blobs/s3_link.h"

namespace ls::coordinator {

inline constexpr const char* kNoBytes = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

struct S3Link::Request {
  const char* method = "GET";
  std::string key;                  // of the object; empty: the request is about the bucket
  std::string query;                // sorted and escaped, as signed; every name with '='
  std::filesystem::path file = {};  // for PUT: the payload is `bytes` bytes of this file from `offset` on
  std::uint64_t offset = 0, bytes = 0;
  std::string body = {};           // for POST
  std::string payload = kNoBytes;  // SHA-256 of the payload
  long most_seconds = 0;           // limit for the whole request; 0: no limit while bytes arrive
  const Sink* sink = nullptr;
  const std::function<Result<void>()>* restart = nullptr;
};
struct S3Link::Answer {
  int status = 0;  // 0: no answer
  std::uint64_t length = 0;
  std::string etag;
  std::string text;  // the body, unless it was passed to a sink; if there is no answer, the reason
  std::optional<Error> refused;  // the sink's error, which ended the request
};

// Returns the text of the first XML element with this name at or after position *at, and sets *at to the end
// of that element. If there is none, returns an empty text and sets *at to npos. Understands just enough XML
// for the answers of S3.
std::string xml_element(std::string_view xml, std::string_view name, std::size_t* at = nullptr);

}  // namespace ls::coordinator
