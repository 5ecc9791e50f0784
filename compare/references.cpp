#include "compare/references.h"

#include <fmt/format.h>

#include "common/image/exr/exr_file.h"

namespace ls::race {

Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size) {
  if (const auto sound = read_picture(exr, size); !sound) return tl::unexpected(sound.error());
  const auto bytes = read_exr_bytes(exr);
  if (!bytes) return tl::unexpected(bytes.error());
  auto picture = ls::read_reference(*bytes, exr.string(), size);
  if (!picture) return tl::unexpected(picture.error());
  return ReferenceFile{exr.filename().string(), std::move(*picture)};
}

Reference combine(const std::vector<ReferenceFile>& files) {
  Reference out{files[0].picture.rgb, {}};
  if (files.size() > 1) {
    out.second = files[1].picture.rgb;
    return out;
  }
  const std::vector<float>& error = files[0].picture.error;
  out.second.resize(error.size());
  for (std::size_t i = 0; i < error.size(); ++i) {
    out.second[i] = out.first[i] - error[i];
    out.first[i] += error[i];
  }
  return out;
}

std::string describe(const std::vector<ReferenceFile>& files) {
  if (files.size() > 1)
    return fmt::format("{} and {}, two independent references", files[0].name, files[1].name);
  if (files[0].picture.error.empty())
    return fmt::format("{}, whose own noise counts as everybody's error", files[0].name);
  return fmt::format("{}, less its own noise by its layers of errors", files[0].name);
}

}  // namespace ls::race
