#include "formats/gltf/buffers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "core/base/safe_text.h"
#include "core/scene/limits.h"
#include "formats/xml/document.h"

namespace ls::scene::gltf {
namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Decodes base64 (RFC 4648), with or without the padding. nullopt: the text is not base64.
std::optional<std::string> decode_base64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  if (text.size() % 4 == 1) return std::nullopt;
  std::array<int, 256> value;
  value.fill(-1);
  for (std::size_t i = 0; i < kDigits.size(); ++i)
    value[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
  std::string out;
  out.reserve(text.size() / 4 * 3 + 2);
  unsigned bits = 0;
  int held = 0;
  for (const char c : text) {
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) return std::nullopt;
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffff;
    held += 6;
    if (held < 8) continue;
    held -= 8;
    out += static_cast<char>(bits >> held & 0xff);
  }
  return out;
}

// True if the name can be written to XML and JSON and read back unchanged.
bool is_name(const std::string& name) {
  const bool is_text = std::min(find_invalid_utf8(name), find_control(name)) == std::string::npos;
  return is_text && !name.empty() && name.find_first_of("\t\r\n") == std::string::npos;
}

// True for "https://...", false for "C:/..." and "a:b".
bool has_scheme(std::string_view uri) {
  const auto colon = uri.find("://");
  return colon != std::string_view::npos && colon > 1;
}

}  // namespace

std::optional<Uri> read_uri(const Item& uri) {
  const std::string given = uri.text("");
  if (given.starts_with("data:")) {
    const auto comma = given.find(',');
    const bool is_base64 = comma != std::string::npos && given.substr(0, comma).ends_with(";base64");
    auto bytes = is_base64 ? decode_base64(std::string_view(given).substr(comma + 1)) : std::nullopt;
    if (bytes) return Uri{true, std::move(*bytes)};
    return uri.refuse("this data URI is broken: only base64 is read, as in \"data:image/png;base64,...\"");
  }
  if (has_scheme(given))
    return uri.refuse("nothing is fetched from elsewhere: put the file beside this one, and name it");
  auto name = percent_decode(given);
  if (name && is_name(*name)) return Uri{false, std::move(*name)};
  return uri.refuse("this names no file");
}

