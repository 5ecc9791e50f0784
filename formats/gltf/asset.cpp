#include "formats/gltf/asset.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>

#include "core/base/parse_number.h"
#include "core/base/safe_text.h"
#include "core/base/text/suggest.h"
#include "core/scene/analysis/needs.h"
#include "core/scene/limits.h"
#include "formats/file_names.h"
#include "formats/gltf/support_table.h"
#include "formats/gltf/translation.h"

namespace ls::scene::gltf {
namespace {

constexpr std::string_view kMagic = "glTF";
constexpr std::size_t kHeaderBytes = 12, kChunkBytes = 8;
constexpr double kFramesPerSecond = 24;  // frame rate of a sequence, unless -D fps sets another
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t x;
  std::memcpy(&x, bytes.data() + at, sizeof x);
  return x;
}

// The parts of a glTF file: the JSON text and, in a .glb file, the binary chunk that follows it (nullopt:
// none).
struct Pieces {
  std::string_view json;
  std::optional<std::string_view> chunk;
};

// Splits a file into its parts. On error, returns a message that describes what is wrong with the file.
tl::expected<Pieces, std::string> taken_apart(std::string_view file) {
  if (!file.starts_with(kMagic)) return Pieces{file, std::nullopt};
  if (file.size() < kHeaderBytes + kChunkBytes)
    return tl::unexpected(fmt::format("a .glb of {} bytes is cut off: copy it again", file.size()));
  const std::size_t version = word(file, 4), length = word(file, 8);
  if (version != 2)
    return tl::unexpected(fmt::format("glTF of version {} is not read, only 2: convert it", version));
  if (length > file.size())
    return tl::unexpected(fmt::format("the file announces {} bytes and has {}: it is cut off, copy it again",
                                      length, file.size()));
  file = file.substr(0, length);
  Pieces pieces;
  for (std::size_t at = kHeaderBytes; at + kChunkBytes <= file.size();) {
    const std::size_t bytes = word(file, at);
    const std::uint32_t kind = word(file, at + 4);
    if (bytes > file.size() - at - kChunkBytes)
      return tl::unexpected(
          fmt::format("the chunk at byte {} announces {} bytes, more than are left", at, bytes));
    const std::string_view content = file.substr(at + kChunkBytes, bytes);
    const bool is_first = at == kHeaderBytes;
    if (is_first != (kind == kJsonChunk))
      return tl::unexpected(fmt::format("the first chunk of a .glb, and no other, is JSON"));
    if (is_first)
      // Some programs pad the JSON with zero bytes, which are removed here.
      pieces.json = content.substr(0, content.find_last_not_of('\0') + 1);
    if (kind == kBinaryChunk && !pieces.chunk) pieces.chunk = content;
    at += kChunkBytes + bytes;
  }
  return pieces;
}

// Options for reading a glTF file. They are set by -D NAME=VALUE on the command line or by the `defines` of a
// job.
struct Choices {
  std::string camera;
  std::optional<double> environment;
  Moment moment;
};

// Parses the value of an option -D that must be a number in [least, most]. For any other value, reports an
// error and returns `least`.
double number_of(const std::string& name, const std::string& value, double least, double most,
                 const Item& root) {
  if (const auto x = ls::parse_number<double>(value); x && *x >= least && *x <= most) return *x;
  root.error(fmt::format("-D {}={} wants a number from {} to {}", name, value, least, most));
  return least;
}

Choices choices(const ReadOptions& options, const Item& root) {
  static const std::vector<std::string> kNames{"camera", "environment", "animation", "time", "fps"};
  Choices out;
  double rate = kFramesPerSecond;
  for (const auto& [name, value] : options.defines) {
    if (name == "camera")
      out.camera = value;
    else if (name == "environment")
      out.environment = number_of(name, value, 1e-30, 1e30, root);
    else if (name == "animation")
      out.moment.animation = value;
    else if (name == "time")
      out.moment.seconds = number_of(name, value, 0, 1e6, root);
    else if (name == "fps")
      rate = number_of(name, value, 1e-3, 1e6, root);
    else
      root.error(fmt::format("-D {}: of a glTF file only {} can be chosen{}", name, fmt::join(kNames, ", "),
                             suggestion(name, kNames)));
  }
  if (options.frame) out.moment.seconds = out.moment.seconds.value_or(0) + *options.frame / rate;
  return out;
}

void check_version(const Item& root) {
  const Item version = root["asset"]["version"];
  // Files of glTF 1 may have a number.
  const auto* given = version.given() ? std::get_if<std::string>(&version.identity()->is) : nullptr;
  if (!given)
    version.error("the asset has no version that is a text, as \"2.0\" is, and only 2.0 is read: convert it");
  else if (!given->starts_with("2."))
    version.error(fmt::format("the asset's version is \"{}\", and only 2.0 is read: convert it", *given));
  if (const std::string least = root["asset"]["minVersion"].text("2.0"); least != "2.0")
    root["asset"]["minVersion"].error(fmt::format("it needs glTF {}, and 2.0 is read", least));
}

void check_extensions(Translation& t) {
  const Item& root = t.root;
  for (const Item& item : root["extensionsRequired"].list()) {
    const std::string name = item.text("");
    const Row* row = find_extension(name);
    if (row && row->use != Use::refused) continue;
    item.error(row ? fmt::format("{} is not read: {}", name, row->meaning)
                   : fmt::format("{} is not known here, and the file can't do without it: export it again "
                                 "without that extension",
                                 name));
  }
  for (const Item& item : root["extensionsUsed"].list()) {
    const std::string name = item.text("");
    const Row* row = find_extension(name);
    if (row && row->use == Use::ignored)
      t.warn_once(item, fmt::format("{} has no effect: {}", name, row->meaning));
    if (!row) t.warn_once(item, fmt::format("{} is not known here, and has no effect", plain_text(name)));
  }
}

void add_environment(Translation& t, double radiance) {
  Element sky = made("emitter", "constant", t.root.at());
  add(sky, "radiance", Rgb{radiance, radiance, radiance}, t.root.at());
  t.add(std::move(sky));
  t.has_light = true;
}

}  // namespace

