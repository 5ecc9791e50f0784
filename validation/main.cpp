// lightshaft-validate, which `lightshaft validate` starts: tests the renderer, with the built-in table of
// cases whose answers are known or, given FILE, with the tests in a file of the Nori renderer.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/base/file_form.h"
#include "core/base/safe_text.h"
#include "core/scene/limits.h"
#include "formats/folder_assets.h"
#include "util/command_line/parse.h"
#include "validation/nori_test_run.h"
#include "validation/options.h"
#include "validation/run.h"
#include "worker/machine.h"
#include "worker/render/base/build_id.h"
#include "worker/render/render.h"

namespace {

using namespace ls;
namespace fs = std::filesystem;

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2 };

ExitCode refuse(const std::string& text, ExitCode code = kUsage) {
  fmt::print(stderr, "{}\n", plain_text("lightshaft: error: " + text));
  return code;
}

ExitCode refuse(const Error& error) {
  return refuse(error.message, error.code == Errc::invalid_argument ? kUsage : kFailed);
}

void print_line(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

// The file of --json. It is opened before the tests, so that hours of them do not end with a file that cannot
// be written, and gets its name when it is complete.
class JsonFile {
 public:
  static Result<JsonFile> open(const std::string& name) {
    std::error_code unknown;
    const fs::file_status status = fs::status(name, unknown);
    const bool replace = !fs::exists(status) || fs::is_regular_file(status);
    JsonFile file(name, replace ? fmt::format("{}.{}.new", name, ::getpid()) : name);
    if (!name.empty() && !file.out_)
      return bad_argument(fmt::format("--json {}: cannot be written: {}", name, std::strerror(errno)));
    return file;
  }
  JsonFile(JsonFile&&) = default;
  ~JsonFile() {
    std::error_code gone;
    if (out_.is_open() && aside_ != name_) fs::remove(aside_, gone);
  }

  Result<void> write(const std::string& text) {
    if (name_.empty()) return {};
    out_ << text;
    out_.close();
    std::error_code error;
    if (out_ && aside_ != name_) fs::rename(aside_, name_, error);
    if (!out_ || error) return fail(Errc::unavailable, fmt::format("{} cannot be written", name_));
    return {};
  }

 private:
  JsonFile(const std::string& name, std::string aside) : name_(name), aside_(std::move(aside)) {
    if (!name_.empty()) out_.open(aside_);
  }
  std::string name_, aside_;  // aside_: its name until it is complete
  std::ofstream out_;
};

// Prints the last line, and writes `json` with the build, the numeric class (machines of one class render the
// same bits), the seed and --case, so that nobody mixes results of different builds or options.
ExitCode report(const std::vector<cli::ValidateCase>& lines, nlohmann::ordered_json json,
                const cases::Options& o, JsonFile& file) {
  if (lines.empty()) return refuse(fmt::format("--case {}: there is no such case", o.only));
  std::size_t failed = 0;
  for (const cli::ValidateCase& c : lines) failed += c.passed() ? 0 : 1;
  print_line(fmt::format("{} of {} cases passed", lines.size() - failed, lines.size()));
  json["build"] = render::kBuildId;
  json["numeric_class"] = render::numeric_class().hex();
  json["seed"] = o.seed;
  if (!o.only.empty()) json["only"] = o.only;
  if (const auto saved = file.write(json.dump(2) + "\n"); !saved) return refuse(saved.error());
  return failed > 0 ? kFailed : kOk;
}

// Returns the results `lines` as JSON, with the table's significance level and the cases that --quick has
// left out. The docs page is generated from this JSON; tests/system/test_validation_table.py checks that
// every required case is in it or has a test of its own.
nlohmann::ordered_json table_with_rows(const cases::Table& table, const std::vector<cli::ValidateCase>& lines,
                                       bool quick) {
  nlohmann::ordered_json json = cli::table_json(lines);
  json["level"] = level_of(table);
  json["left_out"] = nlohmann::ordered_json::array();
  for (const cases::Case& c : table.cases())
    if (quick && c.options.slow) json["left_out"].push_back({{"name", c.id}, {"rows", c.rows}});
  return json;
}

template <class RunOptions>
RunOptions run_options(const cases::Options& o) {
  RunOptions options;
  options.threads = o.threads > 0 ? o.threads : worker::usable_cpus();
  options.seed = o.seed;
  options.only = o.only;
  options.done = [](const cli::ValidateCase& c) { print_line(cli::table_line(c)); };
  return options;
}

ExitCode run_table(const cases::Options& o, JsonFile& file) {
  auto options = run_options<cases::RunOptions>(o);
  options.quick = o.quick;
  const cases::Table table = cases::all_cases();
  print_line(cli::table_heading());
  const auto lines = run_cases(table, options);
  return report(lines, table_with_rows(table, lines, o.quick), o, file);
}

// A folder of assets that also records which files were requested.
class RecordedFolder final : public AssetSource {
 public:
  explicit RecordedFolder(fs::path folder) : folder_(std::move(folder)) {}
  Result<Asset> find(std::string_view name) override { return record(name, folder_.find(name)); }
  Result<std::string> text(std::string_view name) override { return folder_.text(name); }
  bool keeps() const override { return true; }
  Result<Asset> keep(std::string_view name, const std::string& bytes) override {
    return record(name, folder_.keep(name, bytes));
  }
  const render::AssetFiles& files() const { return files_; }

 private:
  Result<Asset> record(std::string_view name, Result<Asset> asset) {
    if (asset)
      if (const auto path = folder_.path_of(name)) files_.emplace(asset->digest, *path);
    return asset;
  }
  FolderAssets folder_;
  render::AssetFiles files_;
};

Result<std::string> read_text(const std::string& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return bad_argument("there is no such file");
  if (error) return bad_argument("cannot be opened: " + error.message());
  if (status.type() != fs::file_type::regular) return bad_argument("is not a regular file");
  if (const auto bytes = fs::file_size(path, error); !error && bytes > scene::kMaxTextBytes)
    return bad_argument(fmt::format("has {} bytes; a scene file may have {}", bytes, scene::kMaxTextBytes));
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) return bad_argument("cannot be read");
  return plain_bytes(path, std::move(text), scene::kMaxTextBytes);
}

