// Views by OpenColorIO: how linear colours look on a display. https://opencolorio.org
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace ls {

// The view without OpenColorIO: each channel through the curve of sRGB (IEC 61966-2-1).
inline constexpr std::string_view kPlainView = "sRGB";

// The transform of one view. Threads may share it.
class DisplayView {
 public:
  // Transforms linear colours of Rec. 709 (triples) into what the display is sent: from 0 to 1 within its
  // range, beyond where the view does not end there. Values that are not finite are brought into range first.
  void apply(std::span<float> rgb) const;
  // The same as 8-bit codes. Colours with a NaN are magenta, as in srgb8().
  std::vector<std::uint8_t> codes(std::span<const double> rgb) const;

  // A table of the transform for programs without OpenColorIO: float16 bits of R, G, B at kCubeSide^3
  // colours, R fastest. Along each axis place i stands for the light cube_light(i). Between them one
  // interpolates.
  static constexpr int kCubeSide = 65;
  static float cube_light(int place);
  std::vector<std::uint16_t> cube() const;

 private:
  friend class DisplayViews;
  struct Transform;
  std::shared_ptr<const Transform> transform_;
};

// The views of one OpenColorIO configuration. Their transforms are built when it is read.
class DisplayViews {
 public:
  // Reads a configuration (config.ocio, or what OpenColorIO's version reads besides). Its warnings are
  // logged. Error: it cannot be read, has no view, its first view cannot be shown, or it does not say where
  // linear Rec. 709 is in it.
  static Result<DisplayViews> read(const std::string& file);
  // The views that are built in, with the output transforms of ACES 1 as OpenColorIO has them.
  static Result<DisplayViews> built_in();
  // read() of the file that the environment variable OCIO names; built_in() if it is empty or not set.
  static Result<DisplayViews> of_environment();

  // "DISPLAY/VIEW", in the order of the configuration, after kPlainView.
  const std::vector<std::string>& names() const { return names_; }
  // The view that the configuration shows first; kPlainView for the built-in views.
  const std::string& standard() const { return standard_; }
  // The names of the views that cannot be shown, which names() lacks, and why: such as a missing file.
  const std::map<std::string, std::string>& left_out() const { return left_out_; }
  // Error: there is no such view, with the nearest name.
  Result<DisplayView> view(std::string_view name) const;

 private:
  struct Config;
  static DisplayViews of(const Config& config, std::string standard);
  std::vector<std::string> names_;
  std::vector<DisplayView> views_;  // of each name
  std::map<std::string, std::string> left_out_;
  std::string standard_;
};

}  // namespace ls
