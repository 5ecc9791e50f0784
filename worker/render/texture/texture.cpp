#include "worker/render/texture/texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/overloaded.h"
#include "core/scene/limits.h"
#include "core/scene/schema/texture_uses.h"
#include "worker/render/texture/texels.h"

namespace ls::render {

namespace {

struct UvAffine {
  float a = 1, b = 0, c = 0, d = 0, e = 1, f = 0;
  // Returns the transformed coordinates. A coordinate that is not finite becomes 0, so that lookups never see
  // NaN.
  V2 operator()(const V2& uv) const {
    const V2 p(a * uv.x + b * uv.y + c, d * uv.x + e * uv.y + f);
    return {std::isfinite(p.x) ? p.x : 0, std::isfinite(p.y) ? p.y : 0};
  }
};

Result<UvAffine> affine(const UvTransform& t) {
  for (int i = 0; i < 6; ++i)
    if (!std::isfinite(static_cast<float>(t.m[i])))
      return fail(Errc::invalid_argument, "a texture's to_uv has an entry that is not finite");
  const auto m = [&](int i) { return static_cast<float>(t.m[i]); };
  return UvAffine{m(0), m(1), m(2), m(3), m(4), m(5)};
}

enum class Kind : std::uint8_t { constant, bitmap, checkerboard, peak, hue, attribute, product };

struct Entry {
  Kind kind = Kind::constant;
  TextureFilter filter = TextureFilter::bilinear;
  Wrap wrap = Wrap::repeat;
  // Indices whose meaning depends on the kind. A bitmap: `first` is the index of its texels. A checkerboard
  // or a product: the indices of its two textures. A peak or a hue: `first` is the index of its texture. A
  // mesh attribute: `first` is the number of its name. If a bump map reads a bitmap, `second` is the index of
  // the texels of its heights.
  std::uint32_t first = 0, second = 0;
  C3 value{0, 0, 0};  // the value of a constant; for other textures the mean
  UvAffine to_uv;
  float scale = 1;  // mesh attribute: factor on its values; product: threshold of its luminance (0: none)
};

}  // namespace

struct TextureTable::Data {
  std::vector<Entry> entries;
  std::vector<Texels> texels;
  std::uint64_t clamped = 0;
  TextureTable::MeshData meshes;
};

namespace {

// Makes the texels of bitmaps. Bitmaps that read a file in the same way (Way) share their texels. A file is
// decoded once, even if bitmaps read it in several ways; the decoded image is freed after it was read in the
// last of these ways.
class TexelsLoader {
 public:
  TexelsLoader(const Scene& scene, const ImageLoader& load, TextureTable::Data& data)
      : scene_(scene), load_(load), data_(data), uses_(scene::texture_uses(scene)) {
    for (std::size_t i = 0; i < scene.textures.size(); ++i)
      if (const auto* b = std::get_if<BitmapTexture>(&scene.textures[i]))
        for (const Content content : contents_of(i))
          if (ways_.insert(way_of(*b, content)).second) ++left_[b->file.value];
  }

  // Returns the indices of the texels of texture i, the bitmap b: those that lookups read, and those that
  // slopes are taken of.
  Result<std::array<std::uint32_t, 2>> texels_of(std::size_t i, const BitmapTexture& b) {
    if (b.file.value >= scene_.assets.size())
      return fail(Errc::invalid_argument,
                  fmt::format("a bitmap names file {} of {}", b.file.value, scene_.assets.size()));
    std::array<std::uint32_t, 2> indices{};
    const std::vector<Content> contents = contents_of(i);
    for (std::size_t k = 0; k < contents.size(); ++k) {
      const auto made = made_of(b, contents[k]);
      if (!made) return tl::unexpected(made.error());
      indices[k] = *made;
    }
    if (contents.size() == 1) indices[1] = indices[0];
    return indices;
  }

 private:
  // Index of the asset, then raw, alpha, channel and colours of the bitmap, and as what it is read
  using Way = std::tuple<std::uint32_t, bool, bool, Channel, ImageColours, Content>;
  static Way way_of(const BitmapTexture& b, Content content) {
    return {b.file.value, b.raw, b.alpha, b.channel, b.colours, content};
  }

