// POST /api/v1/jobs with a zip or tar: the body is spooled to disk, checked, stored file by file, and
// submitted.
#include <fmt/format.h>

#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/api/spec_query.h"
#include "coordinator/http/api/submission.h"
#include "coordinator/http/bundle/bundle.h"
#include "coordinator/http/bundle/spool.h"
#include "coordinator/http/message/problem.h"

namespace ls::http {
namespace {

class BundleSink final : public BodySink {
 public:
  BundleSink(Api& api, Spool spool, ArchiveKind kind, Fields query, Caller caller)
      : api_(api),
        spool_(std::move(spool)),
        kind_(kind),
        query_(std::move(query)),
        caller_(std::move(caller)) {}

  std::optional<Response> append(std::span<const std::byte> bytes) override {
    if (bytes.size() > api_.limits().bundle_bytes - spool_.size())
      return problem(413, fmt::format("the bundle has more than the {} bytes that are accepted",
                                      api_.limits().bundle_bytes));
    if (const auto done = spool_.append(bytes); !done) return problem(done.error());
    return std::nullopt;
  }

  Response finish() override {
    return guarded("bundle", [this] { return submit(); });
  }

 private:
  Response submit() {
    const BundleLimits limits{api_.limits().blob_bytes, api_.limits().unpacked_bytes};
    const auto bundle =
        read_bundle(spool_.fd(), spool_.size(), kind_, limits, api_.coordinator().blobs(), api_.stop_token());
    if (!bundle) return problem(bundle.error());
    coordinator::SubmitRequest job;
    auto spec = spec_from_query(query_, "", bundle->spec);
    if (!spec) return problem(spec.error());
    job.spec = std::move(*spec);
    auto text = read_scene_blob(api_, bundle->scene_digest);
    if (!text) return problem(text.error());
    job.scene_text = std::move(*text);
    job.scene_name = bundle->scene;
    job.assets = bundle->assets;
    job.owner = caller_.user;
    return submit_job(api_, std::move(job), caller_);
  }

  Api& api_;
  Spool spool_;
  ArchiveKind kind_;
  Fields query_;
  Caller caller_;
};

}  // namespace

std::variant<Response, std::unique_ptr<BodySink>> open_bundle(Api& api, const Request& request) {
  if (!request.header("content-encoding").empty())
    return problem(415, "send the bundle as it is: Content-Encoding is not decoded");
  // Report errors in the query before gigabytes have arrived.
  const auto spec = spec_from_query(request.query, "");
  if (!spec) return problem(spec.error());
  if (auto refused = refuse_priority(api, request.caller, spec->priority)) return std::move(*refused);
  auto spool = Spool::open(api.limits().spool);
  if (!spool) return problem(spool.error());
  const bool zip = media_type(request.header("content-type")).find("zip") != std::string::npos &&
                   media_type(request.header("content-type")).find("gzip") == std::string::npos;
  return std::make_unique<BundleSink>(api, std::move(*spool), zip ? ArchiveKind::zip : ArchiveKind::tar,
                                      request.query, request.caller);
}

}  // namespace ls::http
