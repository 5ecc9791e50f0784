#include "common/scene/pbrt/vocabulary.h"

#include <algorithm>

namespace ls::scene::pbrt {
namespace {

using Words = std::vector<Word>;
constexpr auto kIgnored = Word::Use::ignored;
constexpr auto kRefused = Word::Use::refused;
constexpr std::string_view kColour = "rgb|spectrum|blackbody";
constexpr std::string_view kTextured = "rgb|spectrum|texture";
constexpr std::string_view kNumber = "float|texture";
constexpr std::string_view kRemap = "alpha is the square root of the roughness; false: alpha itself";
constexpr std::string_view kSampling = "it only steers sampling, which is chosen here";

Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Words camera_words() {
  return {{"shutteropen", "float", "0", "see shutterclose"},
          {"shutterclose", "float", "1",
           "all light is multiplied by shutterclose - shutteropen; motion is not rendered"},
          {"frameaspectratio", "float", "that of the film",
           "width over height of what the frame shows; pixels of `perspective` must come out square"},
          {"screenwindow", "float", "1 to each side along the shorter side of the frame",
           "x0 x1 y0 y1: what the frame shows of the plane on which `fov` sees [-1, 1]; pixels of "
           "`perspective` must come out square (to 0.1 %)"}};
}

Words film_words() {
  return {
      {"xresolution", "integer", "1280", "pixels"},
      {"yresolution", "integer", "720", "pixels"},
      {"cropwindow", "float", "the whole frame", "x0 x1 y0 y1 as shares of the frame"},
      {"pixelbounds", "integer", "the whole frame", "x0 x1 y0 y1 in pixels"},
      {"iso", "float", "100", "all light is multiplied by iso / 100"},
      {"exposuretime", "float", "1", "a factor on all light; not in today's pbrt-v4"},
      {"sensor", "string", "cie1931", "another name is a warning: colours stay those of the CIE observer"},
      {"whitebalance", "float", "0", "balance the image afterwards", kRefused},
      {"maxcomponentvalue", "float", "", "samples are not clamped, as that darkens the image", kIgnored},
      {"diagonal", "float", "35", "only lenses of the camera \"realistic\" depend on it", kIgnored},
      {"filename", "string", "", "the command line or the job says where images go", kIgnored},
      {"coordinatesystem", "string", "camera", "AOVs are in world coordinates", kIgnored},
      {"nbuckets", "integer", "16", "spectra are not followed", kIgnored},
      {"lambdamin", "float", "360", "spectra are not followed", kIgnored},
      {"lambdamax", "float", "830", "spectra are not followed", kIgnored},
      {"savefp16", "bool", "true", "the output format is chosen by the command line or the job", kIgnored}};
}

Words shape_words() { return {{"alpha", kNumber, "1", "opacity: a mask around the material"}}; }

Words remapped() {
  return {{"roughness", kNumber, "0", "of both directions"},
          {"uroughness", kNumber, "roughness", "along u"},
          {"vroughness", kNumber, "roughness", "along v"},
          {"remaproughness", "bool", "true", kRemap}};
}

Words material_words() {
  return {{"normalmap", "string", "", "an image of normals: a normalmap around it"},
          {"displacement", "texture", "", "an image of heights: a bumpmap around it"}};
}

Words layer_words() {
  return {{"thickness", "float", "0.01", "without absorption it does not show", kIgnored},
          {"maxdepth", "integer", "10", "all reflections within the coat are counted", kIgnored},
          {"nsamples", "integer", "1", kSampling, kIgnored},
          {"g", "float", "0", "of the medium in the coat, which is not read", kIgnored},
          {"albedo", kTextured, "0", "a medium within the coat is not known here", kRefused}};
}

Words light_words(std::string_view colour) {
  return {{colour, kColour, "the white of sRGB", "colour"}, {"scale", "float", "1", "factor"}};
}
const Word kPower{"power", "float", "", "luminous power in place of the colour's brightness"};

Words coefficient_words() {
  return {{"sigma_a", kColour, "1", "absorption per scene unit"},
          {"sigma_s", kColour, "1", "scattering per scene unit"},
          {"g", "float", "0", "mean cosine of Henyey-Greenstein"}};
}
Words medium_words() {
  return coefficient_words() + Words{{"scale", "float", "1", "factor on sigma_a and sigma_s"}};
}
Words temperature_words() {
  return {{"temperaturescale", "float", "1", "factor on a temperature less temperatureoffset, at least 0"},
          {"temperatureoffset", "float", "temperaturecutoff", "subtracted from the values of the grid"},
          {"temperaturecutoff", "float", "0", "another name of temperatureoffset"}};
}
Words box_words() {
  return {{"nx", "integer", "1", "values along x, which runs fastest"},
          {"ny", "integer", "1", "values along y"},
          {"nz", "integer", "1", "values along z"},
          {"p0", "point3", "0 0 0", "corner of the box"},
          {"p1", "point3", "1 1 1", "corner of the box"}};
}

Words mapping_words() {
  return {{"mapping", "string", "uv", "only uv is read"},
          {"uscale", "float", "1", "factor on u"},
          {"vscale", "float", "1", "factor on v"},
          {"udelta", "float", "0", "added to u"},
          {"vdelta", "float", "0", "added to v"}};
}

Words integrator_words() {
  return {{"maxdepth", "integer", "5", "scatterings; max_depth is one more"},
          {"lightsampler", "string", "bvh", kSampling, kIgnored},
          {"rrthreshold", "float", "1", kSampling, kIgnored},
          {"sampleLights", "bool", "true", kSampling, kIgnored},
          {"samplelights", "bool", "true", kSampling, kIgnored},
          {"samplebsdf", "bool", "true", kSampling, kIgnored},
          {"samplebsdfs", "bool", "true", kSampling, kIgnored},
          {"regularize", "bool", "false", "surfaces keep their roughness", kIgnored}};
}

constexpr std::string_view kOtherMethod = "`volpath`, with a warning: the same light by other means";
constexpr std::string_view kCount = "the number of samples; which they are is this program's own matter";

void add_settings(std::vector<Row>& r) {
  r.push_back({"Film", "rgb", true, "size, crop and exposure of the image", film_words()});
  for (const auto type : {"gbuffer", "spectral", "image"})
    r.push_back({"Film", type, true, "as `rgb`; further layers are chosen by --aov", film_words()});
  r.push_back({"Camera", "perspective", true, "a `perspective` camera, or a `thinlens`",
               Words{{"fov", "float", "90", "degrees, along the shorter side of the frame"},
                     {"lensradius", "float", "0", "radius of the lens"},
                     {"focaldistance", "float", "1e6", "distance that is sharp"},
                     {"halffov", "float", "", "half of fov, in its place"}} +
                   camera_words()});
  r.push_back({"Camera", "orthographic", true,
               "an `orthographic` camera; the frame's shorter side sees [-1, 1]",
               Words{{"lensradius", "float", "0", "lenses are of `perspective` only", kRefused},
                     {"focaldistance", "float", "", "see lensradius", kRefused}} +
                   camera_words()});
  r.push_back({"Camera", "realistic", false, "lens systems are not traced: write it as \"perspective\"", {}});
  r.push_back({"Camera", "spherical", true, "a `spherical` camera, if its mapping is equirectangular",
               Words{{"mapping", "string", "equalarea",
                      "only equirectangular is read: the other maps all directions to squares of equal area"},
                     {"lensradius", "float", "0", "it has no lens", kIgnored},
                     {"focaldistance", "float", "", "it has no lens", kIgnored},
                     {"fov", "float", "", "it sees all directions", kIgnored}} +
                   camera_words()});
  const Words radii{{"xradius", "float", "", "half width in pixels"},
                    {"yradius", "float", "xradius", "half height; it must be the same"}};
  r.push_back({"PixelFilter", "box", true, "`box`; its radius is 0.5 if none is given", radii});
  r.push_back({"PixelFilter", "triangle", true, "`tent`; its radius is 2 if none is given", radii});
  r.push_back(
      {"PixelFilter", "gaussian", true,
       "`gaussian` of that sigma, cut off at 4 sigma (pbrt: at its radius); the filter if none is given",
       Words{{"sigma", "float", "0.5", "standard deviation in pixels"},
             {"alpha", "float", "", "pbrt-v3's alpha is 1 / (2 sigma^2): give sigma", kRefused},
             {"xradius", "float", "1.5", "it is cut off at 4 sigma", kIgnored},
             {"yradius", "float", "1.5", "it is cut off at 4 sigma", kIgnored}}});
  constexpr std::string_view kGaussian = "a Gaussian stands for it";
  for (const auto type : {"mitchell", "sinc"})
    r.push_back({"PixelFilter",
                 type,
                 true,
                 "`gaussian` of sigma 0.5, with a warning: it has negative lobes, which samples that each "
                 "belong to one pixel can't follow",
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
                 {{"pixelsamples", "integer", "16", "samples a pixel"},
                  {"randomization", "string", "", kSampling, kIgnored},
                  {"dimensions", "integer", "", kSampling, kIgnored},
                  {"seed", "integer", "0", "samples are this program's own (--seed)", kIgnored}}});
  r.push_back({"Sampler",
               "stratified",
               true,
               kCount,
               {{"xsamples", "integer", "4", "times ysamples is the number of samples a pixel"},
                {"ysamples", "integer", "4", "see xsamples"},
                {"jitter", "bool", "true", kSampling, kIgnored},
                {"dimensions", "integer", "", kSampling, kIgnored},
                {"seed", "integer", "0", "samples are this program's own (--seed)", kIgnored}}});
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
  r.push_back(
      {"Integrator", "sppm", true,
       "`volpath`, with a warning: sppm's maxdepth counts what the light and what the camera sends each",
       Words{{"photonsperiteration", "integer", "", kSampling, kIgnored},
             {"radius", "float", "1", "light is not blurred by it", kIgnored},
             {"seed", "integer", "0", kSampling, kIgnored}} +
           integrator_words()});
  for (const auto type : {"ao", "ambientocclusion", "function"})
    r.push_back({"Integrator", type, false, "it shows no light: write \"volpath\" or \"path\" for it", {}});
  r.push_back({"Integrator",
               "randomwalk",
               false,
               "it leaves out mirrors, glass and lights without a size: write \"volpath\" for it",
               {}});
  for (const auto type : {"directlighting", "whitted"})
    r.push_back({"Integrator", type, false, "write \"volpath\" or \"path\" for it", {}});
}

void add_shapes(std::vector<Row>& r) {
  r.push_back({"Shape", "trianglemesh", true, "a `ply`, which is written of its numbers",
               Words{{"P", "point3", "needed", "corners"},
                     {"indices", "integer", "0 1 2", "three corners a triangle"},
                     {"faceIndices", "integer", "", "only Ptex images are chosen by it", kIgnored},
                     {"N", "normal", "", "normals at the corners"},
                     {"uv", "point2|float", "", "texture coordinates at the corners"},
                     {"st", "point2|float", "", "uv of pbrt-v3"},
                     {"S", "vector3", "", "tangents: highlights along them are not followed", kIgnored}} +
                   shape_words()});
  r.push_back({"Shape", "bilinearmesh", true,
               "if its patches are flat, two triangles each, as `trianglemesh`",
               Words{{"P", "point3", "needed", "corners"},
                     {"indices", "integer", "0 1 2 3", "four corners a patch"},
                     {"N", "normal", "", "normals at the corners"},
                     {"uv", "point2|float", "0 0, 1 0, 0 1 and 1 1", "texture coordinates at the corners"},
                     {"faceIndices", "integer", "", "only Ptex images are chosen by it", kIgnored},
                     {"emissionfilename", "string", "", "it only steers sampling", kIgnored}} +
                   shape_words()});
  r.push_back({"Shape", "plymesh", true, "a `ply`",
               Words{{"filename", "string", "needed", "the file, `.ply` or `.ply.gz`"},
                     {"displacement", "texture|string", "", "put it into the mesh", kRefused},
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
                     {"height", "float", "0", "z of its plane"},
                     {"innerradius", "float", "0", "only whole disks are read"},
                     {"phimax", "float", "360", "only whole disks are read"}} +
                   shape_words()});
  r.push_back({"Shape", "cylinder", true, "a `cylinder`",
               Words{{"radius", "float", "1", "radius"},
                     {"zmin", "float", "-1", "where it begins"},
                     {"zmax", "float", "1", "where it ends"},
                     {"phimax", "float", "360", "only whole cylinders are read"}} +
                   shape_words()});
  r.push_back({"Shape", "curve", false, "hair is not rendered here: leave it out", {}});
  for (const auto type : {"loopsubdiv", "heightfield", "nurbs", "cone", "paraboloid", "hyperboloid"})
    r.push_back({"Shape", type, false, "write it as a plymesh", {}});
}

void add_materials(std::vector<Row>& r) {
  r.push_back({"Material", "diffuse", true, "`diffuse` on both sides",
               Words{{"reflectance", kTextured, "0.5", "colour"}} + material_words()});
  r.push_back({"Material", "matte", true, "`diffuse` on both sides (pbrt-v3)",
               Words{{"Kd", kTextured, "0.5", "colour"},
                     {"sigma", "float", "0", "Oren and Nayar's roughness is read as 0, with a warning"},
                     {"bumpmap", "texture", "", "an image of heights: a bumpmap around it"}}});
  r.push_back({"Material", "coateddiffuse", true,
               "`plastic` or `roughplastic` (ggx) with nonlinear, on both sides, with a warning",
               Words{{"reflectance", kTextured, "0.5", "of the base"},
                     {"eta", "float|spectrum", "1.5", "index of refraction of the coat"}} +
                   remapped() + layer_words() + material_words()});
  r.push_back({"Material", "conductor", true, "`conductor` or `roughconductor` (ggx), on both sides",
               Words{{"eta", kColour, "metal-Cu-eta", "real part of the index of refraction"},
                     {"k", kColour, "metal-Cu-k", "imaginary part"},
                     {"reflectance", "rgb|spectrum", "", "at right angles, instead of eta and k"}} +
                   remapped() + material_words()});
  r.push_back(
      {"Material", "coatedconductor", true,
       "`coatedconductor`, on both sides; with a warning that it is approximated, unless coat and metal are "
       "smooth",
       Words{
           {"interface.eta", "float|spectrum", "1.5", "index of refraction of the coat"},
           {"interface.roughness", kNumber, "0", "of the coat"},
           {"interface.uroughness", kNumber, "interface.roughness", "along u; as along v, or it is refused"},
           {"interface.vroughness", kNumber, "interface.roughness", "along v"},
           {"conductor.eta", kColour, "metal-Cu-eta", "real part of the metal's index of refraction"},
           {"conductor.k", kColour, "metal-Cu-k", "imaginary part"},
           {"reflectance", "rgb|spectrum", "",
            "of the metal without the coat, at right angles, instead of conductor.eta and conductor.k"},
           {"conductor.roughness", kNumber, "0", "of the metal, in both directions"},
           {"conductor.uroughness", kNumber, "conductor.roughness", "along u"},
           {"conductor.vroughness", kNumber, "conductor.roughness", "along v"},
           {"remaproughness", "bool", "true", kRemap}} +
           layer_words() + material_words()});
  r.push_back({"Material", "mirror", true, "`conductor` without loss (pbrt-v3), on both sides",
               Words{{"Kr", kTextured, "0.9", "colour"},
                     {"bumpmap", "texture", "", "an image of heights: a bumpmap around it"}}});
  r.push_back(
      {"Material", "dielectric", true, "`dielectric` or `roughdielectric` (ggx)",
       Words{{"eta", "float|spectrum", "1.5", "index of refraction; of a glass by name that at 588 nm"}} +
           remapped() + material_words()});
  r.push_back({"Material", "thindielectric", true,
               "`thindielectric`; passing it is no scattering here, and maxdepth does not count it",
               Words{{"eta", "float|spectrum", "1.5", "index of refraction"}} + material_words()});
  r.push_back({"Material", "mix", true, "`blendbsdf` of two named materials",
               Words{{"materials", "string", "needed", "their names"},
                     {"amount", kNumber, "0.5", "share of the second"}}});
  for (const auto type : {"interface", "none", ""})
    r.push_back({"Material", type, true, "`null`: only the boundary of a medium", {}});
  r.push_back({"Material", "diffusetransmission", true,
               "`diffusetransmission`; reflectance and transmittance may sum up to 1",
               Words{{"reflectance", kTextured, "0.25", "colour of the light sent back"},
                     {"transmittance", kTextured, "0.25", "colour of the light that passes"},
                     {"scale", "float", "1", "factor on both"}} +
                   material_words()});
  r.push_back({"Material", "subsurface", false, "write a \"dielectric\" with a medium inside", {}});
  for (const auto type : {"hair", "measured"})
    r.push_back({"Material", type, false, "this kind of scattering is not known here: choose another", {}});
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
             {"scale", "float", "1", "factor on the image"},
             {"invert", "bool", "false", "only false is read"},
             {"maxanisotropy", "float", "8", "it is not filtered over pixels", kIgnored},
             {"trilinear", "bool", "false", "it is not filtered over pixels", kIgnored}} +
           mapping_words()});
  r.push_back({"Texture", "constant", true, "a colour or a number",
               Words{{"value", "float|rgb|spectrum", "1", "the value"}}});
  r.push_back({"Texture", "scale", true, "the product of its two parameters",
               Words{{"tex", "float|rgb|spectrum|texture", "1", "what is scaled"},
                     {"scale", kNumber, "1", "factor"}}});
  r.push_back({"Texture", "checkerboard", true, "a `checkerboard`",
               Words{{"tex1", "float|rgb|spectrum|texture", "1", "first colour"},
                     {"tex2", "float|rgb|spectrum|texture", "0", "second colour"},
                     {"dimension", "integer", "2", "only 2 is read"}} +
                   mapping_words()});
  for (const auto type :
       {"mix", "directionmix", "bilerp", "dots", "fbm", "marble", "ptex", "windy", "wrinkled"})
    r.push_back({"Texture", type, false, "render it to an image, and name that by \"imagemap\"", {}});
}