  // Returns as what texture i is read: by lookups and, if a bump map reads it too, as heights.
  std::vector<Content> contents_of(std::size_t i) const {
    const scene::TextureUse& use = uses_[i];
    const bool looked_up = use.colour || use.number || use.normals;
    std::vector<Content> contents;
    if (looked_up || !use.heights)
      contents.push_back(use.colour || !looked_up ? Content::colours : Content::numbers);
    if (use.heights) contents.push_back(Content::heights);
    return contents;
  }

  Result<std::uint32_t> made_of(const BitmapTexture& b, Content content) {
    const Way way = way_of(b, content);
    if (const auto it = made_.find(way); it != made_.end()) return it->second;
    const Asset& asset = scene_.assets[b.file.value];
    auto image = image_of(b.file.value, asset);
    if (!image) return tl::unexpected(image.error());
    if (!b.raw && b.channel == Channel::all) *image = with_colours(std::move(*image), b.colours);
    const bool is_bytes = image->f32.empty();
    auto texels = make_texels(asset.name, std::move(*image), b.raw, b.alpha, b.channel, content);
    if (!texels) return tl::unexpected(texels.error());
    data_.clamped += texels->clamped;
    data_.texels.push_back(std::move(*texels));
    const auto index = static_cast<std::uint32_t>(data_.texels.size() - 1);
    made_.emplace(way, index);
    // Bytes are neither negative nor of other colours, so that they are the same as whatever they are read.
    if (is_bytes)
      for (const Content other : {Content::colours, Content::numbers, Content::heights})
        if (made_.try_emplace(way_of(b, other), index).second && ways_.contains(way_of(b, other)) &&
            --left_[b.file.value] == 0)
          decoded_.erase(b.file.value);
    return index;
  }

  Result<ImageData> image_of(std::uint32_t file, const Asset& asset) {
    const bool last = --left_[file] == 0;
    auto decoded = decoded_.extract(file);
    Result<ImageData> image = decoded ? Result<ImageData>(std::move(decoded.mapped())) : load_(asset);
    if (image && !last) decoded_.emplace(file, *image);
    return image;
  }

