#include "formats/pbrt/vocabulary.h"

#include <algorithm>

namespace ls::scene::pbrt {
namespace {

using Words = std::vector<Word>;
constexpr auto kIgnored = Word::Use::ignored;
constexpr auto kRefused = Word::Use::refused;
constexpr std::string_view kColour = "rgb|spectrum|blackbody";
constexpr std::string_view kTextured = "rgb|spectrum|blackbody|texture";
constexpr std::string_view kNumber = "float|texture";
constexpr std::string_view kRemap =
    "true: alpha is the square root of the roughness; false: the roughness is alpha itself";
constexpr std::string_view kSampling = "it only affects sampling, which Lightshaft chooses itself";

Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Words camera_words() {
  return {{"shutteropen", "float", "0", "see shutterclose"},
          {"shutterclose", "float", "1",
           "all light is multiplied by shutterclose - shutteropen; a camera can move between them"},
          {"frameaspectratio", "float", "that of the film",
           "width divided by height of the visible area; the pixels of `perspective` must be square"},
          {"screenwindow", "float", "-1 to 1 along the shorter side of the frame",
           "x0 x1 y0 y1: the part of the plane that the frame shows; `fov` alone shows [-1, 1]. The pixels "
           "of `perspective` must be square (to 0.1 %)"}};
}

Words film_words() {
  return {
      {"xresolution", "integer", "1280", "pixels"},
      {"yresolution", "integer", "720", "pixels"},
      {"cropwindow", "float", "the whole frame", "x0 x1 y0 y1 as fractions of the frame"},
      {"pixelbounds", "integer", "the whole frame", "x0 x1 y0 y1 in pixels"},
      {"iso", "float", "100", "all light is multiplied by iso / 100"},
      {"exposuretime", "float", "1", "multiplies all light; only in older versions of pbrt-v4"},
      {"sensor", "string", "cie1931", "other values cause a warning: colours stay those of the CIE observer"},
      {"whitebalance", "float", "0", "balance the image afterwards", kRefused},
      {"maxcomponentvalue", "float", "", "samples are not clamped, because clamping darkens the image",
       kIgnored},
      {"diagonal", "float", "35", "it only affects lenses of the camera \"realistic\"", kIgnored},
      {"filename", "string", "", "the command line or the job chooses where the image is written", kIgnored},
      {"coordinatesystem", "string", "camera", "AOVs are in world coordinates", kIgnored},
      {"nbuckets", "integer", "16", "spectral rendering is not supported", kIgnored},
      {"lambdamin", "float", "360", "spectral rendering is not supported", kIgnored},
      {"lambdamax", "float", "830", "spectral rendering is not supported", kIgnored},
      {"savefp16", "bool", "true", "the output format is chosen by the command line or the job", kIgnored}};
}

Words shape_words() { return {{"alpha", kNumber, "1", "opacity: a mask around the material"}}; }

constexpr std::string_view kImageOfAlpha =
    "roughness in both directions; an image only with remaproughness false";

Words remapped(std::string_view roughness) {
  return {{"roughness", kNumber, "0", roughness},
          {"uroughness", kNumber, "roughness", "along u"},
          {"vroughness", kNumber, "roughness", "along v"},
          {"remaproughness", "bool", "true", kRemap}};
}

Words material_words() {
  return {{"normalmap", "string", "", "an image of normals: a normalmap around it"},
          {"displacement", "texture", "", "an image of heights: a bumpmap around it"}};
}

Words layer_words() {
  return {{"thickness", "float", "0.01", "without absorption it has no effect", kIgnored},
          {"maxdepth", "integer", "10", "reflections within the coat are never cut off", kIgnored},
          {"nsamples", "integer", "1", kSampling, kIgnored},
          {"g", "float", "0", "belongs to a medium in the coat, which is not read", kIgnored},
          {"albedo", kTextured, "0", "a medium within the coat is not supported", kRefused}};
}

Words light_words(std::string_view colour) {
  return {{colour, kColour, "the white of sRGB", "colour"}, {"scale", "float", "1", "factor"}};
}
const Word kPower{"power", "float", "", "luminous power; it replaces the brightness of the colour"};

Words coefficient_words() {
  return {{"sigma_a", kColour, "1", "absorption per scene unit"},
          {"sigma_s", kColour, "1", "scattering per scene unit"},
          {"g", "float", "0", "mean cosine of Henyey-Greenstein"}};
}
Words medium_words() {
  return coefficient_words() + Words{{"scale", "float", "1", "multiplies sigma_a and sigma_s"}};
}
Words temperature_words() {
  return {{"temperaturescale", "float", "1",
           "multiplies the temperature after temperatureoffset is subtracted; at least 0"},
          {"temperatureoffset", "float", "temperaturecutoff", "subtracted from the values of the grid"},
          {"temperaturecutoff", "float", "0", "another name for temperatureoffset"}};
}
Words box_words() {
  return {{"nx", "integer", "1", "number of values along x, which varies fastest"},
          {"ny", "integer", "1", "number of values along y"},
          {"nz", "integer", "1", "number of values along z"},
          {"p0", "point3", "0 0 0", "corner of the box"},
          {"p1", "point3", "1 1 1", "corner of the box"}};
}

Words mapping_words() {
  return {{"mapping", "string", "uv", "only uv is read"},
          {"uscale", "float", "1", "multiplies u"},
          {"vscale", "float", "1", "multiplies v"},
          {"udelta", "float", "0", "added to u"},
          {"vdelta", "float", "0", "added to v"}};
}

Words integrator_words() {
  return {{"maxdepth", "integer", "5", "number of scatterings; max_depth is one more"},
          {"lightsampler", "string", "bvh", kSampling, kIgnored},
          {"rrthreshold", "float", "1", kSampling, kIgnored},
          {"sampleLights", "bool", "true", kSampling, kIgnored},
          {"samplelights", "bool", "true", kSampling, kIgnored},
          {"samplebsdf", "bool", "true", kSampling, kIgnored},
          {"samplebsdfs", "bool", "true", kSampling, kIgnored},
          {"regularize", "bool", "false", "rough surfaces are never made smoother or rougher", kIgnored}};
}

constexpr std::string_view kOtherMethod = "`volpath`, with a warning: another method, the same image";
constexpr std::string_view kCount = "only the number of samples is read; Lightshaft chooses the sampler";

void add_settings(std::vector<Row>& r) {
  r.push_back({"Film", "rgb", true, "size, crop and exposure of the image", film_words()});
  for (const auto type : {"gbuffer", "spectral", "image"})
    r.push_back({"Film", type, true, "like `rgb`; --aov chooses further layers", film_words()});
  r.push_back({"Camera", "perspective", true, "a `perspective` camera, or a `thinlens`",
               Words{{"fov", "float", "90", "degrees, along the shorter side of the frame"},
                     {"lensradius", "float", "0", "radius of the lens"},
                     {"focaldistance", "float", "1e6", "distance of the plane in focus"},
                     {"halffov", "float", "", "half of fov; it replaces fov"}} +
                   camera_words()});
  r.push_back({"Camera", "orthographic", true,
               "an `orthographic` camera; the shorter side of the frame shows [-1, 1]",
               Words{{"lensradius", "float", "0", "only `perspective` can have a lens", kRefused},
                     {"focaldistance", "float", "", "see lensradius", kRefused}} +
                   camera_words()});
  r.push_back(
      {"Camera", "realistic", false, "lens systems are not supported: write it as \"perspective\"", {}});
  r.push_back({"Camera", "spherical", true, "a `spherical` camera, if its mapping is equirectangular",
               Words{{"mapping", "string", "equalarea", "only equirectangular is supported"},
                     {"lensradius", "float", "0", "it has no lens", kIgnored},
                     {"focaldistance", "float", "", "it has no lens", kIgnored},
                     {"fov", "float", "", "it sees all directions", kIgnored}} +
                   camera_words()});
  const Words radii{{"xradius", "float", "", "half width in pixels"},
                    {"yradius", "float", "xradius", "half height; it must be equal to the half width"}};
  r.push_back({"PixelFilter", "box", true, "`box`; its radius is 0.5 if none is given", radii});
  r.push_back({"PixelFilter", "triangle", true, "`tent`; its radius is 2 if none is given", radii});
  r.push_back(
      {"PixelFilter", "gaussian", true,
       "`gaussian` of that sigma, cut off at 4 sigma (pbrt: at its radius); the filter if none is given",
       Words{{"sigma", "float", "0.5", "standard deviation in pixels"},
             {"alpha", "float", "", "pbrt-v3's alpha is 1 / (2 sigma^2): give sigma", kRefused},
             {"xradius", "float", "1.5", "it is cut off at 4 sigma", kIgnored},
             {"yradius", "float", "1.5", "it is cut off at 4 sigma", kIgnored}}});
  constexpr std::string_view kGaussian = "a Gaussian is used instead";
  for (const auto type : {"mitchell", "sinc"})
    r.push_back({"PixelFilter",
                 type,
                 true,
                 "`gaussian` of sigma 0.5, with a warning: filters with negative lobes are not supported",
                 {{"xradius", "float", "", kGaussian, kIgnored},
                  {"yradius", "float", "", kGaussian, kIgnored},
                  {"B", "float", "", kGaussian, kIgnored},
                  {"C", "float", "", kGaussian, kIgnored},
                  {"tau", "float", "", kGaussian, kIgnored}}});
  for (const auto type : {"independent", "halton", "paddedsobol", "zsobol", "sobol", "pmj02bn", "02sequence",
                          "lowdiscrepancy", "random", "maxmindist"})
    r.push_back({"Sampler",
                 type,
                 true,
                 kCount,
                 {{"pixelsamples", "integer", "16", "samples per pixel"},
                  {"randomization", "string", "", kSampling, kIgnored},
                  {"dimensions", "integer", "", kSampling, kIgnored},
                  {"seed", "integer", "0", "Lightshaft generates its own samples (--seed)", kIgnored}}});
  r.push_back({"Sampler",
               "stratified",
               true,
               kCount,
               {{"xsamples", "integer", "4", "xsamples times ysamples is the number of samples per pixel"},
                {"ysamples", "integer", "4", "see xsamples"},
                {"jitter", "bool", "true", kSampling, kIgnored},
                {"dimensions", "integer", "", kSampling, kIgnored},
                {"seed", "integer", "0", "Lightshaft generates its own samples (--seed)", kIgnored}}});
  r.push_back(
      {"Integrator", "volpath", true, "`volpath`; the integrator if none is given", integrator_words()});
  r.push_back({"Integrator", "path", true, "`path`", integrator_words()});
  for (const auto type : {"simplepath", "simplevolpath", "bdpt", "lightpath"})
    r.push_back({"Integrator", type, true, kOtherMethod, integrator_words()});
  r.push_back({"Integrator", "mlt", true, kOtherMethod,
               Words{{"bootstrapsamples", "integer", "100000", kSampling, kIgnored},
                     {"chains", "integer", "1000", kSampling, kIgnored},
                     {"mutationsperpixel", "integer", "100", kSampling, kIgnored},
                     {"largestepprobability", "float", "0.3", kSampling, kIgnored},
                     {"sigma", "float", "0.01", kSampling, kIgnored}} +
                   integrator_words()});
  r.push_back({"Integrator", "sppm", true,
               "`volpath`, with a warning: sppm applies maxdepth to the paths from the light and from the "
               "camera separately",
               Words{{"photonsperiteration", "integer", "", kSampling, kIgnored},
                     {"radius", "float", "1", "it has no effect: Lightshaft does not blur light", kIgnored},
                     {"seed", "integer", "0", kSampling, kIgnored}} +
                   integrator_words()});
  for (const auto type : {"ao", "ambientocclusion", "function"})
    r.push_back(
        {"Integrator", type, false, "it does not render light: write \"volpath\" or \"path\" instead", {}});
  r.push_back({"Integrator",
               "randomwalk",
               false,
               "it leaves out mirrors, glass and lights without a size: write \"volpath\" instead",
               {}});
  for (const auto type : {"directlighting", "whitted"})
    r.push_back({"Integrator", type, false, "write \"volpath\" or \"path\" instead", {}});
}

void add_shapes(std::vector<Row>& r) {
  r.push_back(
      {"Shape", "trianglemesh", true, "a `ply` mesh; its file is made from the parameters",
       Words{{"P", "point3", "needed", "corners"},
             {"indices", "integer", "0 1 2", "three vertices for each triangle"},
             {"faceIndices", "integer", "", "it is only used by Ptex images, which are not read", kIgnored},
             {"N", "normal", "", "normals at the vertices"},
             {"uv", "point2|float", "", "texture coordinates at the vertices"},
             {"st", "point2|float", "", "the name of uv in pbrt-v3"},
             {"S", "vector3", "", "tangents are not read", kIgnored}} +
           shape_words()});
  r.push_back(
      {"Shape", "bilinearmesh", true, "if its patches are flat, two triangles each, as `trianglemesh`",
       Words{{"P", "point3", "needed", "corners"},
             {"indices", "integer", "0 1 2 3", "four vertices for each patch"},
             {"N", "normal", "", "normals at the vertices"},
             {"uv", "point2|float", "0 0, 1 0, 0 1 and 1 1", "texture coordinates at the vertices"},
             {"faceIndices", "integer", "", "it is only used by Ptex images, which are not read", kIgnored},
             {"emissionfilename", "string", "", "it only affects sampling", kIgnored}} +
           shape_words()});
  r.push_back({"Shape", "plymesh", true, "a `ply`",
               Words{{"filename", "string", "needed", "the file, `.ply` or `.ply.gz`"},
                     {"displacement", "texture|string", "", "displace the mesh in the program that made it",
                      kRefused},
                     {"edgelength", "float", "1", "of displacement", kIgnored}} +
                   shape_words()});
  r.push_back({"Shape", "sphere", true, "a `sphere`",
               Words{{"radius", "float", "1", "radius"},
                     {"zmin", "float", "-radius", "only whole spheres are read", kRefused},
                     {"zmax", "float", "radius", "only whole spheres are read", kRefused},
                     {"phimax", "float", "360", "only whole spheres are read"}} +
                   shape_words()});
  r.push_back({"Shape", "disk", true, "a `disk`",
               Words{{"radius", "float", "1", "radius"},
                     {"height", "float", "0", "z of the disk's plane"},
                     {"innerradius", "float", "0", "only whole disks are read"},
                     {"phimax", "float", "360", "only whole disks are read"}} +
                   shape_words()});
  r.push_back({"Shape", "cylinder", true, "a `cylinder`",
               Words{{"radius", "float", "1", "radius"},
                     {"zmin", "float", "-1", "lower end of the cylinder"},
                     {"zmax", "float", "1", "upper end of the cylinder"},
                     {"phimax", "float", "360", "only whole cylinders are read"}} +
                   shape_words()});
  r.push_back({"Shape", "curve", false, "hair is not supported: leave it out", {}});
  for (const auto type : {"loopsubdiv", "heightfield", "nurbs", "cone", "paraboloid", "hyperboloid"})
    r.push_back({"Shape", type, false, "write it as a plymesh", {}});
}

void add_materials(std::vector<Row>& r) {
  r.push_back({"Material", "diffuse", true, "`diffuse` on both sides",
               Words{{"reflectance", kTextured, "0.5", "colour"}} + material_words()});
  r.push_back({"Material", "matte", true, "`diffuse` on both sides (pbrt-v3)",
               Words{{"Kd", kTextured, "0.5", "colour"},
                     {"sigma", "float", "0", "roughness after Oren and Nayar; read as 0 with a warning"},
                     {"bumpmap", "texture", "", "an image of heights: a bumpmap around it"}}});
  r.push_back({"Material", "coateddiffuse", true,
               "`plastic` or `roughplastic` (ggx) with nonlinear, on both sides, with a warning",
               Words{{"reflectance", kTextured, "0.5", "colour of the base"},
                     {"eta", "float|spectrum", "1.5", "index of refraction of the coat"}} +
                   remapped("roughness in both directions; no image") + layer_words() + material_words()});
  r.push_back({"Material", "conductor", true, "`conductor` or `roughconductor` (ggx), on both sides",
               Words{{"eta", kColour, "metal-Cu-eta", "real part of the index of refraction"},
                     {"k", kColour, "metal-Cu-k", "imaginary part"},
                     {"reflectance", kColour, "", "reflectance at normal incidence, instead of eta and k"}} +
                   remapped(kImageOfAlpha) + material_words()});
  r.push_back(
      {"Material", "coatedconductor", true,
       "`coatedconductor`, on both sides; with a warning that it is approximated, unless coat and metal are "
       "smooth",
       Words{{"interface.eta", "float|spectrum", "1.5", "index of refraction of the coat"},
             {"interface.roughness", kNumber, "0", "roughness of the coat; no image"},
             {"interface.uroughness", kNumber, "interface.roughness",
              "roughness along u; it must be equal to that along v"},
             {"interface.vroughness", kNumber, "interface.roughness", "along v"},
             {"conductor.eta", kColour, "metal-Cu-eta", "real part of the metal's index of refraction"},
             {"conductor.k", kColour, "metal-Cu-k", "imaginary part"},
             {"reflectance", kColour, "",
              "reflectance of the metal without the coat at normal incidence, instead of conductor.eta and "
              "conductor.k"},
             {"conductor.roughness", kNumber, "0", "roughness of the metal in both directions; no image"},
             {"conductor.uroughness", kNumber, "conductor.roughness", "along u"},
             {"conductor.vroughness", kNumber, "conductor.roughness", "along v"},
             {"remaproughness", "bool", "true", kRemap}} +
           layer_words() + material_words()});
  r.push_back({"Material", "mirror", true, "`conductor` without loss (pbrt-v3), on both sides",
               Words{{"Kr", kTextured, "0.9", "colour"},
                     {"bumpmap", "texture", "", "an image of heights: a bumpmap around it"}}});
  r.push_back({"Material", "dielectric", true, "`dielectric` or `roughdielectric` (ggx)",
               Words{{"eta", "float|spectrum", "1.5",
                      "index of refraction; a glass by name has its index at 588 nm"}} +
                   remapped(kImageOfAlpha) + material_words()});
  r.push_back({"Material", "thindielectric", true,
               "`thindielectric`; light that passes straight through does not count for maxdepth",
               Words{{"eta", "float|spectrum", "1.5", "index of refraction"}} + material_words()});
  r.push_back({"Material", "mix", true, "`blendbsdf` of two named materials",
               Words{{"materials", "string", "needed", "their names"},
                     {"amount", kNumber, "0.5", "weight of the second material"}}});
  for (const auto type : {"interface", "none", ""})
    r.push_back({"Material", type, true, "`null`: only the boundary of a medium", {}});
  r.push_back({"Material", "diffusetransmission", true,
               "`diffusetransmission`; the sum of reflectance and transmittance may be at most 1",
               Words{{"reflectance", kTextured, "0.25", "colour of the reflected light"},
                     {"transmittance", kTextured, "0.25", "colour of the transmitted light"},
                     {"scale", "float", "1", "multiplies both"}} +
                   material_words()});
  r.push_back({"Material", "subsurface", false, "write a \"dielectric\" with a medium inside", {}});
  for (const auto type : {"hair", "measured"})
    r.push_back({"Material", type, false, "this material is not supported: choose another", {}});
  for (const auto type :
       {"glass", "metal", "plastic", "uber", "substrate", "translucent", "disney", "fourier", "kdsubsurface"})
    r.push_back(
        {"Material", type, false, "it is of pbrt-v3: let `pbrt --upgrade` write the file for pbrt-v4", {}});
}

void add_textures(std::vector<Row>& r) {
  r.push_back(
      {"Texture", "imagemap", true, "a `bitmap`: PNG, JPEG, BMP, TGA, QOI, EXR, HDR or PFM",
       Words{{"filename", "string", "needed", "the image"},
             {"filter", "string", "bilinear", "point is `nearest`, all others `bilinear`"},
             {"wrap", "string", "repeat", "or clamp; black is refused"},
             {"encoding", "string", "sRGB", "of PNG files: sRGB or linear; other 8-bit files are sRGB"},
             {"scale", "float", "1", "multiplies the image"},
             {"invert", "bool", "false", "only false is read"},
             {"maxanisotropy", "float", "8", "it is not filtered over pixels", kIgnored},
             {"trilinear", "bool", "false", "it is not filtered over pixels", kIgnored}} +
           mapping_words()});
  r.push_back({"Texture", "constant", true, "a colour or a number",
               Words{{"value", "float|rgb|spectrum", "1", "the value"}}});
  r.push_back({"Texture", "scale", true, "the product of its two parameters",
               Words{{"tex", "float|rgb|spectrum|texture", "1", "the texture that is scaled"},
                     {"scale", kNumber, "1", "factor"}}});
  r.push_back({"Texture", "checkerboard", true, "a `checkerboard`",
               Words{{"tex1", "float|rgb|spectrum|texture", "1", "first colour"},
                     {"tex2", "float|rgb|spectrum|texture", "0", "second colour"},
                     {"dimension", "integer", "2", "only 2 is read"}} +
                   mapping_words()});
  for (const auto type :
       {"mix", "directionmix", "bilerp", "dots", "fbm", "marble", "ptex", "windy", "wrinkled"})
    r.push_back({"Texture", type, false, "render it to an image, and use that image with \"imagemap\"", {}});
}

void add_lights(std::vector<Row>& r) {
  r.push_back({"LightSource", "point", true, "a `point`",
               light_words("I") + Words{{"from", "point3", "0 0 0", "where"}, kPower}});
  r.push_back({"LightSource", "spot", true,
               "a `spot`; its soft edge falls off linearly in the angle, which causes a warning",
               light_words("I") + Words{{"from", "point3", "0 0 0", "where"},
                                        {"to", "point3", "0 0 1", "the point that it is aimed at"},
                                        {"coneangle", "float", "30", "degrees from the axis; dark beyond"},
                                        {"conedeltaangle", "float", "5", "width of the soft edge in degrees"},
                                        kPower}});
  r.push_back(
      {"LightSource", "distant", true, "a `directional`",
       light_words("L") + Words{{"from", "point3", "0 0 0", "the light travels from this point towards `to`"},
                                {"to", "point3", "0 0 1", "to here"},
                                {"illuminance", "float", "", "replaces the brightness of the colour"}}});
  r.push_back(
      {"LightSource", "infinite", true,
       "a `constant`, or an `envmap` of an image: of a filename with the mapping `equal_area`, of a mapname "
       "in latitude-longitude form",
       light_words("L") +
           Words{{"illuminance", "float", "",
                  "replaces the brightness of the colour; an error together with an image"},
                 {"filename", "string", "",
                  "a square equal-area image with +z in its centre; not together with L"},
                 {"mapname", "string", "", "an image in latitude-longitude form (pbrt-v3), +z above"},
                 {"portal", "point3", "",
                  "4 corners; read with a warning: the whole map emits light, which is the same in a closed "
                  "room whose only opening is the portal"},
                 {"samples", "integer", "", kSampling, kIgnored},
                 {"nsamples", "integer", "", kSampling, kIgnored}}});
  r.push_back({"LightSource", "projection", true, "a `projector` with `as_intensity`",
               Words{{"filename", "string", "needed", "the image, upright with +y above and +x on its right"},
                     {"fov", "float", "90", "degrees, along the shorter side of the image"},
                     {"scale", "float", "1", "factor"},
                     {"power", "float", "", "it depends on the image's pixels: give scale", kRefused}}});
  r.push_back({"LightSource", "goniometric", true,
               "a `goniometric` light; a coloured image keeps its colours, while pbrt uses their mean",
               light_words("I") +
                   Words{{"filename", "string", "needed", "a square image in pbrt-v4's equal-area form"},
                         {"power", "float", "", "give I instead: the meaning of power depends on the image",
                          kRefused}}});
  for (const auto type : {"diffuse", "area"})
    r.push_back(
        {"AreaLightSource", type, true, "an `area` light in each shape that follows",
         light_words("L") +
             Words{{"twosided", "bool", "false", "`two_sided`: the back emits light too"},
                   {"power", "float", "",
                    "luminous power of each sphere, disk, cylinder, patch or triangle: L is multiplied by "
                    "power / (pi area), or half of that if it is twosided. As in pbrt, the area of a quadric "
                    "is that before its transform. Triangles of different areas and plymesh are refused"},
                   {"filename", "string", "", "images of area lights are not supported", kRefused},
                   {"samples", "integer", "", kSampling, kIgnored},
                   {"nsamples", "integer", "", kSampling, kIgnored}}});
}

void add_media(std::vector<Row>& r) {
  r.push_back({"MakeNamedMedium", "homogeneous", true, "a `homogeneous` medium",
               medium_words() + Words{{"Le", kColour, "0", "emitted light: sigma_a times this"},
                                      {"Lescale", "float", "1", "multiplies Le"},
                                      {"preset", "string", "",
                                       "name of a substance, instead of sigma_a and sigma_s. Its values are "
                                       "per mm, so `scale` is the length of a scene unit in mm"}}});
  r.push_back(
      {"MakeNamedMedium", "uniformgrid", true,
       "a `heterogeneous` medium; a `.vol` file is made from the numbers of each grid",
       medium_words() + box_words() +
           Words{{"density", "float", "needed", "multiplies sigma_a and sigma_s; one value for each voxel"},
                 {"Le", kColour, "0", "emitted light: sigma_a times density times this"},
                 {"Lescale", "float", "",
                  "multiplies Le or the light of temperature; one value for each voxel. If it is missing, it "
                  "is 1 in the middle of the box, 1/2 in the middles of its faces and 1/8 in its corners, as "
                  "in pbrt"},
                 {"temperature", "float", "",
                  "instead of Le: temperatures of black bodies, one value for each voxel"}} +
           temperature_words()});
  r.push_back({"MakeNamedMedium", "rgbgrid", true, "the same with one colour for each voxel",
               box_words() + Words{{"sigma_a", "rgb", "", "absorption; 1 if it is not given"},
                                   {"sigma_s", "rgb", "", "scattering; 1 if it is not given"},
                                   {"scale", "float", "1", "multiplies both"},
                                   {"g", "float", "0", "mean cosine of Henyey-Greenstein"},
                                   {"Le", "rgb", "",
                                    "emitted light: sigma_a times 106.857 times this, because pbrt does not "
                                    "scale it to the luminance of white; needs sigma_a"},
                                   {"Lescale", "float", "1", "multiplies Le"}}});
  r.push_back({"MakeNamedMedium", "nanovdb", true, "a `heterogeneous` medium of that file",
               medium_words() +
                   Words{{"filename", "string", "needed", "a NanoVDB file"},
                         {"gridname", "string", "density", "the grid of densities"},
                         {"temperaturename", "string", "temperature",
                          "name of the grid of temperatures of black bodies. The grid is read, and must "
                          "exist, if this parameter, Lescale or one of the next three is given"},
                         {"Lescale", "float", "1", "multiplies the light of black bodies"},
                         {"LeScale", "float", "1", "the name of this parameter in older scenes"}} +
                   temperature_words()});
  r.push_back(
      {"MakeNamedMedium", "cloud", true, "a `heterogeneous` medium whose density is the volume `cloud`",
       coefficient_words() +
           Words{{"density", "float", "1", "multiplies the noise"},
                 {"wispiness", "float", "1", "how far points are displaced before the noise is evaluated"},
                 {"frequency", "float", "5", "cells of the coarsest noise per scene unit"},
                 {"p0", "point3", "0 0 0", "corner of the box"},
                 {"p1", "point3", "1 1 1", "corner of the box"}}});
}

}  // namespace

const Word* Row::find(std::string_view name) const {
  const auto it = std::find_if(words.begin(), words.end(), [&](const Word& w) { return w.name == name; });
  return it == words.end() ? nullptr : &*it;
}

std::span<const Row> rows() {
  static const std::vector<Row> all = [] {
    std::vector<Row> r;
    add_settings(r);
    add_shapes(r);
    add_materials(r);
    add_textures(r);
    add_lights(r);
    add_media(r);
    return r;
  }();
  return all;
}

const Row* find_row(std::string_view directive, std::string_view type) {
  const auto all = rows();
  const auto it = std::find_if(all.begin(), all.end(),
                               [&](const Row& r) { return r.directive == directive && r.type == type; });
  return it == all.end() ? nullptr : &*it;
}

std::vector<std::string> types_of(std::string_view directive) {
  std::vector<std::string> types;
  for (const Row& r : rows())
    if (r.directive == directive && r.is_read && !r.type.empty()) types.emplace_back(r.type);
  return types;
}

std::span<const Plain> plain_directives() {
  static constexpr Plain kAll[] = {
      {"Include", "the text of another file, found from the folder of the main file; at most 256 altogether"},
      {"Import", "the same, between an AttributeBegin and an AttributeEnd"},
      {"WorldBegin", "ends the part with the camera; transform and orientation are reset"},
      {"WorldEnd", "nothing (pbrt-v3)"},
      {"AttributeBegin",
       "saves transform, material, light, media and orientation; AttributeEnd restores them"},
      {"AttributeEnd", "see AttributeBegin"},
      {"TransformBegin", "like AttributeBegin in pbrt-v4; in pbrt-v3 it saves the transform only"},
      {"TransformEnd", "as AttributeEnd"},
      {"Identity", "transform"},
      {"Translate", "transform"},
      {"Scale", "transform"},
      {"Rotate", "transform: degrees and axis"},
      {"LookAt", "transform: eye, target, up"},
      {"Transform", "16 numbers, column by column; replaces the transform"},
      {"ConcatTransform", "16 numbers, column by column; multiplies the transform"},
      {"CoordinateSystem", "gives the transform a name"},
      {"CoordSysTransform", "uses the transform of that name; `camera` and `world` are predefined"},
      {"ReverseOrientation", "flips the normals of the shapes that follow"},
      {"NamedMaterial", "uses the material of that name, which an earlier MakeNamedMaterial defined"},
      {"MakeNamedMaterial", "defines a material with a name; its parameter `type` chooses the kind"},
      {"MediumInterface",
       "names of the media inside and outside; before Camera, the medium around the camera"},
      {"ObjectBegin", "the shapes until ObjectEnd become a `shapegroup`; area lights in it cause a warning"},
      {"ObjectEnd", "see ObjectBegin"},
      {"ObjectInstance", "an `instance` of that `shapegroup`"},
      {"Accelerator", "no effect: Lightshaft chooses its own acceleration structure"},
      {"ColorSpace",
       "the space of the `rgb` values that follow, until AttributeEnd: srgb, rec2020, dci-p3 or aces2065-1"},
      {"Option",
       "no effect, with a warning. forcediffuse and disablepixeljitter would change pixels, so they are "
       "refused unless they are false"},
      {"ActiveTransform",
       "All, StartTime or EndTime. Cameras, shapes and instances move. Lights, media, shapes that give light "
       "and those in an ObjectBegin are where they are at StartTime; for shapes that is a warning"},
      {"TransformTimes", "the times of the two transforms"},
      {"Attribute", "refused: write the parameter into each object"},
  };
  return kAll;
}

}  // namespace ls::scene::pbrt