namespace {

// Largest length, offset or count that is accepted; in glTF they have at most 32 bits.
constexpr std::size_t kMost = (std::size_t{1} << 32) - 1;

struct Component {
  std::size_t code, bytes;
};
constexpr Component kComponents[] = {{5120, 1}, {5121, 1}, {5122, 2}, {5123, 2}, {5125, 4}, {5126, 4}};
constexpr std::size_t kFloat = 5126;

constexpr std::pair<std::string_view, std::size_t> kTypes[] = {
    {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};

template <class Stored>
Stored stored(const char* at) {
  Stored x;
  std::memcpy(&x, at, sizeof x);
  return x;
}

// Reads a component (one number of an element) at `at`. `code` is the componentType of glTF. If `normalised`,
// an integer is divided by the largest value of its type.
double component(const char* at, std::size_t code, bool normalised) {
  const auto scaled = [&](double x, double most) { return normalised ? std::max(x / most, -1.) : x; };
  switch (code) {
    case 5120:
      return scaled(stored<std::int8_t>(at), 127);
    case 5121:
      return scaled(stored<std::uint8_t>(at), 255);
    case 5122:
      return scaled(stored<std::int16_t>(at), 32767);
    case 5123:
      return scaled(stored<std::uint16_t>(at), 65535);
    case 5125:
      return scaled(stored<std::uint32_t>(at), 4294967295.);
    default:
      return double{stored<float>(at)};
  }
}

}  // namespace

// The type of the elements of an accessor, and their position in a buffer: the component type of glTF
// (`code`), the bytes of a component (`bytes`), the components per element (`width`), the number of elements
// (`count`), and the bytes from one element to the next (`stride`).
struct Buffers::Layout {
  std::size_t code = kFloat, bytes = 4, width = 1, count = 0, stride = 0;
  bool normalised = false;
  // The bytes of the buffer view from the first element on. Empty: there is no buffer view, and all elements
  // are 0.
  std::string_view data;
  std::size_t element() const { return bytes * width; }
};

std::optional<std::string_view> Buffers::buffer(const Item& index) {
  const Item buffer = index.in(root_["buffers"]);
  if (!buffer.given()) return std::nullopt;
  const auto known = read_.find(buffer.identity());
  if (known != read_.end())
    return known->second ? std::optional<std::string_view>(*known->second) : std::nullopt;
  std::optional<std::string>& bytes = read_[buffer.identity()];
  const auto length = buffer["byteLength"].whole(1, kMost);
  if (!length) return buffer.refuse("a buffer needs its byteLength");
  const Item uri = buffer["uri"];
  if (uri.given()) {
    auto read = read_uri(uri);
    if (!read) return std::nullopt;
    if (read->is_data) {
      bytes = std::move(read->text);
    } else {
      auto file = assets_.text(join_path("", read->text));
      if (!file) return uri.refuse(file.error().message);
      bytes = std::move(*file);
    }
  } else if (chunk_) {
    bytes = std::string(*chunk_);
  } else {
    return buffer.refuse(
        "this buffer has no uri: only the first of a .glb may have none, whose bytes follow its JSON");
  }
  total_bytes_ += bytes->size();
  if (bytes->size() < *length)
    buffer["byteLength"].error(
        fmt::format("{} bytes are announced, but there are {}: the file is cut off, or it is another one",
                    *length, bytes->size()));
  else if (total_bytes_ > kMaxTotalTextBytes)
    buffer.error(
        fmt::format("the buffers have more than {} MiB together: split the scene", kMaxTotalTextBytes >> 20));
  else
    return std::string_view(*bytes).substr(0, *length);
  bytes.reset();
  return std::nullopt;
}

std::optional<std::string_view> Buffers::view(const Item& index) {
  const Item view = index.in(root_["bufferViews"]);
  if (!view.given()) return std::nullopt;
  if (!view["buffer"].given()) return view.refuse("a buffer view needs its buffer");
  const auto bytes = buffer(view["buffer"]);
  if (!bytes) return std::nullopt;
  const std::size_t offset = view["byteOffset"].whole(0, kMost).value_or(0);
  const std::size_t length = view["byteLength"].whole(0, kMost).value_or(0);
  if (offset + length <= bytes->size()) return bytes->substr(offset, length);
  return view.refuse(fmt::format("bytes {} to {} are beyond its buffer, which has {}", offset,
                                 offset + length, bytes->size()));
}

// Returns the layout of `count` elements in the buffer view of `owner`, which is an accessor, or the indices
// or values of a sparse accessor. The type of the elements is taken from `like`. If `strided`, the distance
// between elements is the byteStride of the buffer view, if it has one. nullopt: the buffer view is wrong or
// too short for the elements; an error has been reported.
std::optional<Buffers::Layout> Buffers::layout_in(const Item& owner, Layout like, std::size_t count,
                                                  bool strided) {
  const auto bytes = view(owner["bufferView"]);
  if (!bytes) return std::nullopt;
  like.count = count;
  like.stride = like.element();
  const Item stride = owner["bufferView"].in(root_["bufferViews"])["byteStride"];
  if (strided && stride.given()) {
    const auto given = stride.whole(like.element(), 252);
    if (!given) return std::nullopt;
    like.stride = *given;
  }
  const std::size_t offset = owner["byteOffset"].whole(0, kMost).value_or(0);
  const std::size_t end = offset + (count - 1) * like.stride + like.element();
  if (end > bytes->size())
    return owner.refuse(fmt::format("{} elements end at byte {}, beyond the buffer view, which has {}", count,
                                    end, bytes->size()));
  like.data = bytes->substr(offset);
  return like;
}

std::optional<Buffers::Layout> Buffers::layout(const Item& accessor) {
  Layout out;
  const auto code = accessor["componentType"].whole(5120, kFloat);
  const auto* component = std::find_if(std::begin(kComponents), std::end(kComponents),
                                       [&](const Component& c) { return code == c.code; });
  const std::string name = accessor["type"].text("");
  const auto* type =
      std::find_if(std::begin(kTypes), std::end(kTypes), [&](const auto& t) { return t.first == name; });
  const auto count = accessor["count"].whole(1, kMost);
  if (component == std::end(kComponents) || type == std::end(kTypes) || !count)
    return accessor.refuse(
        "an accessor needs a componentType of 5120 to 5126, a type such as \"VEC3\", and a count");
  out.code = component->code;
  out.bytes = component->bytes;
  out.width = type->second;
  out.normalised = accessor["normalized"].is_true(false);
  if (accessor["bufferView"].given()) return layout_in(accessor, out, *count, true);
  out.count = *count;
  empty_elements_ += *count;
  if (empty_elements_ <= kMaxGltfEmptyCount) return out;
  return accessor.refuse(fmt::format(
      "elements without a buffer view, which are all 0: at most {} of a file are read", kMaxGltfEmptyCount));
}

template <class T>
std::optional<std::vector<T>> Buffers::read(const Item& accessor, const Layout& from) {
  read_numbers_ += from.count * from.width;
  if (read_numbers_ > kMaxGltfNumbers)
    return accessor.refuse(
        fmt::format("accessors of more than {} numbers in all are read: split the scene", kMaxGltfNumbers));
  std::vector<T> out(from.count * from.width);
  for (std::size_t i = 0; i < from.count && !from.data.empty(); ++i)
    for (std::size_t k = 0; k < from.width; ++k)
      out[i * from.width + k] = static_cast<T>(
          component(from.data.data() + i * from.stride + k * from.bytes, from.code, from.normalised));
  const Item sparse = accessor["sparse"];
  if (sparse.given() && !read_sparse(sparse, from, out)) return std::nullopt;
  return out;
}

template <class T>
bool Buffers::read_sparse(const Item& sparse, const Layout& like, std::vector<T>& out) {
  const auto count = sparse["count"].whole(1, like.count);
  const Item where = sparse["indices"];
  const auto code = where["componentType"].whole(5121, 5125);
  if (!count || !code || *code == 5122 || *code == 5124)
    return sparse.error(
               "a sparse accessor needs a count, and indices whose componentType is 5121, 5123 or 5125"),
           false;
  Layout index;
  index.code = *code;
  index.bytes = *code == 5121 ? 1 : *code == 5123 ? 2 : 4;
  const auto places = layout_in(where, index, *count, false);
  const auto values = layout_in(sparse["values"], like, *count, false);
  if (!places || !values) return false;
  for (std::size_t i = 0; i < *count; ++i) {
    const auto at =
        static_cast<std::size_t>(component(places->data.data() + i * places->stride, places->code, false));
    if (at >= like.count)
      return where.error(fmt::format("number {} is {}, but the accessor has {} elements", i, at, like.count)),
             false;
    for (std::size_t k = 0; k < like.width; ++k)
      out[at * like.width + k] = static_cast<T>(component(
          values->data.data() + i * values->stride + k * values->bytes, values->code, values->normalised));
  }
  return true;
}

std::optional<Numbers<float>> Buffers::floats(const Item& index,
                                              std::initializer_list<std::string_view> types) {
  const Item accessor = index.in(root_["accessors"]);
  if (!accessor.given()) return std::nullopt;
  const auto from = layout(accessor);
  if (!from) return std::nullopt;
  if (std::find(types.begin(), types.end(), accessor["type"].text("")) == types.end())
    return accessor["type"].refuse(fmt::format("{} is wanted for this use", fmt::join(types, " or ")));
  auto values = read<float>(accessor, *from);
  if (!values) return std::nullopt;
  const auto bad = std::find_if(values->begin(), values->end(), [](float x) { return !std::isfinite(x); });
  if (bad != values->end())
    return accessor.refuse(fmt::format("element {} is not a finite number",
                                       static_cast<std::size_t>(bad - values->begin()) / from->width));
  return Numbers<float>{from->width, std::move(*values)};
}

std::optional<std::vector<std::uint32_t>> Buffers::indices(const Item& index) {
  const Item accessor = index.in(root_["accessors"]);
  if (!accessor.given()) return std::nullopt;
  const auto from = layout(accessor);
  if (!from) return std::nullopt;
  if (from->width == 1 && (from->code == 5121 || from->code == 5123 || from->code == 5125) &&
      !from->normalised)
    return read<std::uint32_t>(accessor, *from);
  return accessor.refuse("indices are of type SCALAR and of componentType 5121, 5123 or 5125");
}

}  // namespace ls::scene::gltf
