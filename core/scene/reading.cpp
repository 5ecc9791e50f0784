#include "core/scene/reading.h"

#include <fmt/format.h>

#include "core/base/digest.h"

namespace ls {

Result<Asset> AssetSource::keep(std::string_view name, const std::string& bytes) {
  auto asset = find(name);
  if (!asset)
    return fail(
        asset.error().code,
        fmt::format(
            "the numbers here are a file \"{}\" of their own, which `lightshaft submit` sends along: {}",
            name, asset.error().message));
  if (asset->digest == sha256(bytes)) return asset;
  return fail(Errc::invalid_argument, fmt::format("the file \"{}\" that was sent along is not the one of the "
                                                  "numbers here: leave it to `lightshaft submit`",
                                                  name));
}

}  // namespace ls
