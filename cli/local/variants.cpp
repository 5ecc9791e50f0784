#include "cli/local/variants.h"

namespace ls::cli {
namespace {

Result<std::uint64_t> read(const Result<InstructionCounter>& counter) {
  if (!counter) return tl::unexpected(counter.error());
  return counter->read();
}

}  // namespace

VariantBitsList measure_variants(const std::vector<std::string>& names, double paths,
                                 const Result<InstructionCounter>& counter,
                                 const std::function<Digest(const std::string&)>& render) {
  VariantBitsList out;
  for (const std::string& name : names) {
    const auto before = read(counter);
    VariantBits v{name, render(name), std::nullopt};
    const auto after = read(counter);
    if (before && after && *after > *before)
      v.instructions = static_cast<double>(*after - *before) / paths;
    else if (out.uncounted.empty())
      out.uncounted = !before  ? before.error().message
                      : !after ? after.error().message
                               : "the counter of instructions stands still";
    out.all.push_back(std::move(v));
  }
  return out;
}

}  // namespace ls::cli
