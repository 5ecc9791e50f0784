// The packets are those of tev's include/tev/Ipc.h: the length of the packet in bytes, itself included, as
// 32 bits; one byte for the kind; its fields. Numbers are little endian, texts end with a zero, and a truth
// is a byte.
#include "cli/farm/tev.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>

#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"
#include "core/image/exr/pixel_layers.h"

namespace ls::cli {
namespace {

using coordinator::rejected;
using nlohmann::json;

static_assert(std::endian::native == std::endian::little);

enum class Kind : std::uint8_t { create_image = 4, update_image = 6 };

class Packet {
 public:
  // Both kinds begin with whether tev shall show the image at once, and its name.
  Packet(Kind kind, bool shown, std::string_view image) {
    number(std::uint32_t{0});
    number(kind);
    number(std::uint8_t{shown});
    text(image);
  }
  template <class T>
  void number(T value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void text(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    bytes_.push_back(std::byte{0});
  }
  void channels(const std::vector<std::string>& names) {
    number(static_cast<std::int32_t>(names.size()));
    for (const std::string& name : names) text(name);
  }
  void floats(std::span<const float> values) {
    const auto bytes = std::as_bytes(values);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte> finish() {
    const auto length = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &length, sizeof length);
    return std::move(bytes_);
  }

 private:
  std::vector<std::byte> bytes_;
};

// Creates the image, or replaces the one of this name.
std::vector<std::byte> create_image(std::string_view image, FrameSize size,
                                    const std::vector<std::string>& channels) {
  Packet packet(Kind::create_image, true, image);
  packet.number(std::int32_t{size.width});
  packet.number(std::int32_t{size.height});
  packet.channels(channels);
  return packet.finish();
}

// `values`: row by row, the channels of a pixel are adjacent.
std::vector<std::byte> update_image(std::string_view image, const std::vector<std::string>& channels,
                                    const PixelRect& rect, std::span<const float> values) {
  Packet packet(Kind::update_image, false, image);
  packet.channels(channels);
  for (const int number : {rect.x0, rect.y0, rect.width(), rect.height()})
    packet.number(std::int32_t{number});
  for (std::size_t c = 0; c < channels.size(); ++c) packet.number(static_cast<std::int64_t>(c));  // offsets
  for (std::size_t c = 0; c < channels.size(); ++c)
    packet.number(static_cast<std::int64_t>(channels.size()));  // strides
  packet.floats(values);
  return packet.finish();
}

constexpr double kMaxSide = 65536;  // of an image, in pixels

}  // namespace

Result<Tev> Tev::open(const std::string& address) {
  const auto peer = parse_host_port(address);
  if (!peer) return bad_argument("--tev: " + peer.error().message);
  auto connection = TcpConnection::open(*peer);
  if (!connection)
    return fail(connection.error().code,
                fmt::format("tev cannot be reached at {}: {}; start it, or say with --tev=HOST:PORT where it "
                            "listens (its --host)",
                            address, connection.error().message));
  return Tev(std::move(*connection));
}

FarmApi::Answer<void> Tev::send(const std::vector<std::byte>& packet) {
  const auto sent = connection_.send(packet);
  return sent ? FarmApi::Answer<void>() : rejected({sent.error().code, "tev: " + sent.error().message});
}

FarmApi::Answer<void> Tev::show(FarmApi& api, const json& job, bool all_layers) {
  const std::string id = text_field(job, "id");
  const json* frames = object_field(job, "frames");
  const int frame = frames ? int_field(*frames, "current", 0) : 0;
  const std::string of_frame = frames ? fmt::format("?frame={}", frame) : "";
  const auto answer = api.get(job_path(id) + "/layers" + of_frame);
  if (!answer) return tl::unexpected(answer.error());
  const auto size = pair_field(*answer, "size");
  std::vector<Layer> layers;
  std::vector<std::string> channels;
  for (const json& layer : objects_field(*answer, "layers")) {
    const std::string name = text_field(layer, "name");
    if (name != "rgb" && !all_layers) continue;
    layers.push_back({name, {}, text_field(layer, "format") == "half"});
    for (const std::string& channel : texts_field(layer, "channels"))
      layers.back().channels.push_back((name == "rgb" ? "" : name + ".") + channel);
    channels.insert(channels.end(), layers.back().channels.begin(), layers.back().channels.end());
  }
  if (!size ||
      !(size->first >= 1 && size->first <= kMaxSide && size->second >= 1 && size->second <= kMaxSide) ||
      channels.empty())
    return rejected({Errc::internal, "the coordinator does not say what layers the image has"});
  const FrameSize pixels{static_cast<int>(size->first), static_cast<int>(size->second)};
  const std::string image = plain_text(
      fmt::format("{} {}{}", text_field(job, "name"), id, frames ? fmt::format(" {}", frame) : ""));
  auto packet = create_image(image, pixels, channels);
  // The same image again is only updated: tev then keeps how a person looks at it.
  if (const std::string created(reinterpret_cast<const char*>(packet.data()), packet.size());
      created != created_) {
    if (auto sent = send(packet); !sent) return sent;
    created_ = created;
  }
  const std::string path = job_path(id) + "/pixels" + (frames ? of_frame + "&" : "?");
  for (const Layer& layer : layers)
    if (auto sent = show_layer(api, path, image, layer, pixels); !sent) return sent;
  return {};
}

FarmApi::Answer<void> Tev::show_layer(FarmApi& api, const std::string& path, const std::string& image,
                                      const Layer& layer, FrameSize size) {
  const PixelLayer form{.half = layer.half};
  for (int y = 0; y < size.height; y += kMaxLayerSide)
    for (int x = 0; x < size.width; x += kMaxLayerSide) {
      const PixelRect rect{x, y, std::min(x + kMaxLayerSide, size.width),
                           std::min(y + kMaxLayerSide, size.height)};
      const auto bytes = api.text(fmt::format("{}layer={}&rect={},{},{},{}", path, percent_encode(layer.name),
                                              rect.x0, rect.y0, rect.x1, rect.y1));
      if (!bytes) return tl::unexpected(bytes.error());
      const auto values = layer_floats(form, std::as_bytes(std::span(*bytes)));
      if (values.size() != layer.channels.size() * static_cast<std::size_t>(rect.pixels()))
        return rejected({Errc::internal, "the coordinator sent pixels of another number"});
      if (auto sent = send(update_image(image, layer.channels, rect, values)); !sent) return sent;
    }
  return {};
}

}  // namespace ls::cli