ExitCode run_file(const cases::Options& o, JsonFile& file) {
  const auto text = read_text(o.file);
  if (!text) {
    Diagnostic fault;
    fault.place.file = o.file;
    fault.text = text.error().message;
    fmt::print(stderr, "{}", format_diagnostics({fault}));
    return kUsage;
  }
  RecordedFolder folder(fs::path(o.file).parent_path());
  const NoriTestResult read = read_nori_test(o.file, *text, folder, {{}, o.strict, {}});
  if (!read.diagnostics.empty()) fmt::print(stderr, "{}", format_diagnostics(read.diagnostics));
  if (!read.test) return kUsage;
  print_line(cli::table_heading());
  const auto lines = validate_test(*read.test, folder.files(), run_options<cli::ValidateOptions>(o));
  if (!lines) return refuse(lines.error());
  return report(*lines, cli::table_json(*lines), o, file);
}

ExitCode run(const cases::Options& o) {
  if (o.quick && !o.file.empty())
    return refuse("--quick is for the table: a FILE's tests say themselves how many paths they take");
  auto file = JsonFile::open(o.json);
  if (!file) return refuse(file.error());
  return o.file.empty() ? run_table(o, *file) : run_file(o, *file);
}

}  // namespace

int main(int argc, char** argv) {
  ::signal(SIGPIPE, SIG_IGN);
  CLI::App app(cases::kHelp, "lightshaft-validate");
  app.set_version_flag("--version", "lightshaft-validate " LIGHTSHAFT_VERSION);
  use_plain_help(app);
  cases::Options options;
  cases::add_options(app, options);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  try {
    return run(options);
  } catch (const std::system_error& e) {
    // Whoever read the output has enough of it.
    return e.code() == std::errc::broken_pipe
               ? kOk
               : refuse(fmt::format("`validate` failed: {}", e.what()), kFailed);
  } catch (const std::exception& e) {
    return refuse(fmt::format("`validate` failed: {}", e.what()), kFailed);
  }
}
