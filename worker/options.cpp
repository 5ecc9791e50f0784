#include "worker/options.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "core/base/log.h"
#include "core/base/machine_memory.h"
#include "core/base/secret.h"
#include "util/command_line/command.h"
#include "util/command_line/parse.h"
#include "util/protocol/limits.h"
#include "worker/child/child.h"
#include "worker/machine.h"

namespace ls::worker {
namespace {

constexpr const char* kBuild = "lightshaft-worker " LIGHTSHAFT_VERSION;
// The share of the machine's memory that the render child may use by default; the rest is for the system and
// the agent.
constexpr double kMemoryShare = 0.9;

struct Files {
  std::string token, tls_ca, tls_cert, tls_key;
};

void describe(CLI::App& app, Options& o, Files& files) {
  app.add_option("--coordinator", o.coordinators,
                 "HOST:PORT where the coordinator listens for workers; if several coordinators share a farm, "
                 "all of them, separated by commas")
      ->delimiter(',');
  app.add_option("--threads", o.threads, "Number of units to render at once; default: number of CPUs")
      ->check(CLI::Range(1, kMostChildThreads));
  app.add_option("--cache", o.cache, "Folder for the files of scenes; several workers may share it");
  app.add_option("--cache-limit", o.cache_limit, "Largest size of the cache, e.g. 20G; default: no limit")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--memory-limit", o.memory_limit,
                 "Memory that the renderer may use, e.g. 8G; default: 90 % of the machine's memory")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--hang-after", o.hang_seconds,
                 "Restart the renderer if no sample is finished for this many seconds")
      ->check(CLI::PositiveNumber);
  app.add_option(
         "--build-limit", o.build_seconds,
         "Longest time in seconds for loading a scene; no other scene is loaded meanwhile; default: 1800")
      ->check(CLI::PositiveNumber);
  app.add_option("--idle-exit", o.idle_seconds,
                 "End after this many seconds without work, with an error if the coordinator was never "
                 "reached; default: wait for ever")
      ->check(CLI::PositiveNumber);
  app.add_option("--name", o.name, "Name of this worker in lists; default: the host name");
  app.add_option("--tags", o.tags, "Tags of this worker, separated by commas; jobs can require them")
      ->delimiter(',');
  app.add_option("--token-file", files.token, "File with the farm's join token (or LIGHTSHAFT_JOIN_TOKEN)");
  app.add_option("--log-format", "text, or json with one object per line")
      ->check(CLI::IsMember({"text", "json"}));
  auto* ca = app.add_option(
      "--tls-ca", files.tls_ca,
      "Use TLS; the coordinator's certificate must be signed by this authority (its DATA/tls/ca.pem)");
  auto* cert =
      app.add_option("--tls-cert", files.tls_cert, "This worker's certificate (DATA/tls/worker.pem)");
  auto* key = app.add_option("--tls-key", files.tls_key, "Key of that certificate (DATA/tls/worker.key)");
  ca->needs(cert)->needs(key);
  cert->needs(ca);
  key->needs(ca);
  app.add_flag("--fake", o.fake,
               "For tests: invent pixels instead of rendering scenes; the coordinator needs --allow-fake");
  app.add_flag("--render-child", o.render_child)->group("");
  app.add_option("--fake-delay", "Milliseconds that a fake unit takes")->group("");
  app.add_option("--fake-sample-seconds", o.fake_options.sample_seconds)->group("");
  app.add_option("--fake-fault", o.fake_fault_text)->group("");
  app.add_option("--fake-class", o.fake_class)->group("");
  for (const auto& [option, value] : {std::pair("--coordinator", "ADDRESS,..."),
                                      {"--cache", "DIR"},
                                      {"--name", "NAME"},
                                      {"--tags", "A,B"},
                                      {"--token-file", "FILE"},
                                      {"--tls-ca", "FILE"},
                                      {"--tls-cert", "FILE"},
                                      {"--tls-key", "FILE"}})
    app.get_option(option)->type_name(value);
  app.set_version_flag("--version", kBuild);
  add_man_page_option(app, LIGHTSHAFT_VERSION);
}

Result<std::string> join_token(const std::string& file) {
  if (!file.empty()) return read_secret(file);
  const char* token = std::getenv("LIGHTSHAFT_JOIN_TOKEN");
  return token ? token : "";
}

