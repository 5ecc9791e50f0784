// Shared by the functions that translate pbrt's media. Each of them adds to the element of a medium, and
// returns false after it has reported an error of the medium.
#pragma once

#include "common/scene/pbrt/object_translation.h"

namespace ls::scene::pbrt {

// A directive MakeNamedMedium: the translation so far, its parameters, and the current transform.
struct MediumSource {
  Translation& t;
  Params& p;
  const Placed& ctm;

  bool wrong(const Span& at, std::string text) const {
    p.error(at, std::move(text));
    return false;
  }
};

// Absorption and scattering as extinction and albedo.
struct Coefficients {
  Rgb extinction{}, albedo{};
};
Coefficients coefficients(const Rgb& absorption, const Rgb& scattering);
Coefficients coefficients(MediumSource& m);  // from sigma_a and sigma_s
void add_albedo(MediumSource& m, Element& out, const Rgb& albedo);
// Adds the factor on the density of a `heterogeneous` medium: a number, and a tint if it differs by channel.
void add_extinction(MediumSource& m, Element& out, const Rgb& extinction);

// Measured coefficients of a substance, by the name that pbrt-v4 has for it.
struct Substance {
  std::string_view name;
  Rgb absorption, scattering;  // per mm; scattering is the reduced coefficient
};
const Substance* find_substance(std::string_view name);  // nullptr: there is none
std::vector<std::string> substance_names();

// The integral of the CIE observer's y over wavelengths in nm, as pbrt-v4 has it (CIE_Y_integral in
// src/pbrt/util/spectrum.h). pbrt divides the spectrum of a light by this integral, but neither the spectrum
// of a black body in a medium nor the Le of "rgbgrid" (GridMedium, NanoVDBMedium and RGBGridMedium in
// src/pbrt/media.h). Here a radiance of 1 at all wavelengths has luminance 1. So the luminance of these two
// in pbrt is kPhotometric times that of the same spectrum here.
inline constexpr double kPhotometric = 106.856895;

// Adds the parameters that turn the values of `temperature` into emission as in pbrt: `factor` times the
// spectrum, scaled to the peak 1, of a black body at (value - temperatureoffset) * temperaturescale kelvin.
bool add_black_bodies(MediumSource& m, Element& out, double factor);

// The grids' box in the medium's own coordinates.
struct Box {
  Vec3 low{{0, 0, 0}}, high{{1, 1, 1}};
};
bool read_box(MediumSource& m, Box& box);  // from p0 and p1
// How a grid fills its box. border: the outermost layer of voxels lies outside the box, all other voxels
// fill it. nodes: the outermost values lie on the faces of the box.
enum class Filling { border, nodes };
void add_volume(MediumSource& m, Element& out, const char* name, const std::string& file, const Box& box,
                Filling filling);
// Keeps the grid as a file and adds it as a volume.
bool add_grid(MediumSource& m, Element& out, const char* name, const MadeGrid& grid, const Box& box,
              Filling filling);

// grids.cpp
bool uniform_grid(MediumSource& m, Element& out);
bool rgb_grid(MediumSource& m, Element& out);

// cloud.cpp
bool cloud(MediumSource& m, Element& out);

}  // namespace ls::scene::pbrt
