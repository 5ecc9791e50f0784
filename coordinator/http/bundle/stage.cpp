#include "coordinator/http/bundle/stage.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <set>
#include <system_error>

#include "coordinator/base/limits.h"
#include "coordinator/http/bundle/spool.h"
#include "coordinator/http/message/limits.h"
#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "core/base/text/utf8.h"

namespace ls::http {
namespace {

namespace fs = std::filesystem;
using coordinator::BlobStore;

constexpr std::string_view kUsda = "#usda", kUsdc = "PXR-USDC", kZip = "PK\x03\x04";
constexpr std::string_view kWarnings = "warnings.txt";    // of the bundle that the Python package writes
constexpr std::size_t kMaxReason = 16u << 10;             // bytes of a message from there
constexpr std::uint64_t kPiece = std::uint64_t{4} << 20;  // bytes of a blob in memory
constexpr std::size_t kMaxUp = 32;                        // "../" at the beginning of a file's name

bool ends_in(std::string_view name, std::string_view ending) {
  return name.size() > ending.size() &&
         std::equal(ending.begin(), ending.end(), name.end() - static_cast<std::ptrdiff_t>(ending.size()),
                    [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
}

// Prints what the interpreter must be able to read: its own folders and those of its packages.
constexpr const char* kProbe =
    "import lightshaft.usd, os, sys\n"
    "folders = {sys.prefix, sys.base_prefix, *filter(os.path.isdir, sys.path)}\n"
    "os.write(3, '\\0'.join(sorted(map(os.path.realpath, folders))).encode())\n";

Result<std::string> content_of(int fd, std::size_t most) {
  std::string text(most, '\0');
  const ssize_t n = ::pread(fd, text.data(), text.size(), 0);
  if (n < 0) return tl::unexpected(spool_error("no reading", errno));
  text.resize(static_cast<std::size_t>(n));
  return text;
}

tl::unexpected<Error> bad_stage(std::string text) { return fail(Errc::invalid_argument, std::move(text)); }

Result<void> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return tl::unexpected(spool_error("no folder", error.value()));
  return {};
}

// A folder that is removed with its content.
class ScratchFolder {
 public:
  static Result<std::unique_ptr<ScratchFolder>> make(const fs::path& within) {
    if (auto ok = make_folder(within); !ok) return tl::unexpected(ok.error());
    std::string name = (within / "stage-XXXXXX").string();
    if (!::mkdtemp(name.data())) return tl::unexpected(spool_error("no folder", errno));
    return std::unique_ptr<ScratchFolder>(new ScratchFolder(name));
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path path;

 private:
  explicit ScratchFolder(fs::path made) : path(std::move(made)) {}
};

// The name of a file, as seen from the stage's folder: how many folders up, and the rest.
struct Place {
  std::size_t up = 0;
  std::string rest;
};

Result<Place> place_of(const std::string& name) {
  const auto bad = [&](std::string_view why) {
    return bad_stage(fmt::format("the file \"{}\" {}", plain_text(name), why));
  };
  if (name.starts_with('/')) return bad("has an absolute name: names are relative to the stage's folder");
  Place place;
  std::vector<std::string_view> parts;
  for (std::string_view left = name; !left.empty();) {
    const std::size_t slash = std::min(left.find('/'), left.size());
    const std::string_view part = left.substr(0, slash);
    left.remove_prefix(std::min(slash + 1, left.size()));
    if (part.empty() || part == ".") continue;
    if (part != "..")
      parts.push_back(part);
    else if (!parts.empty())
      parts.pop_back();
    else if (++place.up > kMaxUp)
      return bad("is too many folders up");
  }
  for (const std::string_view part : parts) place.rest.append(place.rest.empty() ? "" : "/").append(part);
  const auto rest = normal_name(place.rest);
  if (!rest) return bad(rest.error().message);
  place.rest = *rest;
  return place;
}

// Writes the blob to a new file below `folder`.
Result<void> write_blob(const BlobStore& blobs, const Digest& digest, const fs::path& file,
                        std::uint64_t& left, const std::stop_token& stop) {
  const auto proven = blobs.prove(digest);
  if (!proven) return fail(Errc::failed_precondition, proven.error().message);
  const auto size = blobs.size(digest);
  if (!size) return tl::unexpected(size.error());
  if (*size > left) return bad_stage("the files of the stage are too large together");
  left -= *size;
  if (auto made = make_folder(file.parent_path()); !made) return made;
  const Descriptor out(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0640));
  if (out.fd < 0) return tl::unexpected(spool_error("no file", errno));
  for (std::uint64_t at = 0; at < *size;) {
    if (stop.stop_requested()) return fail(Errc::unavailable, "the coordinator is stopping");
    const auto piece = blobs.read(digest, at, std::min(kPiece, *size - at));
    if (!piece) return tl::unexpected(piece.error());
    if (piece->empty()) return fail(Errc::unavailable, "a blob became shorter while it was read");
    if (auto ok = write_spool(out.fd, *piece); !ok) return ok;
    at += piece->size();
  }
  return {};
}

// Lays out the files of the stage below `folder` as its names say. Returns the path of the stage's file.
Result<fs::path> lay_out(const Stage& stage, const fs::path& folder, const BlobStore& blobs,
                         std::uint64_t most_bytes, const std::stop_token& stop) {
  std::vector<std::pair<Place, Digest>> files;
  std::size_t deepest = 0;
  for (const auto& [name, digest] : stage.files) {
    auto place = place_of(name);
    if (!place) return tl::unexpected(place.error());
    deepest = std::max(deepest, place->up);
    files.emplace_back(std::move(*place), digest);
  }
  // Folders of one letter stand for those above the stage's own.
  const auto above = [&](std::size_t up) {
    fs::path path = folder;
    for (std::size_t i = up; i < deepest; ++i) path /= "d";
    return path;
  };
  std::string own = stage.name.substr(stage.name.rfind('/') + 1);
  auto name = place_of(own);
  if (!name || name->up) name = Place{0, "stage.usd"};
  if (!is_stage_name(name->rest)) name->rest += ".usd";
  files.emplace_back(*name, stage.main);
  std::set<fs::path> taken;
  for (const auto& [place, digest] : files)
    if (!taken.insert(above(place.up) / place.rest).second)
      return bad_stage(fmt::format("the file \"{}\" is there twice", plain_text(place.rest)));
  for (const fs::path& path : taken)
    for (fs::path above_it = path.parent_path(); above_it != folder; above_it = above_it.parent_path())
      if (taken.count(above_it))
        return bad_stage(fmt::format("the file \"{}\" is a folder of another file, too",
                                     plain_text(above_it.filename().string())));
  for (const auto& [place, digest] : files)
    if (auto ok = write_blob(blobs, digest, above(place.up) / place.rest, most_bytes, stop); !ok)
      return fail(ok.error().code, fmt::format("\"{}\": {}", plain_text(place.rest), ok.error().message));
  return above(0) / name->rest;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size() && lines.size() < coordinator::limits::kMaxWarnings;) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (end > at) lines.push_back(plain_text(text.substr(at, end - at)));
    at = end + 1;
  }
  return lines;
}

// The message of the Python package, line by line.
std::string reason_in(const std::string& text) {
  std::string out;
  for (const std::string& line : lines_of(text)) out += (out.empty() ? "" : "\n") + line;
  return out;
}

void replace_all(const std::string& what, std::string_view by, std::string& text) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
}

}  // namespace

