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
#include <condition_variable>
#include <set>
#include <system_error>
#include <thread>

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

constexpr std::string_view kUsda = "#usda ", kUsdc = "PXR-USDC", kZip = "PK\x03\x04";
constexpr std::string_view kWarnings = "warnings.txt";    // of the bundle that the Python package writes
constexpr std::size_t kMaxReason = 16u << 10;             // bytes of a message from there
constexpr std::uint64_t kPiece = std::uint64_t{4} << 20;  // bytes of a blob in memory
constexpr std::size_t kMaxUp = 32;                        // "../" at the beginning of a file's name
constexpr std::size_t kMaxPart = 200, kMaxDepth = 64;     // of a file's name: bytes of a part, and parts
constexpr int kNoRoom = 3;                                // exit code of the package

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
  if (parts.size() > kMaxDepth) return bad(fmt::format("is more than {} folders deep", kMaxDepth));
  for (const std::string_view part : parts)
    if (part.size() > kMaxPart) return bad(fmt::format("has a name of more than {} bytes", kMaxPart));
  for (const std::string_view part : parts) place.rest.append(place.rest.empty() ? "" : "/").append(part);
  const auto rest = normal_name(place.rest);
  if (!rest) return bad(rest.error().message);
  place.rest = *rest;
  return place;
}

Result<void> write_blob(const BlobStore& blobs, const Digest& digest, const fs::path& file,
                        std::uint64_t& left, const std::stop_token& stop) {
  const auto proven = blobs.prove(digest);
  if (!proven) return fail(Errc::failed_precondition, proven.error().message);
  const auto size = blobs.size(digest);
  if (!size) return tl::unexpected(size.error());
  if (*size > left) return bad_stage("the files of the stage are too large together");
  left -= *size;
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

// Returns the name for the stage's file in its folder: the user's, since other files may name it, unless USD
// would take its ending for another format than that of its content, which begins with `begin`.
std::string own_name(const std::string& given, std::string_view begin) {
  const fs::path name = fs::path(given).filename();
  const bool zip = begin.starts_with(kZip), crate = begin.starts_with(kUsdc);
  const bool fits = is_stage_name(name.string()) && zip == ends_in(name.string(), ".usdz") &&
                    !(crate ? ends_in(name.string(), ".usda") : ends_in(name.string(), ".usdc"));
  return fits ? name.string() : name.stem().string() + (zip ? ".usdz" : ".usd");
}

// The files of a stage by their paths below one folder.
struct Layout {
  std::map<std::string, Digest> files;
  std::string above;             // the name of the folders above the stage's own, which no file has
  std::string own_folder, main;  // the stage's folder, "" or ending in "/", and the stage's file
};

// `begin`: the first kStageMagic bytes of the stage's file.
Result<Layout> layout_of(const Stage& stage, std::string_view begin) {
  std::vector<std::pair<Place, Digest>> files;
  std::size_t deepest = 0;
  for (const auto& [name, digest] : stage.files) {
    auto place = place_of(name);
    if (!place) return tl::unexpected(place.error());
    deepest = std::max(deepest, place->up);
    files.emplace_back(std::move(*place), digest);
  }
  Layout layout;
  layout.above = "above_the_stage";
  while (std::ranges::any_of(files, [&](const auto& file) {
    return ("/" + file.first.rest + "/").find("/" + layout.above + "/") != std::string::npos;
  }))
    layout.above += '_';
  const auto above = [&](std::size_t up) {
    std::string path;
    for (std::size_t i = up; i < deepest; ++i) path += layout.above + "/";
    return path;
  };
  layout.own_folder = above(0);
  auto own = place_of(own_name(stage.name, begin));
  if (!own || own->up) own = Place{0, own_name("stage", begin)};
  layout.main = layout.own_folder + own->rest;
  files.emplace_back(*own, stage.main);
  for (const auto& [place, digest] : files)
    if (!layout.files.emplace(above(place.up) + place.rest, digest).second)
      return bad_stage(fmt::format("the file \"{}\" is there twice", plain_text(place.rest)));
  for (const auto& [path, digest] : layout.files)
    if (const auto inner = layout.files.lower_bound(path + "/");
        inner != layout.files.end() && inner->first.starts_with(path + "/"))
      return bad_stage(fmt::format("the file \"{}\" is a folder of another file, too", plain_text(path)));
  return layout;
}

// Writes the files below `folder`, each blob once: further files of the same content are links to it.
Result<void> write_files(const Layout& layout, const fs::path& folder, const BlobStore& blobs,
                         std::uint64_t most_bytes, const std::stop_token& stop) {
  std::map<Digest, fs::path> written;
  std::set<fs::path> made;
  for (const auto& [name, digest] : layout.files) {
    if (stop.stop_requested()) return fail(Errc::unavailable, "the coordinator is stopping");
    const fs::path path = folder / name;
    if (made.insert(path.parent_path()).second)
      if (auto ok = make_folder(path.parent_path()); !ok) return ok;
    const auto [before, fresh] = written.emplace(digest, path);
    if (!fresh && ::link(before->second.c_str(), path.c_str()) == 0) continue;
    if (auto ok = write_blob(blobs, digest, path, most_bytes, stop); !ok)
      return fail(ok.error().code, fmt::format("\"{}\": {}", plain_text(name), ok.error().message));
  }
  return {};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t left_out = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (end > at && lines.size() < coordinator::limits::kMaxWarnings - 1)
      lines.push_back(plain_text(text.substr(at, end - at)));
    else
      left_out += end > at;
    at = end + 1;
  }
  if (left_out > 0) lines.push_back(fmt::format("and {} more lines", left_out));
  return lines;
}