Result<void> read_tls(const Files& files, Options& o) {
  if (files.tls_ca.empty()) return {};
  LinkTls& tls = o.tls.emplace();
  const std::pair<const std::string&, std::string&> all[] = {
      {files.tls_ca, tls.ca}, {files.tls_cert, tls.cert}, {files.tls_key, tls.key}};
  for (const auto& [file, text] : all) {
    if (file.empty()) continue;
    auto pem = read_pem(file);
    if (!pem) return tl::unexpected(pem.error());
    text = std::move(*pem);
  }
  struct stat info {};
  if (!files.tls_key.empty() && ::stat(files.tls_key.c_str(), &info) == 0 && (info.st_mode & 07) != 0)
    log_warn("", fmt::format("everybody on this machine may read the TLS key '{0}': chmod o= '{0}'",
                             files.tls_key));
  return {};
}

// Returns the address that may have been meant, with the default port for workers.
std::string example_of(const std::string& rest) {
  return rest.substr(0, rest.find_first_of(":/")) + ":50051";
}

int usage(const std::string& message) {
  std::cerr << "lightshaft-worker: " << message << "\n";
  return 2;
}

}  // namespace

std::variant<Options, int> parse_options(int argc, char** argv) {
  Options o;
  o.threads = std::min(usable_cpus(), kMostChildThreads);
  o.name = host_name();
  o.cache = default_cache();
  o.memory_limit = static_cast<std::uint64_t>(kMemoryShare * static_cast<double>(usable_memory_bytes()));
  Files files;
  CLI::App app("Renders units for a Lightshaft coordinator.", "lightshaft-worker");
  describe(app, o, files);
  use_plain_help(app);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  for (const std::string& address : o.coordinators)
    if (const std::size_t scheme = address.find("://"); scheme != std::string::npos)
      return usage(
          fmt::format("--coordinator {}: give HOST:PORT of the port for workers (the coordinator's --grpc), "
                      "without {}, for example {}",
                      address, address.substr(0, scheme + 3), example_of(address.substr(scheme + 3))));
  if (const auto* delay = app.get_option("--fake-delay"); delay->count() > 0) {
    const double ms = delay->as<double>();
    if (!(ms >= 0 && ms < 1e6)) return usage("--fake-delay must be a number of milliseconds");
    o.fake_options.delay = from_seconds(ms * 1e-3);
  }
  if (!(o.fake_options.sample_seconds >= 0 && o.fake_options.sample_seconds <= 1))
    return usage("--fake-sample-seconds is 0 to 1");
  if (const auto* format = app.get_option("--log-format"); format->count() > 0)
    o.log_format = *log_format_of(format->as<std::string>());
  const auto fault = parse_fake_fault(o.fake_fault_text);
  if (!fault) return usage("--fake-fault: " + fault.error().message);
  o.fake_options.fault = *fault;
  if (!o.fake_class.empty()) {
    o.fake_options.numeric_class = sha256(o.fake_class);
    o.fake_options.platform = "fake:" + o.fake_class;
  }
  if (o.render_child) return o;
  const bool addresses = std::all_of(o.coordinators.begin(), o.coordinators.end(),
                                     [](const auto& a) { return a.find(':') != std::string::npos; });
  if (o.coordinators.empty() || !addresses)
    return usage("--coordinator HOST:PORT is needed, e.g. --coordinator localhost:50051");
  const auto token = join_token(files.token);
  if (!token) return usage("--token-file: " + token.error().message);
  if (token->size() > limits::kTokenBytes)
    return usage(fmt::format("the join token has more than {} characters", limits::kTokenBytes));
  o.join_token = *token;
  if (const auto read = read_tls(files, o); !read) return usage(read.error().message);
#ifndef LIGHTSHAFT_RENDERER
  if (!o.fake)
    return usage("this program was built without the renderer (LIGHTSHAFT_RENDERER=OFF); only --fake works");
#endif
  return o;
}

std::vector<std::string> child_arguments(const Options& o) {
  std::vector<std::string> arguments = {"--render-child", "--threads", std::to_string(o.threads),
                                        "--memory-limit", std::to_string(o.memory_limit)};
  // The child must know the cache's folder, where the files of jobs are, so that its sandbox can permit
  // reading there.
  if (!o.cache.empty()) arguments.insert(arguments.end(), {"--cache", o.cache.string()});
  if (o.fake) arguments.push_back("--fake");
  arguments.insert(arguments.end(),
                   {"--fake-delay", fmt::format("{}", seconds(o.fake_options.delay) * 1e3),
                    "--fake-sample-seconds", fmt::format("{}", o.fake_options.sample_seconds)});
  if (!o.fake_fault_text.empty()) arguments.insert(arguments.end(), {"--fake-fault", o.fake_fault_text});
  if (!o.fake_class.empty()) arguments.insert(arguments.end(), {"--fake-class", o.fake_class});
  return arguments;
}

}  // namespace ls::worker