bool is_stage_name(std::string_view file_name) {
  for (const std::string_view ending : {".usd", ".usda", ".usdc", ".usdz"})
    if (ends_in(file_name, ending)) return true;
  return false;
}

bool is_stage(std::string_view file_name, std::span<const std::byte> begin) {
  const std::string_view bytes(reinterpret_cast<const char*>(begin.data()), begin.size());
  return bytes.starts_with(kUsda) || bytes.starts_with(kUsdc) ||
         (bytes.starts_with(kZip) && ends_in(file_name, ".usdz"));
}

Result<std::unique_ptr<StageReader>> StageReader::open(Options options) {
  const auto cannot = [&](const std::string& why) {
    return fail(Errc::failed_precondition,
                fmt::format("--usd-python {}: {}; it must be a Python in which pip install 'lightshaft[usd]' "
                            "was run",
                            options.python.string(), why));
  };
  const auto output = open_spool(options.folder);
  if (!output) return tl::unexpected(output.error());
  const auto end = run_helper(options.python, {"-I", "-B", "-c", kProbe}, (*output)->fd);
  if (!end) return cannot(end.error().message);
  if (end->status != 0) return cannot(end->last_line.empty() ? "it failed" : end->last_line);
  const auto text = content_of((*output)->fd, kMaxReason);
  if (!text) return tl::unexpected(text.error());
  std::vector<std::string> folders;
  for (std::size_t at = 0; at < text->size();) {
    const std::size_t zero = std::min(text->find('\0', at), text->size());
    folders.push_back(text->substr(at, zero - at));
    at = zero + 1;
  }
  std::error_code ignored;
  fs::remove_all(options.folder, ignored);  // what a killed coordinator has left
  return std::unique_ptr<StageReader>(new StageReader(std::move(options), std::move(folders)));
}

