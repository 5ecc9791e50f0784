// Translates textures, and values that are the product of a factor and textures.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/gltf/buffers.h"
#include "formats/gltf/translation.h"
#include "formats/made_files.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::gltf {
namespace {

constexpr std::string_view kPng = "\x89PNG", kJpeg = "\xff\xd8\xff";

// Returns the file name extension for an image file with these bytes. Empty: they are neither a PNG nor a
// JPEG file.
std::string_view ending_of(std::string_view bytes) {
  return bytes.starts_with(kPng) ? ".png" : bytes.starts_with(kJpeg) ? ".jpg" : "";
}

bool is_image_name(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.ends_with(".png") || name.ends_with(".jpg") || name.ends_with(".jpeg");
}

// Returns the name of an image's file; empty: it cannot be read, which has been reported.
std::string read_image(Translation& t, const Item& image) {
  const Item uri = image["uri"];
  std::string held;
  std::string_view bytes;
  if (uri.given()) {
    auto read = read_uri(uri);
    if (!read) return {};
    if (!read->is_data) {
      if (is_image_name(read->text)) return read->text;
      uri.error(fmt::format("\"{}\" is no PNG or JPEG by its name, and others are not read: convert it",
                            read->text));
      return {};
    }
    held = std::move(read->text);
    bytes = held;
  } else if (image["bufferView"].given()) {
    const auto view = t.buffers.view(image["bufferView"]);
    if (!view) return {};
    bytes = *view;
  } else {
    image.error("an image needs a uri or a bufferView");
    return {};
  }
  const std::string_view ending = ending_of(bytes);
  if (ending.empty()) {
    image.error(
        "these bytes are no PNG and no JPEG, and other images are not read (KTX2, WebP, AVIF): convert it");
    return {};
  }
  auto kept = keep_made(t.assets, "image", ending, std::string(bytes));
  if (kept) return std::move(*kept);
  image.error(kept.error().message);
  return {};
}

std::string image_of(Translation& t, const Item& texture) {
  if (!texture["source"].given()) {
    texture.error(
        "this texture has no source that is read: images in KTX2 (KHR_texture_basisu), WebP or AVIF are not, "
        "so convert them to PNG or JPEG");
    return {};
  }
  const Item image = texture["source"].in(t.root["images"]);
  if (!image.given()) return {};
  const auto known = t.images.find(image.identity());
  if (known != t.images.end()) return known->second;
  return t.images[image.identity()] = read_image(t, image);
}

// glTF's wrap modes: 10497 repeats, 33071 clamps to the edge, 33648 mirrors.
void add_sampler(Translation& t, const Item& sampler, Element& out) {
  const double s = sampler["wrapS"].number(10497), v = sampler["wrapT"].number(10497);
  if (s != v) t.warn_once(sampler, "wrapT is read as if it were the same as wrapS");
  if (s == 33071) add(out, "string", "wrap_mode", "clamp", out.at);
  if (s == 33648) add(out, "string", "wrap_mode", "mirror", out.at);
  if (sampler["magFilter"].number(9729) == 9728) add(out, "string", "filter_type", "nearest", out.at);
}

// Adds the transform of (u, v) that the extension KHR_texture_transform gives: it scales, then rotates
// counter-clockwise (as seen with v pointing down), then translates.
void add_to_uv(const Item& transform, Element& out) {
  if (!transform.given()) return;
  const auto move = transform["offset"].numbers<2>({0, 0}), scale = transform["scale"].numbers<2>({1, 1});
  const double angle = transform["rotation"].number(0), c = std::cos(angle), s = std::sin(angle);
  const Transform m{{c * scale[0], s * scale[1], 0, move[0],   //
                     -s * scale[0], c * scale[1], 0, move[1],  //
                     0, 0, 1, 0, 0, 0, 0, 1}};
  if (m != Transform{}) scene::add_transform(out, nullptr, "to_uv", {matrix_step(m.m, out.at)});
}

std::string_view channel_of(Part part) {
  static constexpr std::pair<Part, std::string_view> kChannels[] = {
      {Part::red, "red"}, {Part::green, "green"}, {Part::blue, "blue"}, {Part::alpha, "alpha"}};
  for (const auto& [one, name] : kChannels)
    if (one == part) return name;
  return "";
}

Element named(Element e, std::string_view name, const Span& at) {
  set(e, "name", std::string(name), at);
  return e;
}

}  // namespace

std::size_t uv_set(const Item& info) {
  const Item own = info.extension("KHR_texture_transform")["texCoord"];
  return (own.given() ? own : info["texCoord"]).whole(0, 7).value_or(0);
}

std::optional<Element> texture(Translation& t, const Item& info, Part part) {
  if (!info.given()) return std::nullopt;
  if (!info["index"].given()) return info.refuse("this needs the index of a texture");
  const Item texture = info["index"].in(t.root["textures"]);
  if (!texture.given()) return std::nullopt;
  const std::string file = image_of(t, texture);
  if (file.empty()) return std::nullopt;
  Element out = made("texture", "bitmap", info.at());
  add(out, "string", "filename", file, out.at);
  if (part != Part::colour) add(out, "boolean", "raw", "true", out.at);
  if (const auto channel = channel_of(part); !channel.empty())
    add(out, "string", "channel", std::string(channel), out.at);
  add_sampler(t, texture["sampler"].in(t.root["samplers"]), out);
  add_to_uv(info.extension("KHR_texture_transform"), out);
  return out;
}

Source number_source(Translation& t, const Item& factor, double fallback, const Item& info, Part part) {
  const double x = share(factor.number(fallback));
  Source out{{x, x, x}, {}};
  if (auto image = x != 0 ? texture(t, info, part) : std::nullopt) out.images.push_back(std::move(*image));
  return out;
}

Source colour_source(Translation& t, const std::array<double, 3>& factor, const Item& info) {
  Source out{factor, {}};
  const bool is_black = factor == std::array<double, 3>{0, 0, 0};
  if (auto image = is_black ? std::nullopt : texture(t, info, Part::colour))
    out.images.push_back(std::move(*image));
  return out;
}

// A product of several images, or of images and a factor, becomes nested textures "product" of two members
// each. From the outermost to the innermost their members are the factor (if it is not 1), then the images
// from the last to the first.
void give(Element& parent, std::string_view name, const Source& source, const Span& at, double threshold) {
  if (source.is_constant()) {
    const Rgb& c = source.factor;
    if (is_grey(c)) return add(parent, std::string(name), c[0], at);
    return add(parent, std::string(name), c, at);
  }
  if (source.images.size() == 1 && source.is_factor_one() && threshold == 0)
    return add(parent, named(source.images[0], name, at));
  Source rest = source;
  Element product = made("texture", "product", at);
  if (threshold > 0) add(product, "threshold", threshold, at);
  if (!source.is_factor_one() || source.images.size() == 1) {
    give(product, "first", Source{source.factor, {}}, at);
    rest.factor = {1, 1, 1};
  } else {
    add(product, named(rest.images.back(), "first", at));
    rest.images.pop_back();
  }
  give(product, "second", rest, at);
  add(parent, named(std::move(product), name, at));
}

double share(double x) {
  if (x > 1 && x <= 1 + kSingle) return 1;
  return x < 0 && x >= -kSingle ? 0 : x;
}

Element vertex_attribute(std::string_view name, const Span& at) {
  Element out = made("texture", "mesh_attribute", at);
  add(out, "string", "name", std::string(name), at);
  return out;
}

}  // namespace ls::scene::gltf
