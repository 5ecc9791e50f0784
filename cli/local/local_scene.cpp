#include "cli/local/local_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "core/base/file_form.h"
#include "core/job/frame_diagnostics.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/limits.h"
#include "core/scene/schema/integrators.h"
#include "formats/file_names.h"
#include "formats/folder_assets.h"
#include "formats/gltf/asset.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostShown = 200;  // a list of names in a message ends after this many characters

// A folder of assets that also records which files were requested.
class RecordedFolder final : public AssetSource {
 public:
  explicit RecordedFolder(fs::path folder) : folder_(std::move(folder)) {}

  Result<Asset> find(std::string_view name) override {
    auto asset = folder_.find(name);
    if (asset)
      if (const auto path = folder_.path_of(name))
        files_.try_emplace(std::string(name), LocalFile{*path, asset->digest, asset->bytes});
    return asset;
  }
  Result<std::string> text(std::string_view name) override {
    auto text = folder_.text(name);
    if (!text) return text;
    if (const auto asset = find(name); !asset) return tl::unexpected(asset.error());
    if (const auto file = files_.find(std::string(name)); file != files_.end()) file->second.is_text = true;
    texts_ += *text;
    return text;
  }
  bool keeps() const override { return true; }
  Result<Asset> keep(std::string_view name, const std::string& bytes) override {
    auto asset = folder_.keep(name, bytes);
    if (!asset) return asset;
    LocalFile file{*folder_.path_of(name), asset->digest, asset->bytes};
    file.is_made = true;
    files_.insert_or_assign(std::string(name), std::move(file));
    return asset;
  }
  std::shared_ptr<const KeptFolder> kept() const { return folder_.kept(); }
  // Returns the files requested since the previous call.
  std::map<std::string, LocalFile> take_files() { return std::exchange(files_, {}); }
  std::string take_included_texts() { return std::exchange(texts_, {}); }
  // Returns warnings (errors if `strict`) about files that may be damaged, of those requested since the
  // previous call.
  std::vector<Diagnostic> take_doubts(bool strict) {
    std::vector<Diagnostic> out;
    for (const auto& [name, why] : folder_.take_doubts()) {
      Diagnostic& d = out.emplace_back();
      d.severity = strict ? Diagnostic::Severity::error : Diagnostic::Severity::warning;
      d.place.file = name;
      d.text = "the file " + why;
    }
    return out;
  }

 private:
  FolderAssets folder_;
  std::map<std::string, LocalFile> files_;
  std::string texts_;  // all included texts, joined; the scene reader limits their size
};

// Returns the names of the parameters ($name) in a text. Each name extends to the first character that cannot
// be part of a name.
std::set<std::string> parameters_in(const std::string& text) {
  const auto is_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  std::set<std::string> names;
  for (auto at = text.find('$'); at != std::string::npos; at = text.find('$', at + 1)) {
    auto end = at + 1;
    while (end < text.size() && is_name(text[end])) ++end;
    if (end > at + 1) names.insert(text.substr(at + 1, end - at - 1));
  }
  return names;
}

// Returns an error message if nothing in the scene uses one of the -D options, which is then probably
// misspelt. $ab in the scene also counts as a use of -D a: it may mean the value of $a and then the letter b.
std::optional<std::string> unused_define(const std::map<std::string, std::string>& defines,
                                         const std::string& texts) {
  if (defines.empty()) return std::nullopt;
  const std::set<std::string> used = parameters_in(texts);
  for (const auto& [name, value] : defines) {
    if (const auto at = used.lower_bound(name); at != used.end() && at->starts_with(name)) continue;
    std::string there = used.empty() ? "it has no parameters" : "it has";
    for (const auto& u : used)
      if (there.size() < kMostShown) there += " $" + u;
    return fmt::format("-D {}: the scene has no ${}; {}", name, name, there);
  }
  return std::nullopt;
}

tl::unexpected<coordinator::Rejected> refused(const std::string& path, const std::string& text) {
  return tl::unexpected(scene_fault(path, text));
}

tl::unexpected<coordinator::Rejected> unreadable(const std::string& path,
                                                 std::vector<Diagnostic> diagnostics) {
  return tl::unexpected(coordinator::Rejected{
      {Errc::invalid_argument, fmt::format("{} cannot be read", path)}, std::move(diagnostics)});
}

