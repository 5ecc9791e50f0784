#include "util/display/display_views.h"

#include <Imath/half.h>
#include <OpenColorIO/OpenColorIO.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>

#include "core/base/light/colour_space.h"
#include "core/base/log.h"
#include "core/base/text/suggest.h"
#include "core/image/exr/final_image.h"

namespace OCIO = OCIO_NAMESPACE;

namespace ls {
namespace {

// Largest float16. Values beyond would become infinite inside of some transforms, and then NaN.
constexpr float kLargest = 65504;

OCIO::MatrixTransformRcPtr from_rec709_to(ColourSpace space) {
  const ColourMatrix m = from_rec709(space);
  std::array<double, 16> rows{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) rows[4 * r + c] = m(r, c);
  rows[15] = 1;
  auto out = OCIO::MatrixTransform::Create();
  out->setMatrix(rows.data());
  return out;
}

// The start of a transform: from linear Rec. 709 to the colour space `space` of a configuration.
struct Entry {
  OCIO::MatrixTransformRcPtr matrix;  // null: the space is linear Rec. 709 itself
  std::string space;
};

// Names of linear Rec. 709 in configurations that are in use (those of ACES, Blender, AgX), without case,
// spaces and punctuation.
constexpr std::array<std::string_view, 9> kNamesOfRec709 = {
    "linrec709",  "linearrec709", "linearrec709srgb",  "utilitylinearrec709", "linsrgb",
    "linearsrgb", "srgblinear",   "utilitylinearsrgb", "linearbt709"};

bool names_rec709(const char* name) {
  std::string plain;
  for (; *name != 0; ++name) {
    const auto c = static_cast<unsigned char>(*name);
    if (std::isalnum(c) != 0) plain += static_cast<char>(std::tolower(c));
  }
  return std::find(kNamesOfRec709.begin(), kNamesOfRec709.end(), plain) != kNamesOfRec709.end();
}

std::optional<Entry> entry_of(const OCIO::Config& config) {
  // Inactive ones too, which menus hide and transforms can use.
  const int spaces = config.getNumColorSpaces(OCIO::SEARCH_REFERENCE_SPACE_ALL, OCIO::COLORSPACE_ALL);
  for (int i = 0; i < spaces; ++i) {
    const char* name =
        config.getColorSpaceNameByIndex(OCIO::SEARCH_REFERENCE_SPACE_ALL, OCIO::COLORSPACE_ALL, i);
    const auto space = config.getColorSpace(name);
    bool found = names_rec709(name);
    for (std::size_t k = 0; k < space->getNumAliases(); ++k) found |= names_rec709(space->getAlias(k));
    if (found) return Entry{nullptr, name};
  }
  if (const auto space = config.getColorSpace("aces_interchange"))
    return Entry{from_rec709_to(ColourSpace::aces2065_1), space->getName()};
  if (const auto space = config.getColorSpace("cie_xyz_d65_interchange"))
    return Entry{from_rec709_to(ColourSpace::xyz), space->getName()};
  return std::nullopt;
}

// The names are those of the configurations of ACES, so that a view keeps its name when one of these is used
// instead.
OCIO::ConfigRcPtr built_in_config() {
  const auto builtin = [](const char* style) {
    auto t = OCIO::BuiltinTransform::Create();
    t->setStyle(style);
    return t;
  };
  auto config = OCIO::Config::Create();
  config->setVersion(2, 1);
  auto aces = OCIO::ColorSpace::Create();
  aces->setName("ACES2065-1");
  config->addColorSpace(aces);
  config->setRole("aces_interchange", "ACES2065-1");
  config->setRole(OCIO::ROLE_SCENE_LINEAR, "ACES2065-1");
  config->setRole(OCIO::ROLE_DEFAULT, "ACES2065-1");

  const auto add_view = [&](const char* name, const char* style) {
    auto view = OCIO::ViewTransform::Create(OCIO::REFERENCE_SPACE_SCENE);
    view->setName(name);
    view->setTransform(builtin(style), OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE);
    config->addViewTransform(view);
  };
  constexpr const char *kAces = "ACES 1.0 - SDR Video", *kNone = "Un-tone-mapped",
                       *kHdr = "ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)";
  add_view(kNone, "UTILITY - ACES-AP0_to_CIE-XYZ-D65_BFD");
  add_view(kAces, "ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0");
  add_view(kHdr, "ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - HDR-VIDEO-1000nit-15nit-REC2020lim_1.1");
  config->setDefaultViewTransformName(kNone);

  const auto add_display = [&](const char* name, const char* style, const char* view) {
    auto display = OCIO::ColorSpace::Create(OCIO::REFERENCE_SPACE_DISPLAY);
    display->setName(name);
    display->setTransform(builtin(style), OCIO::COLORSPACE_DIR_FROM_REFERENCE);
    config->addColorSpace(display);
    for (const char* shown : {view, kNone}) config->addDisplayView(name, shown, shown, name, "", "", "");
  };
  add_display("sRGB - Display", "DISPLAY - CIE-XYZ-D65_to_sRGB", kAces);
  add_display("Rec.1886 Rec.709 - Display", "DISPLAY - CIE-XYZ-D65_to_REC.1886-REC.709", kAces);
  add_display("P3-D65 - Display", "DISPLAY - CIE-XYZ-D65_to_G2.6-P3-D65", kAces);
  add_display("Rec.2100-PQ - Display", "DISPLAY - CIE-XYZ-D65_to_REC.2100-PQ", kHdr);
  return config;
}

std::string name_of(const std::string& display, const std::string& view) { return display + "/" + view; }

}  // namespace

struct DisplayView::Transform {
  OCIO::ConstCPUProcessorRcPtr processor;  // null: kPlainView
};

void DisplayView::apply(std::span<float> rgb) const {
  if (rgb.empty()) return;  // which OpenColorIO refuses
  for (float& v : rgb) v = std::isnan(v) ? 0 : std::clamp(v, -kLargest, kLargest);
  if (!transform_->processor) {
    for (float& v : rgb) v = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
    return;
  }
  OCIO::PackedImageDesc pixels(rgb.data(), static_cast<long>(rgb.size() / 3), 1, 3);
  transform_->processor->apply(pixels);
}

std::vector<std::uint8_t> DisplayView::codes(std::span<const double> rgb) const {
  std::vector<std::uint8_t> out(rgb.size());
  if (!transform_->processor) {
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      const auto code = srgb8(&rgb[i], 1);
      std::copy(code.begin(), code.end(), &out[i]);
    }
    return out;
  }
  std::vector<float> values(rgb.begin(), rgb.end());
  apply(values);
  for (std::size_t i = 0; i < rgb.size(); ++i)
    out[i] = static_cast<std::uint8_t>(std::lround(255 * (values[i] > 0 ? std::min(values[i], 1.f) : 0.f)));
  for (std::size_t i = 0; i < rgb.size(); i += 3)
    if (std::isnan(rgb[i]) || std::isnan(rgb[i + 1]) || std::isnan(rgb[i + 2]))
      out[i] = 255, out[i + 1] = 0, out[i + 2] = 255;
  return out;
}

