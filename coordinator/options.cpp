#include "coordinator/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "coordinator/service/open_stores.h"
#include "util/command_line/command.h"
#include "util/command_line/parse.h"

namespace ls::coordinator {
namespace {

constexpr int kUsage = 2;

// Adds hidden options for the limits of the HTTP server on slow clients and on resources. They are meant for
// the config file and for tests.
void add_limits(CLI::App& app, http::Limits& limits) {
  const auto hidden = [&app](const char* name, auto& value, double least) {
    app.add_option(name, value)->check(CLI::Range(least, 1e15))->group("");
  };
  hidden("--http-header-seconds", limits.header_seconds, 0.01);
  hidden("--http-idle-seconds", limits.idle_seconds, 0.01);
  hidden("--http-body-grace-seconds", limits.body_grace_seconds, 0.01);
  hidden("--http-min-rate", limits.min_rate, 1);
  hidden("--http-heartbeat-seconds", limits.heartbeat_seconds, 0.01);
  hidden("--http-linger-seconds", limits.linger_seconds, 0);
  hidden("--http-stop-seconds", limits.stop_seconds, 0);
  hidden("--http-requests-per-second", limits.requests_per_second, 0);
  hidden("--http-wrong-tokens-per-minute", limits.wrong_tokens_per_minute, 0);
  hidden("--http-connections", limits.connections, 1);
  hidden("--http-connections-each", limits.connections_each, 1);
  hidden("--http-connections-of-address", limits.connections_of_address, 1);
  hidden("--http-event-streams", limits.event_streams, 1);
  hidden("--http-event-streams-each", limits.event_streams_each, 1);
  hidden("--http-event-queue", limits.event_queue, 1);
  hidden("--http-blob-bytes", limits.blob_bytes, 1);
  hidden("--http-bundle-bytes", limits.bundle_bytes, 1);
}

// Adds the options for scheduling (docs/design/scheduling.md): limits, per job and per user, on workers and
// on units assigned to workers at the same time (a unit is one tile in one round of samples), the highest
// priority that a user may set, the share of results that is audited (rendered again by another worker), and
// --allow-fake, with which fake workers may join (for tests).
void add_shares(CLI::App& app, Flags& flags) {
  const auto limit = [&app](const char* name, std::uint32_t& value, const char* text) {
    app.add_option(name, value, text)->check(CLI::Range(0, 1'000'000))->capture_default_str();
  };
  limit("--workers-per-job", flags.shares.workers_per_job,
        "largest number of workers on one job at once; 0: no limit");
  limit("--units-per-job", flags.shares.units_per_job,
        "largest number of units of one job that are leased at once; 0: no limit");
  limit("--workers-per-user", flags.shares.workers_per_user,
        "largest number of workers on all jobs of one user at once; 0: no limit");
  limit("--units-per-user", flags.shares.units_per_user,
        "largest number of units of all jobs of one user that are leased at once; 0: no limit");
  app.add_option("--film-memory", flags.film_memory,
                 "memory for the images of all unfinished jobs, e.g. 16G; one user may use half of it; jobs "
                 "that do not fit are refused; default: half of the machine's memory")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--user-priority", flags.limits.user_priority,
                 "highest priority of jobs that are submitted with a token of the role 'submit'")
      ->check(CLI::Range(-1'000'000, 1'000'000))
      ->capture_default_str();
  app.add_option("--audit-percent", flags.audit_percent,
                 "percentage of results that another worker renders again, to find workers with wrong pixels")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--ocio", flags.ocio,
                 "OpenColorIO configuration with the views in which images can be shown; default: the file "
                 "that the environment variable OCIO names, or built-in views of ACES")
      ->type_name("CONFIG.ocio");
  app.add_option("--usd-python", flags.usd_python,
                 "Python interpreter in which pip install 'lightshaft[usd]' was run; it reads stages of USD "
                 "that are submitted, in a sandbox; default: stages are refused")
      ->type_name("PYTHON");
  app.add_flag("--allow-fake", flags.allow_fake,
               "for tests: let workers join that were started with --fake and invent their pixels");
}

void add_tls(CLI::App& app, Flags& flags) {
  app.add_flag("--tls", flags.tls,
               "use TLS, and require a certificate of workers; the first start makes the files in DATA/tls: "
               "users need ca.pem (LIGHTSHAFT_CA), workers need ca.pem, worker.pem and worker.key");
  app.add_option("--tls-names", flags.tls_names,
                 "host names and addresses by which others reach this machine")
      ->delimiter(',');
  auto* ca = app.add_option(
      "--tls-ca", flags.tls_ca,
      "your own certificates instead: the authority that signs the workers' certificates (PEM)");
  auto* cert =
      app.add_option("--tls-cert", flags.tls_cert, "this machine's certificate with its chain (PEM)");
  auto* key =
      app.add_option("--tls-key", flags.tls_key, "the certificate's key (PEM), readable by its owner only");
  ca->needs(cert)->needs(key);
  cert->needs(ca);
  key->needs(ca);
}