tl::expected<std::string, coordinator::Rejected> read_text(const std::string& path) {
  if (std::string why = scene::why_no_scene(without_gz(path)); !why.empty()) return refused(path, why);
  std::error_code error;
  const auto status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return refused(path, "there is no such file");
  if (error) return refused(path, "cannot be opened: " + error.message());
  if (status.type() != fs::file_type::regular) return refused(path, "is not a regular file");
  const auto bytes = fs::file_size(path, error);
  if (!error && bytes > scene::kMaxTextBytes)
    return refused(path, scene::gltf::is_gltf(path) ? scene::gltf::too_large(bytes)
                                                    : fmt::format("has {} bytes; a scene file may have {}",
                                                                  bytes, scene::kMaxTextBytes));
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file) return refused(path, "cannot be read");
  auto plain = plain_bytes(path, std::move(text), scene::kMaxTextBytes);
  if (!plain) return refused(path, plain.error().message);
  return std::move(*plain);
}

}  // namespace

struct SceneReader::Impl {
  std::string path, text;
  std::map<std::string, std::string> defines;
  bool strict;
  RecordedFolder folder;
};

SceneReader::SceneReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SceneReader::SceneReader(SceneReader&&) noexcept = default;
SceneReader::~SceneReader() = default;

tl::expected<SceneReader, coordinator::Rejected> SceneReader::open(const std::string& path,
                                                                   std::map<std::string, std::string> defines,
                                                                   bool strict) {
  auto text = read_text(path);
  if (!text) return tl::unexpected(std::move(text.error()));
  return SceneReader(std::unique_ptr<Impl>(new Impl{path, std::move(*text), std::move(defines), strict,
                                                    RecordedFolder(fs::path(path).parent_path())}));
}

tl::expected<LocalScene, coordinator::Rejected> SceneReader::read(std::optional<std::uint32_t> frame,
                                                                  bool labels) {
  Impl& in = *impl_;
  ReadResult read = read_scene(in.path, in.text, in.folder, {in.defines, in.strict, frame, labels});
  const std::string included = in.folder.take_included_texts();
  auto files = in.folder.take_files();
  std::ranges::move(in.folder.take_doubts(in.strict), std::back_inserter(read.diagnostics));
  const auto is_error = [](const Diagnostic& d) { return d.severity == Diagnostic::Severity::error; };
  if (std::ranges::any_of(read.diagnostics, is_error)) read.scene.reset();
  if (!read.scene) return unreadable(in.path, std::move(read.diagnostics));
  // The glTF reader checks the -D options itself.
  if (!scene::gltf::is_gltf(in.path))
    if (const auto unused = unused_define(in.defines, in.text + included)) return refused(in.path, *unused);
  LocalScene scene{in.path,          in.text, std::move(*read.scene), std::move(read.diagnostics),
                   std::move(files), frame};
  scene.made = in.folder.kept();
  for (const bool sees_media : {false, true})
    for (const Asset& a : scene::pruned(scene.scene, {sees_media, !sees_media}).scene.assets)
      scene.needed[sees_media].insert(a.digest);
  return scene;
}

tl::expected<LocalScene, coordinator::Rejected> SceneReader::read_all(const FrameRange& frames) {
  std::optional<LocalScene> first;
  FrameDiagnostics wrong, warned;
  for (const std::uint32_t frame : frames.frames()) {
    auto scene = read(frame);
    if (!scene && scene.error().diagnostics.empty()) return scene;
    wrong.add(frame, scene ? std::vector<Diagnostic>{} : scene.error().diagnostics);
    if (wrong.full()) break;
    if (!scene) continue;
    warned.add(frame, scene->warnings);
    if (first) {
      first->files.merge(scene->files);
      for (std::size_t i = 0; i < first->needed.size(); ++i) first->needed[i].merge(scene->needed[i]);
    } else {
      first = std::move(*scene);
    }
  }
  if (!wrong.empty()) return unreadable(impl_->path, wrong.take());
  first->warnings = warned.take();
  return std::move(*first);
}

tl::expected<LocalScene, coordinator::Rejected> read_local_scene(
    const std::string& path, const std::map<std::string, std::string>& defines, bool strict,
    std::optional<std::uint32_t> frame, bool labels) {
  auto reader = SceneReader::open(path, defines, strict);
  if (!reader) return tl::unexpected(std::move(reader.error()));
  return reader->read(frame, labels);
}

bool is_needed(const LocalScene& scene, const JobSpec& spec, const LocalFile& file) {
  const std::string integrator = spec.integrator.value_or(scene.scene.integrator.name);
  return file.is_text || scene.needed[scene::sees_media(integrator)].contains(file.digest);
}

coordinator::Rejected scene_fault(const std::string& scene, const std::string& text) {
  Diagnostic d;
  d.place.file = scene;
  d.text = text;
  return {{Errc::invalid_argument, text}, {std::move(d)}};
}

coordinator::SubmitRequest submit_request(const LocalScene& scene, const JobSpec& spec) {
  coordinator::SubmitRequest request;
  request.scene_name = scene.name;
  request.scene_text = scene.text;
  for (const auto& [name, file] : scene.files) request.assets.emplace(name, file.digest);
  request.spec = spec;
  return request;
}

}  // namespace ls::cli
