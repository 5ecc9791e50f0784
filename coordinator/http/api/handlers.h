// The functions that answer requests, one per route of the table in routes.h. Each is called on the thread or
// thread pool that its route names (Route::executor), possibly by several threads concurrently.
#pragma once

#include "coordinator/http/api/api.h"
#include "coordinator/http/api/routes.h"
#include "core/job/settings.h"

namespace ls::http {

class BodySink;

// Defined in system_handlers.cpp (get_metrics(): in metrics.cpp)
Response get_healthz(Api&, const Request&, const Params&);
Response get_readyz(Api&, const Request&, const Params&);
Response get_metrics(Api&, const Request&, const Params&);
Response get_openapi(Api&, const Request&, const Params&);
Response get_session(Api&, const Request&, const Params&);
Response post_session(Api&, const Request&, const Params&);
Response delete_session(Api&, const Request&, const Params&);
Response get_tokens(Api&, const Request&, const Params&);
Response post_token(Api&, const Request&, const Params&);
Response delete_token(Api&, const Request&, const Params&);
Response get_workers(Api&, const Request&, const Params&);
Response patch_worker(Api&, const Request&, const Params&);
Response get_worker_log(Api&, const Request&, const Params&);
Response get_events(Api&, const Request&, const Params&);
Response get_job_events(Api&, const Request&, const JobId&);

// Defined in job_handlers.cpp
Response get_jobs(Api&, const Request&, const Params&);
Response post_again(Api&, const Request&, const JobId&);
Response post_job(Api&, const Request&, const Params&);
Response get_job(Api&, const Request&, const JobId&);
Response patch_job(Api&, const Request&, const JobId&);
Response delete_job(Api&, const Request&, const JobId&);

// Defined in announced_handlers.cpp
Response get_announced(Api&, const Request&, const Params&);
Response put_announced(Api&, const Request&, const Params&);
Response delete_announced(Api&, const Request&, const Params&);

// Defined in output_handlers.cpp
Response get_image_exr(Api&, const Request&, const JobId&);
Response get_deep_exr(Api&, const Request&, const JobId&);
Response get_mix(Api&, const Request&, const JobId&);
Response get_image_png(Api&, const Request&, const JobId&);
Response get_views(Api&, const Request&, const Params&);
Response get_view_cube(Api&, const Request&, const Params&);
Response get_thumbnail(Api&, const Request&, const JobId&);
Response get_error_png(Api&, const Request&, const JobId&);
Response get_samples_png(Api&, const Request&, const JobId&);
Response get_layers(Api&, const Request&, const JobId&);
Response get_pixels(Api&, const Request&, const JobId&);
Response post_video(Api&, const Request&, const JobId&);
Response get_video(Api&, const Request&, const JobId&);
Response get_video_mp4(Api&, const Request&, const JobId&);
Response get_meters(Api&, const Request&, const JobId&);
Response get_report(Api&, const Request&, const JobId&);
Response get_report_page(Api&, const Request&, const JobId&);
Response get_convergence(Api&, const Request&, const JobId&);
Response get_tiles(Api&, const Request&, const JobId&);
Response get_log(Api&, const Request&, const JobId&);

// Defined in upload_handlers.cpp. open_blob() is for PUT /blobs/SHA256, open_bundle() for POST /jobs with an
// archive
Response post_blobs_missing(Api&, const Request&, const Params&);
Response head_blob(Api&, const Request&, const Params&);
std::variant<Response, std::unique_ptr<BodySink>> open_blob(Api&, const Request&, const Params&);
std::variant<Response, std::unique_ptr<BodySink>> open_bundle(Api&, const Request&);

// The steps that all submissions share, whether the body was a scene, JSON or an archive (job_handlers.cpp).

// Sets the text of the request's scene, whose name, files and settings are set already, from the blob store.
// A file of more than scene::kMaxTextBytes bytes is an error. If it is a stage of USD, also sets files and
// warnings, to those of the scene that the Python package makes of it (coordinator/http/bundle/stage.h).
Result<void> load_scene(Api& api, const Digest& digest, const Caller& caller,
                        coordinator::SubmitRequest& job);

// Submits the job and answers: 201 {id, url, warnings}, or the error with the scene's diagnostics.
Response submit_job(Api& api, coordinator::SubmitRequest request, const Caller& caller);
// Makes the response 201 with the id and the address of an accepted job.
Response submitted(Api& api, const JobId& id);

// Returns a 403 if a caller with a submit token requests a priority above Limits::user_priority. Jobs of a
// higher priority are rendered before all jobs of lower ones, including those of other users. nullopt: the
// priority is allowed.
std::optional<Response> refuse_priority(const Api& api, const Caller& caller, int priority);

// Reads a job's spec from query parameters, as in POST /api/v1/jobs?spp=64&size=320x240&define=NAME=VALUE&
// aov=a,b with an application/xml body. The table in core/job/describe.h has the parameters; `define` may
// be repeated. The key named by `also` is ignored. Any other key, a repeated key, or a wrong value is an
// error that names the key. Keys that the query lacks keep their values in `base`, the JSON of a spec. The
// query's definitions are added to those of `base`; if both define a name, the query's value counts. (Defined
// in spec_query.cpp.)
Result<JobSpec> spec_from_query(const Fields& query, std::string_view also, const std::string& base = "{}");

}  // namespace ls::http
