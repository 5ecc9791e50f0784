// Handlers of blobs and bundles: bodies that are stored while they arrive.
#include <fmt/format.h>

#include "coordinator/http/api/handlers.h"
#include "coordinator/http/bundle/bundle.h"
#include "coordinator/http/bundle/spool.h"
#include "coordinator/http/message/json_read.h"
#include "core/base/parse_number.h"
#include "core/base/spawn.h"

namespace ls::http {
namespace {

using coordinator::BlobStore;

// The Content-Range header of one request of an upload in parts: "bytes FIRST-LAST/SIZE" (RFC 9110,
// 14.4), or "bytes */SIZE" with an empty body if the client has sent all bytes already.
struct ContentRange {
  std::uint64_t first = 0;
  std::uint64_t bytes = 0;  // length of this part, LAST - FIRST + 1; 0: the header was "bytes */SIZE"
  std::uint64_t size = 0;   // SIZE: bytes of the whole upload
  bool possible = true;     // false: FIRST-LAST does not lie within SIZE bytes
  bool is_last() const { return first + bytes == size; }
};

// Numbers above this are rejected. It exceeds the size of any file, and sums of two such numbers do not
// overflow.
constexpr std::uint64_t kMost = std::uint64_t{1} << 62;

std::optional<std::uint64_t> number(std::string_view text) {
  const auto value = parse_number<std::uint64_t>(text);
  return value && *value <= kMost ? value : std::nullopt;
}

// Parses the value of a Content-Range header; nullopt: it has neither of the two forms of ContentRange.
std::optional<ContentRange> parse_content_range(std::string_view value) {
  constexpr std::string_view kUnit = "bytes ";
  if (!value.starts_with(kUnit)) return std::nullopt;
  value.remove_prefix(kUnit.size());
  const std::size_t slash = value.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto size = number(value.substr(slash + 1));
  const std::string_view range = value.substr(0, slash);
  if (!size) return std::nullopt;
  if (range == "*") return ContentRange{*size, 0, *size, *size > 0};
  const std::size_t dash = range.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto first = number(range.substr(0, dash)), last = number(range.substr(dash + 1));
  if (!first || !last) return std::nullopt;
  if (*last < *first || *last >= *size) return ContentRange{*first, 0, *size, false};
  return ContentRange{*first, *last - *first + 1, *size, true};
}

Response stored(const Digest& digest, int status) {
  return {.status = status, .headers = {{"Location", "/api/v1/blobs/" + digest.hex()}}};
}

std::optional<Response> over_limit(std::string_view what, std::uint64_t received, std::uint64_t limit) {
  if (received <= limit) return std::nullopt;
  return problem(413, fmt::format("the {} has more than the {} bytes that are accepted", what, limit));
}

class StoreSink final : public BodySink {
 public:
  StoreSink(std::unique_ptr<BlobStore::Upload> upload, const Digest& digest, std::uint64_t limit)
      : upload_(std::move(upload)), digest_(digest), limit_(limit) {}

  std::optional<Response> append(std::span<const std::byte> bytes) override {
    received_ += bytes.size();
    if (auto refused = over_limit("blob", received_, limit_)) return refused;
    if (const auto done = upload_->append(bytes); !done) return problem(done.error());
    return std::nullopt;
  }
  Response finish() override {
    if (const auto done = upload_->finish(); !done) return problem(done.error());
    return stored(digest_, 201);
  }

 private:
  std::unique_ptr<BlobStore::Upload> upload_;
  Digest digest_;
  std::uint64_t limit_, received_ = 0;
};

// Receives the body of a blob that is stored already and undamaged. It stores nothing, but rejects a body
// that differs from the blob.
class CompareSink final : public BodySink {
 public:
  CompareSink(const Digest& digest, std::uint64_t limit) : digest_(digest), limit_(limit) {}

  std::optional<Response> append(std::span<const std::byte> bytes) override {
    received_ += bytes.size();
    if (auto refused = over_limit("blob", received_, limit_)) return refused;
    sha_.update(bytes);
    return std::nullopt;
  }
  Response finish() override {
    const Digest got = sha_.finish();
    if (got != digest_)
      return problem(400,
                     fmt::format("the body's SHA-256 is {}, the address says {}", got.hex(), digest_.hex()));
    return stored(digest_, 204);
  }