std::string Translation::fresh_id(std::string name) {
  name = plain_text(name);
  if (name.empty()) name = "unnamed";
  if (!ids.insert(name).second) ids.insert(name = fmt::format("{} #{}", name, ids.size()));
  return name;
}

void Translation::add(Element e) {
  elements += size_of(e);
  if (elements > kMaxElements) {
    if (elements - size_of(e) <= kMaxElements)
      report.error(e.at,
                   fmt::format("the scene is too large: written as XML it would have more than {} elements",
                               kMaxElements));
    return;
  }
  scene::add(scene, std::move(e));
}

void Translation::warn_once(const Item& at, std::string text) {
  // A file may give millions of reasons for warnings: none is kept once no more are shown.
  if (report.takes_warnings() && warned.insert(text).second) at.warning(std::move(text));
}

bool is_gltf(std::string_view file_name) { return has_ending(file_name, {".gltf", ".glb"}); }

std::string too_large(std::size_t bytes) {
  return fmt::format(
      "the file has {} bytes, and a scene file may have {}: export it as a .gltf with buffers (.bin) and "
      "images of their own, each no larger",
      bytes, kMaxTextBytes);
}

std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report) {
  const auto refused = [&](std::string why) {
    const std::uint32_t file = report.add_file(SourceText(std::string(file_name), ""));
    return report.refuse({file, 0, 1}, std::move(why));
  };
  if (text.size() > kMaxTextBytes) return refused(too_large(text.size()));
  const auto pieces = taken_apart(text);
  if (!pieces) return refused(pieces.error());
  const auto tree = parse_json(std::string(file_name), std::string(pieces->json), report);
  if (!tree) return std::nullopt;
  const Item root(*tree, report);
  check_version(root);
  if (report.has_errors()) return std::nullopt;
  Translation t{
      assets, report, root, Buffers(root, assets, pieces->chunk), made("scene", "", root.at()), 0, false,
      {},     {},     {}};
  check_extensions(t);
  const Choices chosen = choices(options, root);
  if (report.has_errors()) return std::nullopt;
  warn_of_ignored(t);
  set(t.scene, "version", "3.0.0", root.at());
  const Stage stage = read_nodes(t, read_poses(t, chosen.moment));
  Materials materials(t);
  Meshes meshes(t, materials);
  if (!report.has_errors()) meshes.add(stage.meshes);
  for (const Standing& light : stage.lights) add_light(t, light);
  if (chosen.environment) add_environment(t, *chosen.environment);
  if (report.has_errors()) return std::nullopt;
  add_camera(t, stage.cameras, chosen.camera, meshes.box());
  if (!t.has_light)
    root.warning(fmt::format("{}: add -D environment=1 for a white sky of radiance 1", kNoLight));
  if (report.has_errors()) return std::nullopt;
  return Document{std::move(t.scene), {}, options.frame, options.labels};
}

}  // namespace ls::scene::gltf
