// The path tracers with Features::reuse. They take long to compile, so they have their own source file.
#include "worker/render/integrator/variant.h"

namespace ls::render {
namespace {

constexpr Features kAllSplit{.media = true, .chromatic = true, .passing = true, .split = true, .reuse = true};

}  // namespace

std::span<const Variant> reuse_variants() {
  static constexpr Variant kVariants[] = {
      group_variant<Features{.passing = true, .reuse = true}>("surfaces, tails shared"),
      group_variant<Features{.media = true, .passing = true, .reuse = true}>(
          "homogeneous grey media, tails shared"),
      group_variant<Features{.media = true, .chromatic = true, .passing = true, .reuse = true}>(
          "homogeneous chromatic media, tails shared"),
  };
  return kVariants;
}

const Variant kReuseSplitVariant =
    group_variant<kAllSplit>("homogeneous media, tails shared, and light in parts");

}  // namespace ls::render
