#include "util/protocol/briefs.h"

#include <algorithm>

#include "util/protocol/limits.h"

namespace ls {
namespace {
// For the members of fixed size and the containers around them; for a job and for one of its files
constexpr std::size_t kJobBytes = 256, kFileBytes = 64;
}  // namespace

std::size_t memory_of(const JobBrief& brief) {
  std::size_t bytes = kJobBytes + brief.needs.size() + canonical_json(brief.settings).size();
  // A name is truncated on its way to the worker (proto/farm.proto)
  for (const BlobRef& file : brief.assets)
    bytes += kFileBytes + std::min(file.name.size(), limits::kNameBytes);
  return bytes;
}

}  // namespace ls