void replace_all(const std::string& what, std::string_view by, std::string& text) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
}

// Returns the package's message with the user's names of files instead of paths on this machine.
std::string shown_text(std::string text, const fs::path& folder, const Layout& layout) {
  replace_all(folder.string() + "/" + layout.own_folder, "", text);
  replace_all(folder.string() + "/", "", text);
  replace_all(folder.string(), "the folder of the stage's files", text);
  replace_all(layout.above + "/", "", text);
  std::string out;
  for (const std::string& line : lines_of(text)) out += (out.empty() ? "" : "\n") + line;
  return out;
}

// Sets `flag` at a time, unless it is destroyed before.
class Deadline {
 public:
  Deadline(Duration after, std::atomic<bool>& flag)
      : thread_([this, after, &flag](const std::stop_token& stop) {
          std::unique_lock lock(mutex_);
          if (!ended_.wait_for(lock, stop, after, [] { return false; }) && !stop.stop_requested())
            flag = true;
        }) {}

 private:
  std::mutex mutex_;
  std::condition_variable_any ended_;
  std::jthread thread_;
};

}  // namespace

bool is_stage_name(std::string_view file_name) {
  for (const std::string_view ending : {".usd", ".usda", ".usdc", ".usdz"})
    if (ends_in(file_name, ending)) return true;
  return false;
}

bool is_stage(std::string_view file_name, std::span<const std::byte> begin) {
  std::string_view bytes(reinterpret_cast<const char*>(begin.data()), begin.size());
  if (bytes.starts_with(kUsda) || bytes.starts_with(kUsdc)) return true;
  // The Python package sends XML under the name of the stage that it was made of.
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  return is_stage_name(file_name) && first != std::string_view::npos && bytes[first] != '<';
}

Result<std::unique_ptr<StageReader>> StageReader::open(Options options) {
  const auto cannot = [&](const std::string& why) {
    return fail(Errc::failed_precondition,
                fmt::format("--usd-python {}: {}; it must be a Python in which pip install 'lightshaft[usd]' "
                            "was run",
                            options.python.string(), why));
  };
  if (auto ok = make_folder(options.folder); !ok) return tl::unexpected(ok.error());
  std::error_code ignored;
  options.folder = fs::canonical(options.folder, ignored);
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
  for (const std::string& folder : folders)
    if (const auto from = options.folder.lexically_relative(folder); !from.empty() && *from.begin() != "..")
      return fail(Errc::failed_precondition,
                  fmt::format("--usd-python {}: stages could read the data folder, which lies in {}: put one "
                              "of the two elsewhere",
                              options.python.string(), folder));
  for (const auto& left : fs::directory_iterator(options.folder, ignored))
    fs::remove_all(left.path(), ignored);  // of a coordinator that was killed
  auto reader = std::unique_ptr<StageReader>(new StageReader(std::move(options), std::move(folders)));
  const auto in_sandbox = reader->run({"-c", "import lightshaft.usd"}, {}, (*output)->fd, {});
  if (!in_sandbox) return tl::unexpected(in_sandbox.error());
  if (in_sandbox->status != 0) return cannot("in the sandbox: " + in_sandbox->last_line);
  return reader;
}