void add_lights(std::vector<Row>& r) {
  r.push_back({"LightSource", "point", true, "a `point`",
               light_words("I") + Words{{"from", "point3", "0 0 0", "where"}, kPower}});
  r.push_back({"LightSource", "spot", true,
               "a `spot`; where its edge is soft it is linear in the angle, which is a warning",
               light_words("I") + Words{{"from", "point3", "0 0 0", "where"},
                                        {"to", "point3", "0 0 1", "at what it is aimed"},
                                        {"coneangle", "float", "30", "degrees from the axis; dark beyond"},
                                        {"conedeltaangle", "float", "5", "width of the edge"},
                                        kPower}});
  r.push_back(
      {"LightSource", "distant", true, "a `directional`",
       light_words("L") + Words{{"from", "point3", "0 0 0", "light travels from here"},
                                {"to", "point3", "0 0 1", "to here"},
                                {"illuminance", "float", "", "in place of the colour's brightness"}}});
  r.push_back(
      {"LightSource", "infinite", true,
       "a `constant`, or an `envmap` of an image: of a filename with the mapping `equal_area`, of a mapname "
       "in latitude-longitude form",
       light_words("L") +
           Words{{"illuminance", "float", "", "in place of the colour's brightness; refused with an image"},
                 {"filename", "string", "", "a square equal-area image, +z in its centre; without L"},
                 {"mapname", "string", "", "an image in latitude-longitude form (pbrt-v3), +z above"},
                 {"portal", "point3", "",
                  "4 corners; read with a warning: all of the map gives light here, which is the same in a "
                  "closed room whose only opening is the portal"},
                 {"samples", "integer", "", kSampling, kIgnored},
                 {"nsamples", "integer", "", kSampling, kIgnored}}});
  r.push_back({"LightSource", "projection", true, "a `projector` with `as_intensity`",
               Words{{"filename", "string", "needed", "the image, upright with +y above and +x on its right"},
                     {"fov", "float", "90", "degrees, along the shorter side of the image"},
                     {"scale", "float", "1", "factor"},
                     {"power", "float", "", "it depends on the image's pixels: give scale", kRefused}}});
  r.push_back({"LightSource", "goniometric", true,
               "a `goniometric`; a coloured image keeps its colours, of which pbrt takes the mean",
               light_words("I") +
                   Words{{"filename", "string", "needed", "a square image in pbrt-v4's equal-area form"},
                         {"power", "float", "", "give I: what it means depends on the image", kRefused}}});
  for (const auto type : {"diffuse", "area"})
    r.push_back(
        {"AreaLightSource", type, true, "an `area` in each shape that follows",
         light_words("L") +
             Words{
                 {"twosided", "bool", "false", "`two_sided`: the back shines, too"},
                 {"power", "float", "",
                  "luminous power of each sphere, disk, cylinder, patch or triangle: L is multiplied by "
                  "power / (pi area), half of that if it is twosided. Of a quadric the area is that without "
                  "its transform, as in pbrt; triangles of different areas, and plymesh, are refused"},
                 {"filename", "string", "", "a light's image is not read", kRefused},
                 {"samples", "integer", "", kSampling, kIgnored},
                 {"nsamples", "integer", "", kSampling, kIgnored}}});
}

