// Decodes QOI, the "Quite OK Image" format, by its specification 1.0 (qoiformat.org).
#include <fmt/format.h>

#include <array>

#include "common/assets/bytes.h"
#include "common/assets/image.h"

namespace ls {
namespace {

using Rgba = std::array<std::uint8_t, 4>;  // red, green, blue, alpha

constexpr std::uint64_t kLongestRun = 62;  // largest number of pixels in a run, which is stored in one byte

class QoiDecoder {
 public:
  explicit QoiDecoder(ByteReader r) : r_(r) {}

  std::optional<Rgba> next() {
    if (run_ > 0) {
      --run_;
      return now_;
    }
    const auto head = r_.take<std::uint8_t>();
    if (!head || !step(*head)) return std::nullopt;
    seen_[(now_[0] * 3 + now_[1] * 5 + now_[2] * 7 + now_[3] * 11) % 64] = now_;
    return now_;
  }

 private:
  // Returns false if the data end.
  bool step(std::uint8_t head) {
    if (head >= 0xfe) return read_codes(head == 0xff ? 4 : 3);
    const int low = head & 63;
    switch (head >> 6) {
      case 0:
        now_ = seen_[static_cast<std::size_t>(low)];
        return true;
      case 1:
        change((low >> 4) - 2, (low >> 2 & 3) - 2, (low & 3) - 2);
        return true;
      case 2: {
        const auto more = r_.take<std::uint8_t>();
        const int green = low - 32;
        if (more) change(green + (*more >> 4) - 8, green, green + (*more & 15) - 8);
        return more.has_value();
      }
      default:
        run_ = low;  // `low` further pixels are equal to the current one
        return true;
    }
  }
  bool read_codes(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto code = r_.take<std::uint8_t>();
      if (!code) return false;
      now_[i] = *code;
    }
    return true;
  }
  void change(int red, int green, int blue) {  // the sums wrap around, modulo 256
    now_[0] = static_cast<std::uint8_t>(now_[0] + red);
    now_[1] = static_cast<std::uint8_t>(now_[1] + green);
    now_[2] = static_cast<std::uint8_t>(now_[2] + blue);
  }

  ByteReader r_;
  Rgba now_{0, 0, 0, 255};
  std::array<Rgba, 64> seen_{};
  int run_ = 0;
};

}  // namespace

Result<ImageData> decode_qoi(std::string_view name, std::span<const std::byte> file,
                             std::uint64_t max_pixels) {
  const auto bad = [&](std::string_view text) {
    return fail(Errc::invalid_argument, fmt::format("'{}': broken QOI image: {}", name, text));
  };
  ByteReader r(file);
  r.skip(4);
  const auto width = r.take<std::uint32_t>(true), height = r.take<std::uint32_t>(true);
  const auto channels = r.take<std::uint8_t>(), space = r.take<std::uint8_t>();
  if (!space || (*channels != 3 && *channels != 4) || *space > 1)
    return bad("its header is cut off or says what no QOI image does");
  if (*width < 1 || *height < 1 || *width > kMaxImageSide || *height > kMaxImageSide)
    return bad(fmt::format("its size is {} x {}", *width, *height));
  const std::uint64_t pixels = std::uint64_t{*width} * *height;
  if (pixels > max_pixels) return too_many_pixels(name, *width, *height, max_pixels);
  if (pixels / kLongestRun > r.left()) return bad("it is too short for its size");
  ImageData image{*width, *height, *channels, {}, {}, *space == 0};
  image.u8.resize(pixels * *channels);
  QoiDecoder decoder(r);
  for (std::uint64_t i = 0; i < pixels; ++i) {
    const auto codes = decoder.next();
    if (!codes) return bad("it is too short for its size");
    std::copy_n(codes->begin(), *channels, &image.u8[i * *channels]);
  }
  return image;
}

}  // namespace ls
