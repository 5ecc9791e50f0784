#include <algorithm>
#include <cctype>

#include "core/scene/schema/describe.h"

namespace ls::scene {
namespace {

using enum ImageColours;
constexpr Named<ImageColours> kOtherNames[] = {
    {"sRGB - Texture", srgb},
    {"srgb_tx", srgb},
    {"srgb_texture", srgb},
    {"Utility - sRGB - Texture", srgb},
    {"Input - Generic - sRGB - Texture", srgb},
    {"Linear Rec.709 (sRGB)", rec709},
    {"Linear Rec.709", rec709},
    {"lin_rec709_srgb", rec709},
    {"lin_rec709", rec709},
    {"lin_srgb", rec709},
    {"Utility - Linear - Rec.709", rec709},
    {"Utility - Linear - sRGB", rec709},
    {"Linear Rec.2020", rec2020},
    {"lin_rec2020", rec2020},
    {"Utility - Linear - Rec.2020", rec2020},
    {"Linear P3-D65", p3_d65},
    {"lin_p3d65", p3_d65},
    {"lin_displayp3", p3_d65},
    {"Linear Display P3", p3_d65},
    {"Utility - Linear - P3-D65", p3_d65},
    {"ACES - ACEScg", acescg},
    {"lin_ap1", acescg},
    {"ACES - ACES2065-1", aces2065_1},
    {"aces2065_1", aces2065_1},
    {"lin_ap0", aces2065_1},
    {"Linear AdobeRGB", adobe_linear},
    {"Gamma 1.8 Rec.709 - Texture", g18_rec709},
    {"g18_rec709_tx", g18_rec709},
    {"Utility - Gamma 1.8 - Rec.709 - Texture", g18_rec709},
    {"Gamma 2.2 Rec.709 - Texture", g22_rec709},
    {"g22_rec709_tx", g22_rec709},
    {"Utility - Gamma 2.2 - Rec.709 - Texture", g22_rec709},
    {"Gamma 2.4 Rec.709 - Texture", g24_rec709},
    {"g24_rec709_tx", g24_rec709},
    {"rec709_display", g24_rec709},
    {"Utility - Rec.709 - Display", g24_rec709},
    {"Gamma 2.2 AP1 - Texture", g22_ap1},
    {"g22_ap1_tx", g22_ap1},
    {"AdobeRGB", adobe},
    {"sRGB Encoded AP1 - Texture", srgb_ap1},
    {"srgb_encoded_ap1_tx", srgb_ap1},
    {"sRGB Encoded P3-D65 - Texture", srgb_p3_d65},
    {"srgb_encoded_p3d65_tx", srgb_p3_d65},
    {"srgb_displayp3", srgb_p3_d65},
    {"ACES - ACEScc", acescc},
    {"acescc_ap1", acescc},
    {"ACES - ACEScct", acescct},
    {"acescct_ap1", acescct},
};

bool same(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  return std::ranges::equal(a, b, {}, lower, lower);
}

}  // namespace

template <>
std::optional<ImageColours> also_named(std::string_view name) {
  for (const auto& [other, colours] : kOtherNames)
    if (same(name, other)) return colours;
  for (const auto& [own, colours] : NamesOf<ImageColours>::all)
    if (same(name, own)) return colours;
  return std::nullopt;
}

}  // namespace ls::scene
