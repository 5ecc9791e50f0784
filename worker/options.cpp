#include "worker/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

#include "common/base/secret.h"
#include "common/protocol/limits.h"
#include "worker/child/child.h"
#include "worker/machine.h"

namespace ls::worker {
namespace {

constexpr const char* kBuild = "lightshaft-worker " LIGHTSHAFT_VERSION;
// Of the machine's memory, for the render child unless told otherwise: the system and the agent need the
// rest.
constexpr double kMemoryShare = 0.9;

void describe(CLI::App& app, Options& o, std::string& token_file) {
  app.add_option("--coordinator", o.coordinator, "HOST:PORT where the coordinator listens for workers");
  app.add_option("--threads", o.threads, "Units rendered at once; default: all CPUs")
      ->check(CLI::Range(1, kMostChildThreads));
  app.add_option("--cache", o.cache, "Folder for scenes and assets, may be shared by workers");
  app.add_option("--cache-limit", o.cache_limit, "Bytes to keep there, e.g. 20G; default: no limit")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--memory-limit", o.memory_limit,
                 "Bytes that the renderer may use, e.g. 8G; default: 9/10 of the machine's")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--hang-after", o.hang_seconds,
                 "Seconds without a finished sample after which the renderer is restarted")
      ->check(CLI::PositiveNumber);
  app.add_option("--name", o.name, "Name shown to people; default: the host's");
  app.add_option("--tags", o.tags, "What jobs may ask for, separated by commas")->delimiter(',');
  app.add_option("--token-file", token_file, "File with the farm's join token (or LIGHTSHAFT_JOIN_TOKEN)");
  app.add_flag("--fake", o.fake, "Render no scene: give pixels that are a pure function of the unit");
  app.add_flag("--render-child", o.render_child)->group("");
  app.add_option("--fake-delay", "Milliseconds that a fake unit takes")->group("");
  app.add_option("--fake-fault", o.fake_fault_text)->group("");
  app.add_option("--fake-class", o.fake_class)->group("");
  app.set_version_flag("--version", kBuild);
}

Result<std::string> join_token(const std::string& file) {
  if (!file.empty()) return read_secret(file);
  const char* token = std::getenv("LIGHTSHAFT_JOIN_TOKEN");
  return token ? token : "";
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
  std::string token_file;
  CLI::App app("Renders units for a Lightshaft coordinator.", "lightshaft-worker");
  describe(app, o, token_file);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (const auto* delay = app.get_option("--fake-delay"); delay->count() > 0) {
    const double ms = delay->as<double>();
    if (!(ms >= 0 && ms < 1e6)) return usage("--fake-delay is a number of milliseconds");
    o.fake_options.delay = from_seconds(ms * 1e-3);
  }
  const auto fault = parse_fake_fault(o.fake_fault_text);
  if (!fault) return usage("--fake-fault: " + fault.error().message);
  o.fake_options.fault = *fault;
  if (!o.fake_class.empty()) o.fake_options.numeric_class = sha256(o.fake_class);
  if (o.render_child) return o;
  if (o.coordinator.empty() || o.coordinator.find(':') == std::string::npos)
    return usage("--coordinator HOST:PORT is needed, e.g. --coordinator localhost:50051");
  const auto token = join_token(token_file);
  if (!token) return usage("--token-file: " + token.error().message);
  if (token->size() > limits::kTokenBytes)
    return usage(fmt::format("the join token has more than {} characters", limits::kTokenBytes));
  o.join_token = *token;
#ifndef LIGHTSHAFT_RENDERER
  if (!o.fake)
    return usage("this program was built without the renderer (LIGHTSHAFT_RENDERER=OFF); only --fake works");
#endif
  return o;
}

std::vector<std::string> child_arguments(const Options& o) {
  std::vector<std::string> arguments = {"--render-child", "--threads", std::to_string(o.threads),
                                        "--memory-limit", std::to_string(o.memory_limit)};
  if (o.fake) arguments.push_back("--fake");
  arguments.insert(arguments.end(), {"--fake-delay", fmt::format("{}", seconds(o.fake_options.delay) * 1e3)});
  if (!o.fake_fault_text.empty()) arguments.insert(arguments.end(), {"--fake-fault", o.fake_fault_text});
  if (!o.fake_class.empty()) arguments.insert(arguments.end(), {"--fake-class", o.fake_class});
  return arguments;
}

}  // namespace ls::worker