// Steps of a quarter of a stop above 1/256, equal steps of light far below, and 0 exactly.
float DisplayView::cube_light(int place) {
  return static_cast<float>((std::exp2(16. * place / (kCubeSide - 1)) - 1) / 256);
}

std::vector<std::uint16_t> DisplayView::cube() const {
  std::vector<float> rgb;
  rgb.reserve(std::size_t{3} * kCubeSide * kCubeSide * kCubeSide);
  for (int b = 0; b < kCubeSide; ++b)
    for (int g = 0; g < kCubeSide; ++g)
      for (int r = 0; r < kCubeSide; ++r)
        for (const int place : {r, g, b}) rgb.push_back(cube_light(place));
  apply(rgb);
  std::vector<std::uint16_t> bits(rgb.size());
  std::transform(rgb.begin(), rgb.end(), bits.begin(), [](float v) {
    return Imath::half(std::isnan(v) ? 0 : std::clamp(v, -kLargest, kLargest)).bits();
  });
  return bits;
}

struct DisplayViews::Config {
  OCIO::ConstConfigRcPtr config;
  Entry entry;
};

DisplayViews DisplayViews::of(const Config& config, std::string standard) {
  DisplayViews views;
  views.standard_ = std::move(standard);
  const auto add = [&](std::string name, DisplayView::Transform transform) {
    views.names_.push_back(std::move(name));
    DisplayView view;
    view.transform_ = std::make_shared<const DisplayView::Transform>(std::move(transform));
    views.views_.push_back(std::move(view));
  };
  add(std::string(kPlainView), {});
  const OCIO::Config& c = *config.config;
  for (int d = 0; d < c.getNumDisplays(); ++d) {
    const std::string display = c.getDisplay(d);
    for (int v = 0; v < c.getNumViews(display.c_str()); ++v) {
      const std::string view = c.getView(display.c_str(), v);
      auto shown = OCIO::DisplayViewTransform::Create();
      shown->setSrc(config.entry.space.c_str());
      shown->setDisplay(display.c_str());
      shown->setView(view.c_str());
      auto all = OCIO::GroupTransform::Create();
      if (config.entry.matrix) all->appendTransform(config.entry.matrix);
      all->appendTransform(shown);
      try {
        add(name_of(display, view),
            {c.getProcessor(all)->getOptimizedCPUProcessor(OCIO::BIT_DEPTH_F32, OCIO::BIT_DEPTH_F32,
                                                           OCIO::OPTIMIZATION_DEFAULT)});
      } catch (const OCIO::Exception& e) {
        views.left_out_.emplace(name_of(display, view), e.what());
      }
    }
  }
  return views;
}