  const Scene& scene_;
  const ImageLoader& load_;
  TextureTable::Data& data_;
  std::set<Way> ways_;                 // in which bitmaps read files
  std::map<std::uint32_t, int> left_;  // by file: number of ways in which it is still to be read
  std::map<std::uint32_t, ImageData> decoded_;
  std::map<Way, std::uint32_t> made_;
  std::vector<scene::TextureUse> uses_;  // by texture
};

// Makes the entry of a mesh_attribute texture; if no mesh has the attribute, the entry is a black constant.
// Such an entry is never evaluated, because Geometry::build rejects meshes that use the texture but lack the
// attribute.
Result<Entry> attribute_entry(const MeshAttributeTexture& t, const SurfaceAttributes* attributes) {
  Entry e;
  e.kind = Kind::attribute;
  e.scale = static_cast<float>(t.scale);
  if (!(e.scale >= 0) || !std::isfinite(e.scale))
    return fail(Errc::invalid_argument,
                fmt::format("the scale {} of mesh attribute \"{}\" is not a number >= 0", t.scale, t.name));
  if (!attributes) return e;
  const auto it = attributes->names.find(t.name);
  if (it == attributes->names.end()) return Entry{};
  e.first = it->second;
  e.value = attributes->means[e.first] * e.scale;
  return e;
}

C3 cut(const C3& product, float threshold) {
  return threshold > 0 ? C3(luminance(product) >= threshold ? 1.f : 0.f) : product;
}
// The mean of a product that is cut. What is cut at the mean would be 0 if less than the threshold passes on
// average, and lights of this texture would be left out although parts of them shine: so the share that
// passes is taken to be the mean of the product.
C3 mean_of_cut(const C3& mean, float threshold) {
  return threshold > 0 ? C3(std::min(luminance(mean), 1.f)) : mean;
}
C3 peak_of(const C3& c) {
  const float peak = std::max({c.x, c.y, c.z});
  return {peak, peak, peak};
}
C3 hue_of(const C3& c) {
  const float peak = std::max({c.x, c.y, c.z});
  return peak > 0 ? C3(c.x / peak, c.y / peak, c.z / peak) : C3(1, 1, 1);
}

// Computes the means of textures that contain other textures from the means of those. Textures that are
// nested n deep need n passes. If the depth of some texture still changes in the last pass, textures contain
// each other in a cycle or are nested deeper than kMaxReferenceDepth.
Result<void> resolve_nested(TextureTable::Data& data) {
  std::vector<int> depth(data.entries.size(), 0);
  for (int pass = 0; pass <= scene::kMaxReferenceDepth; ++pass) {
    bool changed = false;
    for (std::size_t i = 0; i < data.entries.size(); ++i) {
      Entry& e = data.entries[i];
      int d = 1;
      if (e.kind == Kind::checkerboard) {
        e.value = (data.entries[e.first].value + data.entries[e.second].value) * .5f;
        d += std::max(depth[e.first], depth[e.second]);
      } else if (e.kind == Kind::peak || e.kind == Kind::hue) {
        const C3& inner = data.entries[e.first].value;
        e.value = e.kind == Kind::peak ? peak_of(inner) : hue_of(inner);
        d += depth[e.first];
      } else if (e.kind == Kind::product) {
        e.value = mean_of_cut(data.entries[e.first].value * data.entries[e.second].value, e.scale);
        d += std::max(depth[e.first], depth[e.second]);
      } else {
        continue;
      }
      changed |= d != depth[i];
      depth[i] = d;
    }
    if (!changed) return {};
  }
  return fail(Errc::invalid_argument,
              fmt::format("textures contain each other in a circle, or more than {} deep",
                          scene::kMaxReferenceDepth));
}

enum class Read { colour, number };

const Entry& leaf(const TextureTable::Data& data, const Entry* e, const V2& uv, Read as) {
  while (e->kind == Kind::checkerboard) {
    const V2 p = e->to_uv(uv);
    const bool right = p.x - std::floor(p.x) > .5f, lower = p.y - std::floor(p.y) > .5f;
    e = &data.entries[(right == lower) == (as == Read::colour) ? e->first : e->second];
  }
  return *e;
}

// Returns the value of a texture of any kind but checkerboards. It recurses as deep as textures are nested,
// at most kMaxReferenceDepth levels.
C3 value_of(const TextureTable& table, const Entry& t, const V2& uv, const FacePoint* face) {
  if (t.kind == Kind::peak) return peak_of(table.eval({t.first}, uv, face));
  if (t.kind == Kind::hue) return hue_of(table.eval({t.first}, uv, face));
  if (t.kind == Kind::product)
    return cut(table.eval({t.first}, uv, face) * table.eval({t.second}, uv, face), t.scale);
  if (t.kind == Kind::attribute) {
    const TextureTable::MeshData& meshes = table.data().meshes;
    return face && meshes.attributes ? meshes.attributes->value(t.first, *face, meshes.corners) * t.scale
                                     : C3(0);
  }
  return t.kind == Kind::constant ? t.value
                                  : table.data().texels[t.first].lookup(t.to_uv(uv), t.filter, t.wrap);
}

}  // namespace

TextureTable::TextureTable() : data_(std::make_unique<Data>()) {}
TextureTable::~TextureTable() = default;
TextureTable::TextureTable(TextureTable&&) noexcept = default;
TextureTable& TextureTable::operator=(TextureTable&&) noexcept = default;

Result<TextureTable> TextureTable::build(const Scene& scene, const ImageLoader& load, MeshData meshes) {
  TextureTable table;
  Data& data = *table.data_;
  data.meshes = meshes;
  TexelsLoader loader(scene, load, data);
  const auto constant = [](const ConstantTexture& t) -> Result<Entry> {
    Entry e;
    e.value = {static_cast<float>(t.value[0]), static_cast<float>(t.value[1]),
               static_cast<float>(t.value[2])};
    if (!is_finite(e.value))
      return fail(Errc::invalid_argument, "a constant texture has a value that is not finite");
    return e;
  };
  const auto bitmap = [&](const BitmapTexture& t) -> Result<Entry> {
    const auto to_uv = affine(t.to_uv);
    if (!to_uv) return tl::unexpected(to_uv.error());
    const auto texels = loader.texels_of(data.entries.size(), t);
    if (!texels) return tl::unexpected(texels.error());
    const auto [looked_up, heights] = *texels;
    return Entry{Kind::bitmap, t.filter, t.wrap, looked_up, heights, data.texels[looked_up].mean, *to_uv};
  };
  const auto checkerboard = [&](const CheckerboardTexture& t) -> Result<Entry> {
    const auto to_uv = affine(t.to_uv);
    if (!to_uv) return tl::unexpected(to_uv.error());
    if (std::max(t.color0.value, t.color1.value) >= scene.textures.size())
      return fail(Errc::invalid_argument, "a checkerboard names a texture that does not exist");
    return Entry{Kind::checkerboard, {}, {}, t.color0.value, t.color1.value, {0, 0, 0}, *to_uv};
  };
  const auto peak = [&](const PeakTexture& t) -> Result<Entry> {
    if (t.texture.value >= scene.textures.size())
      return fail(Errc::invalid_argument, "a texture \"peak\" names a texture that does not exist");
    return Entry{t.hue ? Kind::hue : Kind::peak, {}, {}, t.texture.value, 0, {0, 0, 0}, {}};
  };
  const auto product = [&](const ProductTexture& t) -> Result<Entry> {
    if (std::max(t.first.value, t.second.value) >= scene.textures.size())
      return fail(Errc::invalid_argument, "a texture \"product\" names a texture that does not exist");
    const auto threshold = static_cast<float>(t.threshold);
    if (!(threshold >= 0) || !std::isfinite(threshold))
      return fail(Errc::invalid_argument,
                  fmt::format("the threshold {} of a product is not a number >= 0", t.threshold));
    return Entry{Kind::product, {}, {}, t.first.value, t.second.value, {0, 0, 0}, {}, threshold};
  };
  const auto attribute = [&](const MeshAttributeTexture& t) { return attribute_entry(t, meshes.attributes); };
  for (const Texture& t : scene.textures) {
    auto entry = std::visit(overloaded{constant, bitmap, checkerboard, peak, attribute, product}, t);
    if (!entry) return tl::unexpected(entry.error());
    data.entries.push_back(*entry);
  }
  if (auto ok = resolve_nested(data); !ok) return tl::unexpected(ok.error());
  return table;
}

C3 TextureTable::eval(TextureIndex i, V2 uv, const FacePoint* face) const {
  const Entry* e = &data_->entries[i.value];
  if (e->kind == Kind::constant) return e->value;
  return value_of(*this, leaf(*data_, e, uv, Read::colour), uv, face);
}

float TextureTable::number(TextureIndex i, V2 uv, const FacePoint* face) const {
  const C3 c = value_of(*this, leaf(*data_, &data_->entries[i.value], uv, Read::number), uv, face);
  return c.x == c.y && c.y == c.z ? c.x : luminance(c);
}

V2 TextureTable::slope(TextureIndex i, V2 uv) const {
  const Entry& e = data_->entries[i.value];
  if (e.kind != Kind::bitmap || e.filter != TextureFilter::bilinear) return {0, 0};
  const V2 s = data_->texels[e.second].slope(e.to_uv(uv), e.wrap);
  return {e.to_uv.a * s.x + e.to_uv.d * s.y, e.to_uv.b * s.x + e.to_uv.e * s.y};
}

double TextureTable::aspect(TextureIndex i) const {
  const Entry& e = data_->entries[i.value];
  if (e.kind != Kind::bitmap) return 1;
  const Texels& t = data_->texels[e.first];
  return static_cast<double>(t.width) / t.height;
}

bool TextureTable::is_constant(TextureIndex i) const {
  return data_->entries[i.value].kind == Kind::constant;
}
C3 TextureTable::constant(TextureIndex i) const { return data_->entries[i.value].value; }
C3 TextureTable::mean(TextureIndex i) const { return data_->entries[i.value].value; }
std::size_t TextureTable::size() const { return data_->entries.size(); }
std::uint64_t TextureTable::clamped_texels() const { return data_->clamped; }

std::uint64_t TextureTable::bytes() const {
  std::uint64_t n = 0;
  for (const Texels& t : data_->texels) n += t.u8.size() + t.f32.size() * sizeof(float);
  return n;
}

}  // namespace ls::render