Result<int> StageReader::run(const fs::path& folder, const fs::path& main, const Stage& stage, int output,
                             const std::stop_token& stop, std::string& last_line) const {
  std::vector<std::string> words{std::to_string(options_.seconds), std::to_string(options_.memory_bytes),
                                 std::to_string(options_.output_bytes), folder.string()};
  words.insert(words.end(), readable_.begin(), readable_.end());
  words.insert(words.end(),
               {"--", options_.python.string(), "-I", "-B", "-m", "lightshaft.usd", main.string(), "--folder",
                folder.string(), "--to-descriptor", std::to_string(kHelperFd)});
  if (stage.frames) words.insert(words.end(), {"--frames", to_string(*stage.frames)});
  if (stage.size)
    words.insert(words.end(),
                 {"--size", std::to_string(stage.size->width), std::to_string(stage.size->height)});
  std::atomic<bool> stopped{false};
  const std::stop_callback on_stop(stop, [&] { stopped = true; });
  const auto end = run_helper(options_.sandbox, std::move(words), output, &stopped);
  if (!end) return tl::unexpected(end.error());
  last_line = end->last_line;
  return end->status;
}

Result<StageScene> StageReader::read(const Stage& stage, const std::string& caller,
                                     const BundleLimits& limits, BlobStore& blobs,
                                     const std::stop_token& stop) {
  const coordinator::Gate::Place turn(turns_, caller, 0);
  const auto folder = ScratchFolder::make(options_.folder);
  if (!folder) return tl::unexpected(folder.error());
  const fs::path files = (*folder)->path / "files";
  const auto main = lay_out(stage, files, blobs, limits.total_bytes, stop);
  if (!main) return tl::unexpected(main.error());
  const auto made = open_spool((*folder)->path);
  if (!made) return tl::unexpected(made.error());
  const int output = (*made)->fd;
  std::string last_line;
  const auto status = run(files, *main, stage, output, stop, last_line);
  if (!status) return tl::unexpected(status.error());
  if (stop.stop_requested()) return fail(Errc::unavailable, "the coordinator is stopping");
  const std::string name = plain_text(stage.name);
  if (WIFSIGNALED(*status) && WTERMSIG(*status) == SIGALRM)
    return bad_stage(fmt::format("{}: reading this stage took longer than {} s", name, options_.seconds));
  if (WIFSIGNALED(*status))
    return bad_stage(
        fmt::format("{}: USD crashed while it read this stage (signal {})", name, WTERMSIG(*status)));
  if (WEXITSTATUS(*status) != 0) {
    const auto text = content_of(output, kMaxReason);
    std::string reason = text && WEXITSTATUS(*status) == 2 ? reason_in(*text) : std::string();
    // A message names files by where they lie here.
    replace_all(files.string() + "/", "", reason);
    replace_all(files.string(), "the folder of the stage's files", reason);
    if (reason.empty()) reason = "this stage cannot be read: " + last_line;
    return bad_stage(fmt::format("{}: {}", name, reason));
  }
  struct stat info {};
  if (::fstat(output, &info) != 0) return tl::unexpected(spool_error("no size", errno));
  auto bundle =
      read_bundle(output, static_cast<std::uint64_t>(info.st_size), ArchiveKind::tar, limits, blobs, stop);
  if (!bundle) return tl::unexpected(bundle.error());
  StageScene scene{std::move(*bundle), {}};
  if (const auto file = scene.bundle.assets.extract(std::string(kWarnings)); !file.empty()) {
    const auto bytes = blobs.read_whole(file.mapped(), kMaxReason);
    if (!bytes) return tl::unexpected(bytes.error());
    scene.warnings = lines_of({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  }
  return scene;
}

}  // namespace ls::http
