// Translates the objects of a pbrt file to elements in Mitsuba's format, with one .cpp file for each kind of
// object.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/made_files.h"
#include "formats/pbrt/parameters.h"
#include "formats/read.h"
#include "formats/xml/document.h"

namespace ls::scene::pbrt {

// A transform `to` and its inverse `from`. `from` is the product of the inverses of the steps (such as
// translations) that make up `to`, which is more exact than an inverse computed from `to`.
struct Placed {
  Transform to, from;
};
Placed then(const Placed& outer, const Placed& inner);  // returns the product that applies `inner` first
Placed moved(const Vec3& by);
Placed scaled(const Vec3& by);
Placed turned(double degrees, const Vec3& axis);
std::optional<Placed> looking(const Vec3& eye, const Vec3& target, const Vec3& up);
std::optional<Placed> of_columns(const std::vector<double>& m);  // 16 numbers of a matrix, column by column
// A transform split into a rigid part and a uniform scale. If the transform scales axes differently or
// shears, `rigid` is the whole transform and `scale` is 1.
struct Unscaled {
  Transform rigid;
  double scale = 1;
};
Unscaled without_scale(const Transform& t);

// A named texture. `value`: the colour of a constant texture; nullopt: the texture is the element with this
// `id`.
struct Texture {
  std::optional<Rgb> value;
  std::string id;
};
struct Material {
  std::string id;
  bool transmits = false, null = false;
  // True if the material has an image or a pattern, which depends on the shape's uv.
  bool has_texture = false;
  bool has_normal_map = false;
};
struct AreaLight {
  // The light's radiance, if `power` is nullopt. Otherwise the light's radiance is this colour times power /
  // (pi A), where A is the area of the shape's emitting sides.
  Rgb radiance;
  std::optional<double> power;
  bool two_sided = false;
  Span at;
};

// The state that AttributeBegin saves and AttributeEnd restores.
struct Attributes {
  Placed ctm, end_ctm;  // of the first and of the second of TransformTimes
  // Which of the two the transforms that follow change (ActiveTransform).
  bool at_start = true, at_end = true;
  bool reversed = false;
  ColourSpace space = ColourSpace::rec709;
  Material material;
  std::optional<AreaLight> light;
  std::string inside, outside;  // media on the surface's two sides, by name; empty: none
};

// The scene as translated so far.
struct Translation {
  AssetSource& assets;
  Report& report;
  Element scene;
  // exposure_factor: all light is multiplied by this number, which follows from the film's settings and the
  // camera's shutter. lit: true once a light has been multiplied by it.
  double exposure_factor = 1;
  bool lit = false;
  double exposure() {
    lit = true;
    return exposure_factor;
  }
  double start_time = 0, end_time = 1;  // TransformTimes
  bool moves = false;                   // true once a shape or an instance moves
  // As in pbrt, a texture of numbers and one of colours may have the same name.
  std::map<std::string, Texture> float_textures, colour_textures;
  std::map<std::string, Material> materials;

  // Gives a warning only once per scene.
  void warn_once(const Span& at, std::string text) { report.warning_once(at, std::move(text)); }
};

// What the numbers of an rgb mean: light; the share that a surface sends on, 0 to 1; or another property of
// matter, such as an absorption, without an upper limit.
enum class RgbOf { light, surface, matter };
// In colours.cpp: functions that return the colour that a parameter gives. nullopt: the value was reported as
// wrong. light_colour() gives lights the luminance that they have in pbrt: an rgb is relative to the white of
// its colour space, all other notations are scaled to luminance 1.
std::optional<Rgb> light_colour(Translation& t, const Param& p);
std::optional<Rgb> surface_colour(Translation& t, const Param& p, RgbOf meaning = RgbOf::surface);
// Returns the colour space of this name in any case; nullopt: pbrt has none of this name.
std::optional<ColourSpace> colour_space(std::string_view name);
// Returns the numbers of an rgb parameter, converted from its colour space to linear sRGB. Light keeps its X,
// Y, Z; a colour of matter is adapted to the white of sRGB, so that grey stays grey. What sRGB cannot hold is
// cut off, with a warning.
std::vector<double> srgb_numbers(Translation& t, const Param& p, RgbOf meaning);
// Takes the parameter `name`, the colour of a light. Returns white if it is not given or is wrong.
Rgb light_colour(Translation& t, Params& params, std::string_view name);

// Defined in textures.cpp.
enum class TextureOf { numbers, colours };
void add_texture(Translation& t, TextureOf what, const std::string& name, Params& p);
// Makes the texture known under this name without reporting an error if there is one already.
void set_texture(Translation& t, TextureOf what, const std::string& name, Texture texture);
// Returns the texture of this name, or one of the other kind if only this has the name. nullptr: none.
const Texture* find_texture(const Translation& t, TextureOf what, const std::string& name);
struct Names {
  std::string_view theirs, ours;
};
// Adds a parameter to `parent`, as a value or as a reference to a texture. `names`: its name in pbrt and in
// Mitsuba.
void add_value(Translation& t, Element& parent, Params& p, Names names, const Rgb& fallback);
// Like add_value(), but multiplies the value by `scale`. The parameter has the name `name` both in pbrt and
// in Mitsuba.
void add_scaled_value(Translation& t, Element& parent, Params& p, std::string_view name, const Rgb& fallback,
                      double scale);
void refer(Element& parent, std::string_view name, std::string id, const Span& at);

// In materials.cpp. Adds the material to the scene under this id. nullopt: it was reported as wrong.
std::optional<Material> add_material(Translation& t, const std::string& id, Params& p);

// Defined in lights.cpp.
void add_light(Translation& t, Params& p, const Placed& ctm);
AreaLight area_light(Translation& t, Params& p);

// Defined in media.cpp.
void add_medium(Translation& t, const std::string& name, Params& p, const Placed& ctm);
std::string medium_id(const std::string& name);

// In shapes.cpp. `in_object`: it stands in an ObjectBegin. nullopt: the shape was reported as wrong.
std::optional<Element> shape(Translation& t, Params& p, const Attributes& attributes, bool in_object);

// In camera.cpp. Adds an <animation> between two transforms.
void animate(Element& out, const std::pair<double, const Transform&>& start,
             const std::pair<double, const Transform&>& end, const Span& at);
// In shapes.cpp. Places a shape or an instance, which moves if its two transforms differ and it can. If it
// stands still for the reason `why_still`, or as its transforms do not let it move, a warning says so.
struct Way {
  Transform start, end;
};
void place_moving(Translation& t, Element& out, const Way& way, std::string_view why_still, const Span& at);

// In camera.cpp. The directives before WorldBegin that set up the camera and the rendering. nullopt: the file
// does not have the directive.
struct Settings {
  std::optional<Params> film, camera, filter, sampler, integrator;
  Placed camera_ctm, camera_end_ctm;
  double start_time = 0, end_time = 1;  // TransformTimes before the camera
  std::string camera_medium;
};
double exposure_of(Settings& s);  // returns the value for Translation::exposure_factor
void add_settings(Translation& t, Settings& s, const Span& file);

}  // namespace ls::scene::pbrt
