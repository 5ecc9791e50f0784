// Partial EXRs, as workers and `lightshaft merge` hand them in: each alone, and all merged into a final EXR.
#include "core/image/film/partial.h"
#include "core/image/exr/exr_file.h"
#include "core/image/exr/final_image.h"
#include "core/image/film/merge.h"
#include "tests/fuzz/all_targets.h"
#include "worker/fake/fake_pixels.h"

namespace ls::fuzz {
namespace {

constexpr std::int64_t kMostPixels = 1 << 18;  // of a frame that is made a final image

std::vector<std::byte> copy_of(Bytes b) {
  const auto bytes = bytes_of(b);
  return {bytes.begin(), bytes.end()};
}

void check(const PartialFile& file) {
  const auto exr = encode_partial(file.partial, file.frame);
  must(exr.has_value(), "a partial that was read can be written");
  const auto again = decode_partial(*exr, file.partial.header, file.frame);
  must(again.has_value(), "a partial that was written can be read");
  must(unit_digest(*again) == unit_digest(file.partial), "a partial that was written reads back as it was");
}

}  // namespace

void partial(Bytes input) {
  std::vector<PartialSource> sources;
  bool small = true;
  for (const Bytes part : parts_of(input, 4)) {
    const auto file = decode_partial_file(bytes_of(part));
    if (file) check(*file);
    if (file) small = small && std::int64_t{file->frame.width} * file->frame.height <= kMostPixels;
    sources.push_back({"part", [part]() -> Result<std::vector<std::byte>> { return copy_of(part); }});
  }
  if (sources.size() == 1) (void)read_final_exr(bytes_of(input), "final");
  const auto merged = merge_partials(sources);
  if (!merged || !small) return;
  for (const bool as_float : {false, true}) {
    const auto image = final_exr(merged->film, {}, {.float_output = as_float});
    must(image && read_exr_rgb(image->exr, "final").has_value(), "a final image can be written and read");
    const auto back = read_final_exr(image->exr, "final");
    must(back && back->half == !as_float && back->size == merged->film.grid().frame,
         "a final image reads back as one");
  }
}

Seeds partial_seeds() {
  const auto exr = [](PixelRect rect, SampleRange samples, FrameSize frame) {
    const auto bytes =
        encode_partial(fake_partial({sha256("s"), sha256("t"), sha256("c"), rect, samples}), frame).value();
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  Film film({{4, 3}, 4});
  (void)film.fold(0, 0, fake_partial({{}, {}, {}, {0, 0, 4, 3}, {0, 2}}));
  const auto whole = [&](const ImageForm& form) {
    const auto bytes = final_exr(film, {{}, "{}", "b", {}, 1, 2, "clean"}, form).value().exr;
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  const std::string one = exr({0, 0, 4, 3}, {0, 2}, {4, 3});
  return {
      one, whole({}), whole({.compression = ExrCompression::dwaa, .parts = ExrParts::layers}),
      with_length(exr({0, 0, 4, 3}, {0, 2}, {6, 3})) + exr({4, 0, 6, 3}, {0, 2}, {6, 3}),
      with_length(one) + with_length(exr({0, 0, 4, 3}, {2, 4}, {4, 3})) + exr({0, 0, 4, 3}, {4, 6}, {4, 3})};
}

}  // namespace ls::fuzz