void add_files(CLI::App& app, Flags& flags) {
  app.add_option("--keep-unused-hours", flags.keep_unused_hours,
                 "hours after which unneeded files and abandoned uploads are removed; default: 24, with "
                 "--blobs never")
      ->check(CLI::Range(1e-4, 87600.0));
  app.add_option("--blobs", flags.blobs,
                 "where files of scenes are stored: a folder, or s3://BUCKET/PREFIX?endpoint=URL with keys "
                 "in AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY; default: in --data");
  app.add_flag("--shared", flags.shared,
               "share the farm with other coordinators that have the same --store and --blobs: each owns "
               "whole jobs, and takes over those of a dead coordinator");
  app.add_option("--secrets", flags.secrets,
                 "folder of the tokens and the files of --tls; with --shared, give all coordinators the same "
                 "one, so that they accept each other's users and workers; default: --data");
  app.add_option("--public-http", flags.public_http,
                 "with --shared: http://HOST:PORT where clients reach this coordinator; default: --http");
  app.add_option("--public-grpc", flags.public_grpc,
                 "with --shared: HOST:PORT where workers reach this coordinator; default: --grpc");
}

// Checks the flags that --shared requires: other coordinators must be able to read this one's data in order
// to take over its jobs.
Result<void> check_shared(const Flags& flags) {
  if (!flags.shared) return {};
  if (flags.store == "sqlite" || flags.blobs.empty())
    return fail(Errc::invalid_argument,
                "--shared needs storage that all coordinators reach: --store redis://... and --blobs (a "
                "shared folder, or s3://...)");
  if (flags.keep_unused_hours)
    return fail(Errc::invalid_argument,
                "--shared and --keep-unused-hours cannot be combined: a coordinator does not know which "
                "files the jobs of the others need");
  if (flags.tls && flags.tls_ca.empty() && flags.secrets.empty())
    return fail(
        Errc::invalid_argument,
        "--shared with --tls: each coordinator would make its own authority, which the workers and users of "
        "the others do not trust. Give all of them the same --secrets FOLDER, or certificates of one "
        "authority (deploy/make-certificates.sh; --tls-ca, --tls-cert, --tls-key)");
  const bool anywhere = flags.http.starts_with("0.0.0.0:") || flags.http.starts_with("[::]:");
  if (anywhere && flags.public_http.empty())
    return fail(Errc::invalid_argument,
                "--shared with --http on all addresses: add --public-http http://HOST:PORT, where clients "
                "reach this coordinator");
  return {};
}

}  // namespace

std::variant<Flags, int> parse_flags(int argc, char** argv) {
  Flags flags;
  std::string log_format = "text";
  CLI::App app(
      "Divides jobs into units, sends them to workers, and combines the results into one exact image.",
      "lightshaft-coordinator");
  use_plain_help(app);
  app.set_version_flag("--version", "lightshaft-coordinator " LIGHTSHAFT_VERSION);
  app.add_option("--http", flags.http,
                 "ADDR:PORT of the HTTP interface and the dashboard; port 0: any free port")
      ->capture_default_str();
  app.add_option("--grpc", flags.grpc, "ADDR:PORT that workers connect to; port 0: any free port")
      ->capture_default_str();
  app.add_option("--data", flags.data, "folder for jobs, blobs, images and tokens")->capture_default_str();
  app.add_option("--store", flags.store,
                 "where jobs are stored: sqlite, or redis://[USER:PASSWORD@]HOST[:PORT][/DB]")
      ->capture_default_str();
  add_tls(app, flags);
  add_files(app, flags);
  add_shares(app, flags);
  app.add_option(
      "--webhook", flags.webhooks,
      "URL that receives every change of a job's state (docs/guide/operations.md); may be repeated");
  app.add_option("--log-format", log_format, "text, or json with one object per line")
      ->check(CLI::IsMember({"text", "json"}));
  app.set_config("--config", "", "file with these options, one 'name = value' per line");
  app.allow_config_extras(false);
  for (const auto& [option, value] : {std::pair("--http", "ADDRESS"),
                                      {"--grpc", "ADDRESS"},
                                      {"--data", "DIR"},
                                      {"--store", "STORE"},
                                      {"--tls-names", "NAME,..."},
                                      {"--tls-ca", "FILE"},
                                      {"--tls-cert", "FILE"},
                                      {"--tls-key", "FILE"},
                                      {"--blobs", "PLACE"},
                                      {"--secrets", "DIR"},
                                      {"--public-http", "ADDRESS"},
                                      {"--public-grpc", "ADDRESS"},
                                      {"--webhook", "URL"},
                                      {"--config", "FILE"}})
    app.get_option(option)->type_name(value);
  add_limits(app, flags.limits);
  add_man_page_option(app, LIGHTSHAFT_VERSION);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  for (const Result<void>& fits : {check_store(flags.store), check_blobs(flags.blobs), check_shared(flags)}) {
    if (fits) continue;
    fmt::print(stderr, "lightshaft-coordinator: error: {}\n", fits.error().message);
    return kUsage;
  }
  flags.log_format = *log_format_of(log_format);
  return flags;
}

}  // namespace ls::coordinator
