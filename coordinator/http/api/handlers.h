// The functions that answer requests, one per route of the table in routes.h. Each is called on the thread
// pool that its route names (Route::executor), possibly by several threads concurrently.
#pragma once

#include "coordinator/http/api/routes.h"

namespace ls::http {

class BodySink;

// system_handlers.cpp
Response get_healthz(Api&, const Request&, const Params&);
Response get_readyz(Api&, const Request&, const Params&);
Response get_metrics(Api&, const Request&, const Params&);
Response get_openapi(Api&, const Request&, const Params&);
Response get_session(Api&, const Request&, const Params&);
Response post_session(Api&, const Request&, const Params&);
Response delete_session(Api&, const Request&, const Params&);
Response get_tokens(Api&, const Request&, const Params&);    // token_handlers.cpp
Response post_token(Api&, const Request&, const Params&);    // token_handlers.cpp
Response delete_token(Api&, const Request&, const Params&);  // token_handlers.cpp
Response get_workers(Api&, const Request&, const Params&);
Response get_events(Api&, const Request&, const Params&);
Response get_job_events(Api&, const Request&, const Params&);

// job_handlers.cpp
Response get_jobs(Api&, const Request&, const Params&);
Response post_job(Api&, const Request&, const Params&);
Response get_job(Api&, const Request&, const Params&);
Response patch_job(Api&, const Request&, const Params&);
Response delete_job(Api&, const Request&, const Params&);
Response get_image_exr(Api&, const Request&, const Params&);
Response get_image_png(Api&, const Request&, const Params&);
Response get_error_png(Api&, const Request&, const Params&);
Response get_samples_png(Api&, const Request&, const Params&);
Response get_report(Api&, const Request&, const Params&);
Response get_convergence(Api&, const Request&, const Params&);
Response get_tiles(Api&, const Request&, const Params&);
Response get_log(Api&, const Request&, const Params&);

// page_handlers.cpp
Response get_report_page(Api&, const Request&, const Params&);

// blob_handlers.cpp; PUT is streamed
Response post_blobs_missing(Api&, const Request&, const Params&);
Response head_blob(Api&, const Request&, const Params&);
std::variant<Response, std::unique_ptr<BodySink>> open_blob(Api&, const Request&, const Params&);

// bundle_handlers.cpp: POST /jobs with an archive
std::variant<Response, std::unique_ptr<BodySink>> open_bundle(Api&, const Request&);

}  // namespace ls::http
