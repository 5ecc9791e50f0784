// Reads and writes objects in a bucket of an S3-compatible store. It calls libcurl directly, which also signs
// the requests (AWS Signature Version 4). Addresses are in path style: ENDPOINT/BUCKET/PREFIX/KEY.
// Thread-safe: each request has its own connection.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/clock.h"
#include "core/base/digest.h"
#include "core/base/error.h"

namespace ls::coordinator {

// An address s3://BUCKET[/PREFIX][?endpoint=URL][&region=NAME][&part-mib=N][&copies-mib=N]. The keys come
// from the same environment variables as for other tools: AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and, for
// temporary keys, AWS_SESSION_TOKEN. If the address names no region, the region is that in AWS_REGION, else
// that in AWS_DEFAULT_REGION, else us-east-1. The default endpoint is Amazon's for the region.
struct S3Address {
  std::string bucket, prefix;  // `prefix` has no slash at its ends and may be empty
  std::string endpoint, region;
  // Files that are larger than this are sent in parts of this size; from 5 MiB to 5 GiB
  std::uint64_t part_bytes = std::uint64_t{64} << 20;
  std::uint64_t copies_bytes = 0;  // greatest size of all local copies together; 0: no limit
  std::string shown() const;       // returns the address as text, for messages and logs
};
Result<S3Address> parse_s3_url(std::string_view url);

struct S3Keys {
  std::string id, secret, session;
};
// Reads the keys from the variables above. Error unauthenticated: a variable (named in the message) is
// missing.
Result<S3Keys> s3_keys_from_environment();

struct S3Options {
  S3Address address;
  S3Keys keys;
  // A request is attempted at most this many times if each attempt fails for a transient reason: there is no
  // answer, or it has HTTP status 429 or 5xx.
  int attempts = 6;
  Duration first_pause = std::chrono::milliseconds(100), longest_pause = std::chrono::seconds(5);
};

class S3Link {
 public:
  explicit S3Link(S3Options options);

  // Sends one small request. Error: the store does not answer within a few seconds.
  Result<void> answers() const;
  struct Object {
    std::uint64_t bytes = 0;
    std::string etag;  // version of the object's bytes: it changes when they change
  };
  Result<Object> look_at(const std::string& key) const;  // error not_found: there is no such object
  using Sink = std::function<Result<void>(std::span<const std::byte>)>;
  // Reads the whole object and passes its bytes to `sink`, in order. If an attempt fails, the next one reads
  // the object from its start; `restart` is called before every attempt and must discard the bytes that
  // `sink` has received.
  Result<void> get(const std::string& key, const std::function<Result<void>()>& restart,
                   const Sink& sink) const;
  // Sends a file of `bytes` bytes in one request or, if the file is larger than S3Address::part_bytes, in
  // parts of that size. `digest` is the SHA-256 of the file. The store checks the digest of each request's
  // bytes. A part that fails is sent again without the others.
  Result<void> put(const std::string& key, const std::filesystem::path& file, std::uint64_t bytes,
                   const Digest& digest) const;
  Result<void> remove(const std::string& key) const { return remove(key, ""); }  // no error if it is missing
  Result<std::vector<std::string>> list() const;  // returns the keys of all objects under S3Address::prefix

  std::string shown() const { return options_.address.shown(); }

 private:
  struct Request;
  struct Answer;
  Result<void> put_parts(const std::string& key, const std::filesystem::path& file,
                         std::uint64_t bytes) const;
  Result<std::string> begin_parts(const std::string& key) const;  // returns the upload's id
  Result<void> send_parts(const std::string& key, const std::string& upload,
                          const std::filesystem::path& file, std::uint64_t bytes) const;
  Result<void> remove(const std::string& key, const std::string& query) const;
  Result<Answer> ask_once(const Request& request) const;
  Result<Answer> ask(const Request& request) const;  // repeats ask_once() after transient failures
  // Like ask(), but returns an error if the answer's HTTP status is not 200; for requests that change
  // something, every status 2xx is a success.
  Result<Answer> ask_for(const Request& request) const;
  Error error_of(const Request& request, const Answer& answer) const;
  std::string url_of(const Request& request) const;

  S3Options options_;
};

}  // namespace ls::coordinator