 private:
  Sha256 sha_;
  Digest digest_;
  std::uint64_t limit_, received_ = 0;
};

void send_offset(Response& response, std::uint64_t offset, bool complete) {
  response.headers.emplace_back("Upload-Offset", std::to_string(offset));
  response.headers.emplace_back("Upload-Complete", complete ? "?1" : "?0");
}

// Makes the response that rejects a part. It contains the offset from which the client should continue.
Response refused_part(int status, std::string_view detail, std::uint64_t offset) {
  Response response = problem(status, detail);
  send_offset(response, offset, false);
  return response;
}

Response refused_part(const Error& error, const BlobStore& blobs, const Digest& digest) {
  return refused_part(status_of(error.code), error.message, blobs.received(digest));
}

// Receives and ignores a part of a blob that is stored completely already. The part is read to its end: a
// server that answers and closes while the client is still sending breaks the connection, and the client may
// lose the answer.
class IgnoreSink final : public BodySink {
 public:
  IgnoreSink(const Digest& digest, std::uint64_t bytes) : digest_(digest), left_(bytes) {}
  std::optional<Response> append(std::span<const std::byte> bytes) override {
    if (bytes.size() > left_) return problem(400, "the body is longer than its Content-Range says");
    left_ -= bytes.size();
    return std::nullopt;
  }
  Response finish() override { return stored(digest_, 204); }

 private:
  Digest digest_;
  std::uint64_t left_;
};

class PartSink final : public BodySink {
 public:
  PartSink(Api& api, std::string token, std::unique_ptr<BlobStore::Upload> upload, const Digest& digest,
           const ContentRange& range)
      : api_(api),
        blobs_(api.coordinator().blobs()),
        token_(std::move(token)),
        upload_(std::move(upload)),
        digest_(digest),
        range_(range) {}

  std::optional<Response> append(std::span<const std::byte> bytes) override {
    if (bytes.size() > range_.bytes - received_)
      return refused_part(400, "the body is longer than its Content-Range says", blobs_.received(digest_));
    if (const auto done = upload_->append(bytes); !done) return refused_part(done.error(), blobs_, digest_);
    received_ += bytes.size();
    return std::nullopt;
  }
  Response finish() override {
    if (received_ != range_.bytes)
      return refused_part(400, "the body is shorter than its Content-Range says; what came is kept",
                          blobs_.received(digest_));
    if (!range_.is_last()) {
      Response response{.status = 202};
      send_offset(response, range_.first + received_, false);
      return response;
    }
    const auto done = upload_->finish();
    if (blobs_.received(digest_) == 0) api_.partial_uploads().ended(token_, digest_);
    if (!done) return refused_part(done.error(), blobs_, digest_);
    return stored(digest_, 201);
  }

 private:
  Api& api_;
  BlobStore& blobs_;
  std::string token_;
  std::unique_ptr<BlobStore::Upload> upload_;
  Digest digest_;
  ContentRange range_;
  std::uint64_t received_ = 0;
};

std::variant<Response, std::unique_ptr<BodySink>> open_part(Api& api, const Request& request,
                                                            const Digest& digest) {
  auto& blobs = api.coordinator().blobs();
  const auto range = parse_content_range(request.header("content-range"));
  if (!range)
    return problem(
        400,
        "Content-Range must be 'bytes FIRST-LAST/SIZE', or 'bytes */SIZE' with an empty body when all "
        "was sent before");
  if (blobs.prove(digest)) return std::make_unique<IgnoreSink>(digest, range->bytes);
  const std::uint64_t there = blobs.received(digest);
  if (auto refused = over_limit("blob", range->size, api.limits().blob_bytes)) return *refused;
  if (!range->possible)
    return refused_part(416, "Content-Range names bytes that a blob of its size does not have", there);
  if (request.content_length && *request.content_length != range->bytes)
    return refused_part(
        400,
        fmt::format("Content-Range names {} bytes, the body has {}", range->bytes, *request.content_length),
        there);
  const std::string& token = request.caller.token_id;
  if (const auto dropped = api.partial_uploads().go_on(token, digest)) blobs.remove_unfinished(*dropped);
  auto upload = blobs.resume_upload(digest, range->first);
  if (!upload) return refused_part(upload.error(), blobs, digest);
  return std::make_unique<PartSink>(api, token, std::move(*upload), digest, *range);
}

// Receives POST /api/v1/jobs with a zip or tar: the body is spooled to disk, checked, stored file by file,
// and submitted.
class BundleSink final : public BodySink {
 public:
  BundleSink(Api& api, std::unique_ptr<const Descriptor> spool, ArchiveKind kind, const Request& request)
      : api_(api),
        spool_(std::move(spool)),
        kind_(kind),
        query_(request.query),
        caller_(request.caller),
        traceparent_(request.header("traceparent")) {}

  std::optional<Response> append(std::span<const std::byte> bytes) override {
    received_ += bytes.size();
    if (auto refused = over_limit("bundle", received_, api_.limits().bundle_bytes)) return refused;
    if (auto done = write_spool(spool_->fd, bytes); !done) return problem(done.error());
    return std::nullopt;
  }

  Response finish() override {
    return guarded("bundle", [this] { return submit(); });
  }