Result<HelperEnd> StageReader::run(const std::vector<std::string>& arguments, const fs::path& folder,
                                   int output, const std::stop_token& stop) const {
  std::vector<std::string> words{std::to_string(options_.seconds), std::to_string(options_.memory_bytes),
                                 std::to_string(options_.output_bytes)};
  if (!folder.empty()) words.push_back(folder.string());
  words.insert(words.end(), readable_.begin(), readable_.end());
  words.insert(words.end(), {"--", options_.python.string(), "-I", "-B"});
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::atomic<bool> stopped{false};
  const std::stop_callback on_stop(stop, [&] { stopped = true; });
  // The process ends by itself after options_.seconds, unless a stage has taken it over.
  const Deadline deadline(std::chrono::seconds(2 * options_.seconds), stopped);
  return run_helper(options_.sandbox, std::move(words), output, &stopped);
}

// The turn of one stage, until it is destroyed.
struct StageReader::Reading {
  Reading(StageReader& reader, const std::string& caller) : reader(reader), caller(caller) {
    const std::lock_guard lock(reader.mutex_);
    begun = reader.callers_.size() < kAtOnce && reader.callers_.insert(caller).second;
  }
  ~Reading() {
    if (!begun) return;
    const std::lock_guard lock(reader.mutex_);
    reader.callers_.erase(caller);
  }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;
  StageReader& reader;
  const std::string caller;
  bool begun;
};

Result<StageScene> StageReader::read(const Stage& stage, const std::string& caller,
                                     const BundleLimits& limits, BlobStore& blobs,
                                     const std::stop_token& stop) {
  const Reading reading(*this, caller);
  if (!reading.begun)
    return fail(Errc::unavailable,
                "a stage of this token, or two of others, are being read: try again in a minute");
  const auto begin = blobs.read(stage.main, 0, kStageMagic);
  if (!begin) return tl::unexpected(begin.error());
  const auto layout = layout_of(stage, {reinterpret_cast<const char*>(begin->data()), begin->size()});
  if (!layout) return tl::unexpected(layout.error());
  const auto folder = ScratchFolder::make(options_.folder);
  if (!folder) return tl::unexpected(folder.error());
  const fs::path files = (*folder)->path / "files";
  if (auto ok = write_files(*layout, files, blobs, std::min(limits.total_bytes, options_.output_bytes), stop);
      !ok)
    return tl::unexpected(ok.error());
  const auto made = open_spool((*folder)->path);
  if (!made) return tl::unexpected(made.error());
  const int output = (*made)->fd;
  std::vector<std::string> arguments{
      "-m",           "lightshaft.usd",  (files / layout->main).string(), "--folder",
      files.string(), "--to-descriptor", std::to_string(kHelperFd)};
  if (stage.frames) arguments.insert(arguments.end(), {"--frames", to_string(*stage.frames)});
  if (stage.size)
    arguments.insert(arguments.end(),
                     {"--size", std::to_string(stage.size->width), std::to_string(stage.size->height)});
  const auto end = run(arguments, files, output, stop);
  if (!end) return tl::unexpected(end.error());
  if (stop.stop_requested()) return fail(Errc::unavailable, "the coordinator is stopping");
  const std::string name = plain_text(stage.name);
  if (WIFSIGNALED(end->status)) {
    const int signal = WTERMSIG(end->status);
    if (signal == SIGALRM || signal == SIGKILL)
      return bad_stage(
          fmt::format("{}: reading this stage took longer than {} s, or the machine ran out of memory", name,
                      options_.seconds));
    return bad_stage(
        fmt::format("{}: USD crashed while it read this stage (signal {}), or this took more than {} MiB",
                    name, signal, options_.memory_bytes >> 20));
  }
  if (WEXITSTATUS(end->status) == kNoRoom) return tl::unexpected(spool_error("no room", ENOSPC));
  if (WEXITSTATUS(end->status) != 0) {
    const auto text = content_of(output, kMaxReason);
    std::string reason =
        text && WEXITSTATUS(end->status) == 2 ? shown_text(*text, files, *layout) : std::string();
    if (reason.empty()) reason = "this stage cannot be read: " + shown_text(end->last_line, files, *layout);
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
    scene.warnings =
        lines_of(shown_text({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, files, *layout));
  }
  return scene;
}

}  // namespace ls::http