Result<DisplayViews> DisplayViews::built_in() {
  try {
    const auto config = built_in_config();
    config->validate();
    return of({config, *entry_of(*config)}, std::string(kPlainView));
  } catch (const OCIO::Exception& e) {
    return fail(Errc::internal, fmt::format("the built-in views: {}", e.what()));
  }
}

Result<DisplayViews> DisplayViews::read(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return bad_argument(fmt::format("{}: there is no such file with a configuration of OpenColorIO", file));
  OCIO::SetLoggingFunction([](const char* message) {
    std::string_view text = message;
    while (!text.empty() && text.back() == '\n') text.remove_suffix(1);
    log_warn("", text);
  });
  try {
    // Not validate(): it refuses all views for one missing file that a single view needs.
    const auto config = OCIO::Config::CreateFromFile(file.c_str());
    auto entry = entry_of(*config);
    if (!entry)
      return bad_argument(fmt::format(
          "{}: the configuration does not say where linear Rec. 709 is: give it the role aces_interchange or "
          "cie_xyz_d65_interchange, or a colour space with the name or alias \"Linear Rec.709\"",
          file));
    const char* display = config->getDefaultDisplay();
    const char* view = config->getDefaultView(display);
    if (*display == 0 || *view == 0)
      return bad_argument(fmt::format("{}: the configuration has no display with a view", file));
    auto views = of({config, std::move(*entry)}, name_of(display, view));
    if (const auto first = views.left_out_.find(views.standard_); first != views.left_out_.end())
      return bad_argument(
          fmt::format("{}: its first view, '{}', cannot be shown: {}", file, first->first, first->second));
    return views;
  } catch (const OCIO::Exception& e) {
    return bad_argument(
        fmt::format("{}: OpenColorIO {} cannot use it: {}", file, OCIO::GetVersion(), e.what()));
  }
}

Result<DisplayViews> DisplayViews::of_environment() {
  const char* file = std::getenv("OCIO");
  return file == nullptr || *file == 0 ? built_in() : read(file);
}

Result<DisplayView> DisplayViews::view(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end())
    return bad_argument(fmt::format("there is no view '{}'{}", name, suggestion(name, names_)));
  return views_[static_cast<std::size_t>(found - names_.begin())];
}

}  // namespace ls