 private:
  Response submit() {
    const BundleLimits limits{api_.limits().blob_bytes, api_.limits().unpacked_bytes};
    const auto bundle =
        read_bundle(spool_->fd, received_, kind_, limits, api_.coordinator().blobs(), api_.stop_token());
    if (!bundle) return problem(bundle.error());
    coordinator::SubmitRequest job;
    auto spec = spec_from_query(query_, "name", bundle->spec);
    if (!spec) return problem(spec.error());
    job.spec = std::move(*spec);
    job.scene_name = bundle->scene;
    job.assets = bundle->assets;
    if (auto ok = load_scene(api_, bundle->scene_digest, caller_, job); !ok) return problem(ok.error());
    for (const auto& [key, value] : query_)
      if (key == "name") job.scene_name = value.substr(0, kMaxAssetName);
    job.owner = caller_.user;
    job.traceparent = traceparent_;
    return submit_job(api_, std::move(job), caller_);
  }

  Api& api_;
  const std::unique_ptr<const Descriptor> spool_;
  std::uint64_t received_ = 0;
  ArchiveKind kind_;
  Fields query_;
  Caller caller_;
  std::string traceparent_;
};

}  // namespace

std::variant<Response, std::unique_ptr<BodySink>> open_blob(Api& api, const Request& request,
                                                            const Params& params) {
  const auto digest = read_digest(std::string_view(params[0]), "the last part of the address");
  if (!digest) return problem(digest.error());
  if (!request.header("content-encoding").empty())
    return problem(415, "send the blob as it is: Content-Encoding is not decoded");
  if (!request.header("content-range").empty()) return open_part(api, request, *digest);
  auto& blobs = api.coordinator().blobs();
  if (blobs.prove(*digest)) {
    // A client that sent 'Expect: 100-continue' has not sent the body yet. It need not send it, because the
    // blob is stored already.
    if (!request.header("expect").empty()) return stored(*digest, 204);
    return std::make_unique<CompareSink>(*digest, api.limits().blob_bytes);
  }
  auto upload = blobs.begin_upload(*digest);
  if (!upload) return problem(upload.error());
  return std::make_unique<StoreSink>(std::move(*upload), *digest, api.limits().blob_bytes);
}

Response head_blob(Api& api, const Request&, const Params& params) {
  const auto digest = read_digest(std::string_view(params[0]), "the last part of the address");
  if (!digest) return problem(digest.error());
  auto& blobs = api.coordinator().blobs();
  Response response;
  std::uint64_t offset = 0;
  const auto found = blobs.find(*digest);
  if (!found) return problem(found.error());
  const bool complete = *found;
  if (complete) {
    const auto size = blobs.size(*digest);
    if (!size) return problem(size.error());
    offset = *size;
  } else {
    offset = blobs.received(*digest);
    response.status = 404;
  }
  send_offset(response, offset, complete);
  return response;
}

Response post_blobs_missing(Api& api, const Request& request, const Params&) {
  const auto body = read_object(request.body, {"digests"});
  if (!body) return problem(body.error());
  const auto list = body->find("digests");
  if (list == body->end() || !list->is_array())
    return problem(400, "the body must be {\"digests\": [SHA256, ...]}");
  if (list->size() > kMaxDigests)
    return problem(400, fmt::format("more than {} digests in one request", kMaxDigests));
  std::vector<Digest> digests;
  for (const auto& item : *list) {
    const auto digest = read_digest(item, fmt::format("digests[{}]", &item - &list->front()));
    if (!digest) return problem(digest.error());
    digests.push_back(*digest);
  }
  const auto lacking = api.coordinator().blobs().missing(digests);
  if (!lacking) return problem(lacking.error());  // the blob store cannot be asked now
  auto missing = nlohmann::ordered_json::array();
  for (const Digest& digest : *lacking) missing.push_back(digest.hex());
  return json_response(200, write_json({{"missing", std::move(missing)}}));
}

std::variant<Response, std::unique_ptr<BodySink>> open_bundle(Api& api, const Request& request) {
  if (!request.header("content-encoding").empty())
    return problem(415, "send the bundle as it is: Content-Encoding is not decoded");
  // The query is checked before the body is received, since the body may be gigabytes long.
  const auto spec = spec_from_query(request.query, "name");
  if (!spec) return problem(spec.error());
  if (auto refused = refuse_priority(api, request.caller, spec->priority)) return std::move(*refused);
  auto spool = open_spool(api.limits().spool);
  if (!spool) return problem(spool.error());
  const std::string type = media_type(request.header("content-type"));
  const bool zip = type.find("zip") != std::string::npos && type.find("gzip") == std::string::npos;
  return std::make_unique<BundleSink>(api, std::move(*spool), zip ? ArchiveKind::zip : ArchiveKind::tar,
                                      request);
}

}  // namespace ls::http
