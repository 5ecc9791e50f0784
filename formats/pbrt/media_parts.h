// Shared by the functions that translate pbrt's media. The functions add parameters to `out`, the element of
// the translated medium. Those that return bool return false if the medium is wrong, which has been reported.
#pragma once

#include "formats/pbrt/object_translation.h"

namespace ls::scene::pbrt {

// A directive MakeNamedMedium that is being translated: the scene as translated so far, the directive's
// parameters, and the current transform.
struct MediumSource {
  Translation& t;
  Params& p;
  const Placed& ctm;

  bool wrong(const Span& at, std::string text) const {
    p.error(at, std::move(text));
    return false;
  }
};

// The extinction and albedo of a medium, computed from its absorption and scattering.
struct Coefficients {
  Rgb extinction{}, albedo{};
};
Coefficients coefficients(const Rgb& absorption, const Rgb& scattering);
Coefficients coefficients(MediumSource& m);  // reads sigma_a and sigma_s
void add_albedo(MediumSource& m, Element& out, const Rgb& albedo);
// Adds the factor by which the density of a medium `heterogeneous` is multiplied: the number `scale`, and the
// colour `tint` if the factor differs between channels.
void add_extinction(MediumSource& m, Element& out, const Rgb& extinction);

// Measured coefficients of a substance. `name` is pbrt-v4's name for the substance.
struct Substance {
  std::string_view name;
  Rgb absorption, scattering;  // in 1/mm; `scattering` is the reduced scattering coefficient
};
const Substance* find_substance(std::string_view name);  // nullptr: there is none
std::vector<std::string> substance_names();

// The integral of the CIE observer's y over wavelengths in nm, with pbrt-v4's value (CIE_Y_integral in
// src/pbrt/util/spectrum.h). pbrt divides the spectrum of a light by it, so that a radiance of 1 at all
// wavelengths has luminance 1, as it always has here. But pbrt divides neither the spectrum of a black body
// in a medium nor the Le of "rgbgrid" (GridMedium, NanoVDBMedium and RGBGridMedium in src/pbrt/media.h). So
// these two have kPhotometric times the luminance in pbrt that the same spectrum has here.
inline constexpr double kPhotometric = 106.856895;

// Adds the parameters that turn the values of `temperature` into emission as in pbrt: `factor` times the
// spectrum, scaled to the peak 1, of a black body at (value - temperatureoffset) * temperaturescale kelvin.
bool add_black_bodies(MediumSource& m, Element& out, double factor);

// The box that a medium's grids fill, in the medium's own coordinates.
struct Box {
  Vec3 low{{0, 0, 0}}, high{{1, 1, 1}};
};
bool read_box(MediumSource& m, Box& box);  // reads p0 and p1
// Stores the grid as a file, and adds it to `out` as the volume `name`. The outermost layer of voxels lies
// outside of the box, which all other voxels fill.
bool add_grid(MediumSource& m, Element& out, const char* name, const MadeGrid& grid, const Box& box);

// These two are in grids.cpp. Each translates a medium type of pbrt: "uniformgrid" and "rgbgrid".
bool uniform_grid(MediumSource& m, Element& out);
bool rgb_grid(MediumSource& m, Element& out);

}  // namespace ls::scene::pbrt