void add_media(std::vector<Row>& r) {
  r.push_back({"MakeNamedMedium", "homogeneous", true, "a `homogeneous` medium",
               medium_words() + Words{{"Le", kColour, "0", "light given off: sigma_a times this"},
                                      {"Lescale", "float", "1", "factor on Le"},
                                      {"preset", "string", "",
                                       "a substance by name in place of sigma_a and sigma_s, which are then "
                                       "per mm: `scale` is the length of a scene unit in mm"}}});
  r.push_back({"MakeNamedMedium", "uniformgrid", true,
               "a `heterogeneous` medium; its grids are each a `.vol` that is written of its numbers",
               medium_words() + box_words() +
                   Words{{"density", "float", "needed", "factor on sigma_a and sigma_s, a value a voxel"},
                         {"Le", kColour, "0", "light given off: sigma_a times density times this"},
                         {"Lescale", "float", "",
                          "factor on Le or on the light of temperature, a value a voxel; if it is not given, "
                          "1 in the middle of the box, falling to 1/2 in the middles of its faces and to 1/8 "
                          "in its corners, as pbrt has it"},
                         {"temperature", "float", "", "in place of Le: black bodies, a value a voxel"}} +
                   temperature_words()});
  r.push_back({"MakeNamedMedium", "rgbgrid", true, "likewise, with a colour a voxel",
               box_words() + Words{{"sigma_a", "rgb", "", "absorption; 1 if it is not given"},
                                   {"sigma_s", "rgb", "", "scattering; 1 if it is not given"},
                                   {"scale", "float", "1", "factor on both"},
                                   {"g", "float", "0", "mean cosine of Henyey-Greenstein"},
                                   {"Le", "rgb", "",
                                    "light given off: sigma_a times 106.857 times this, as pbrt does not "
                                    "scale it to the white's luminance; it needs sigma_a"},
                                   {"Lescale", "float", "1", "factor on Le"}}});
  r.push_back({"MakeNamedMedium", "nanovdb", true, "a `heterogeneous` medium of that file",
               medium_words() +
                   Words{{"filename", "string", "needed", "a NanoVDB file"},
                         {"gridname", "string", "density", "the grid of densities"},
                         {"temperaturename", "string", "temperature",
                          "the grid of temperatures: black bodies. It is read if this parameter, Lescale, or "
                          "one of the next three is given, and must be there then"},
                         {"Lescale", "float", "1", "factor on the light of black bodies"},
                         {"LeScale", "float", "1", "its name in older scenes"}} +
                   temperature_words()});
  r.push_back({"MakeNamedMedium", "cloud", true,
               "a `heterogeneous` medium; its density, a formula, is written as a `.vol`",
               coefficient_words() +
                   Words{{"density", "float", "1", "factor on the noise"},
                         {"wispiness", "float", "1", "how far points are moved before the noise is asked"},
                         {"frequency", "float", "5", "cells of the coarsest noise per unit"},
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
      {"Include", "the text of another file, found from the folder of the main file"},
      {"Import", "the same, within an AttributeBegin and AttributeEnd of its own"},
      {"WorldBegin", "the camera's part ends: transform and orientation begin anew"},
      {"WorldEnd", "nothing (pbrt-v3)"},
      {"AttributeBegin", "keeps transform, material, light, media and orientation until AttributeEnd"},
      {"AttributeEnd", "see AttributeBegin"},
      {"TransformBegin",
       "as AttributeBegin: in pbrt-v4 it keeps all of that, in pbrt-v3 the transform alone"},
      {"TransformEnd", "as AttributeEnd"},
      {"Identity", "transform"},
      {"Translate", "transform"},
      {"Scale", "transform"},
      {"Rotate", "transform: degrees and axis"},
      {"LookAt", "transform: eye, target, up"},
      {"Transform", "16 numbers, column by column, in place of the transform"},
      {"ConcatTransform", "16 numbers, column by column, times the transform"},
      {"CoordinateSystem", "gives the transform a name"},
      {"CoordSysTransform", "takes the transform of that name; `camera` and `world` are there"},
      {"ReverseOrientation", "turns the normals of the shapes that follow"},
      {"NamedMaterial", "the material of that name, which a MakeNamedMaterial before it made"},
      {"MakeNamedMaterial", "a Material with a name; its parameter `type` says which"},
      {"MediumInterface", "names of the media inside and outside; before Camera, the one around the camera"},
      {"ObjectBegin",
       "the shapes until ObjectEnd are kept, as a `shapegroup`; area lights in it are a warning"},
      {"ObjectEnd", "see ObjectBegin"},
      {"ObjectInstance", "an `instance` of such shapes"},
      {"Accelerator", "no effect: how rays find shapes is chosen here"},
      {"ColorSpace",
       "the space of the `rgb` values that follow, until AttributeEnd: srgb, rec2020, dci-p3 or aces2065-1"},
      {"Option",
       "no effect, which is a warning; forcediffuse and disablepixeljitter, which change pixels, are refused "
       "unless they are false"},
      {"ActiveTransform",
       "All, StartTime or EndTime: transforms of EndTime alone are left out, with a warning, as motion is "
       "not "
       "rendered"},
      {"TransformTimes", "no effect without motion"},
      {"Attribute", "refused: write the parameter into each object"},
  };
  return kAll;
}

}  // namespace ls::scene::pbrt
