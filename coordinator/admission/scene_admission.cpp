#include "coordinator/admission/scene_admission.h"

#include <fmt/format.h>

#include <map>

#include "common/scene/limits.h"

namespace ls::coordinator {
namespace {

// Returns the name without leading "./": "./a/b.obj" and "a/b.obj" are the same file.
std::string plain_name(std::string_view name) {
  while (name.starts_with("./")) name.remove_prefix(2);
  return std::string(name);
}

class UploadedAssets final : public AssetSource {
 public:
  UploadedAssets(const std::map<std::string, Digest>& assets, const BlobStore& blobs, bool strict)
      : blobs_(blobs), strict_(strict) {
    for (const auto& [name, digest] : assets) assets_.emplace(plain_name(name), digest);
  }

  Result<Asset> find(std::string_view name) override { return find(name, false); }

  Result<std::string> text(std::string_view name) override {
    const auto asset = find(name, true);
    if (!asset) return tl::unexpected(asset.error());
    if (asset->bytes > scene::kMaxTextBytes)
      return fail(Errc::invalid_argument, fmt::format("\"{}\" has {} bytes; an included scene may have {}",
                                                      name, asset->bytes, scene::kMaxTextBytes));
    const auto bytes = blobs_.read(asset->digest, 0, asset->bytes);
    if (!bytes) return tl::unexpected(bytes.error());
    text_bytes_ += bytes->size();
    return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  }

  std::size_t text_bytes() const { return text_bytes_; }
  std::set<Digest> not_uploaded() const { return not_uploaded_; }

 private:
  Result<Asset> find(std::string_view name, bool of_text) {
    const auto found = assets_.find(plain_name(name));
    if (found == assets_.end())
      return fail(Errc::not_found,
                  fmt::format("\"{}\" was not sent along: name it among the assets, with its SHA-256{}", name,
                              offered()));
    const auto bytes = blobs_.size(found->second);
    if (!bytes && !strict_ && !of_text) {
      not_uploaded_.insert(found->second);
      return Asset{std::string(name), found->second, 0};
    }
    if (!bytes)
      return fail(Errc::not_found,
                  fmt::format("the bytes of \"{}\" have not been uploaded: PUT them to /api/v1/blobs/{}",
                              name, found->second.hex()));
    return Asset{std::string(name), found->second, *bytes};
  }

  std::string offered() const {
    if (assets_.empty()) return "; no assets were named";
    std::string names;
    std::size_t shown = 0;
    for (const auto& [name, digest] : assets_) {
      if (++shown > 5) return "; named were" + names + fmt::format(" and {} more", assets_.size() - 5);
      names += fmt::format(" \"{}\"", name);
    }
    return "; named were" + names;
  }

  std::map<std::string, Digest> assets_;
  std::size_t text_bytes_ = 0;
  const BlobStore& blobs_;
  const bool strict_;
  std::set<Digest> not_uploaded_;
};

}  // namespace

tl::expected<UploadedScene, Rejected> read_uploaded(const SubmitRequest& request, const BlobStore& blobs,
                                                    std::optional<std::uint32_t> frame, bool strict) {
  UploadedAssets assets(request.assets, blobs, strict);
  ReadResult read =
      read_scene(request.scene_name, request.scene_text, assets, {request.spec.defines, false, frame, true});
  if (!read.scene)
    return tl::unexpected(
        Rejected{{Errc::invalid_argument, fmt::format("the scene {} cannot be read", request.scene_name)},
                 std::move(read.diagnostics)});
  return UploadedScene{std::move(*read.scene), std::move(read.diagnostics), assets.text_bytes(),
                       assets.not_uploaded()};
}

}  // namespace ls::coordinator
