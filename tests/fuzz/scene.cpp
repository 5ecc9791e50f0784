// Scene files of strangers (XML, pbrt, glTF): read, described, written in both forms and read back to the
// same scene.
#include "core/scene/analysis/needs.h"
#include "core/scene/analysis/prune.h"
#include "core/scene/diagnostic.h"
#include "core/scene/json/serialize.h"
#include "formats/read.h"
#include "formats/reader/nori_test.h"
#include "formats/reader/xml_write.h"
#include "tests/fuzz/all_targets.h"

namespace ls::fuzz {
namespace {

// Every name is a file, but for those that say "missing"; what is included is one of two small texts.
class AnyFile final : public AssetSource {
 public:
  Result<Asset> find(std::string_view name) override {
    if (name.find("missing") != std::string_view::npos) return fail(Errc::not_found, "there is no such file");
    return Asset{std::string(name), sha256(name), 4096};
  }
  Result<std::string> text(std::string_view name) override {
    if (name == "self.xml") return std::string(R"(<scene><include filename="self.xml"/></scene>)");
    if (name == "self.pbrt") return std::string("Include \"self.pbrt\"");
    if (name.ends_with(".bin")) return std::string(256, '\x3f');  // floats of 0.747
    if (name.ends_with(".pbrt")) return std::string("Material \"diffuse\" Shape \"sphere\"");
    return std::string(R"(<scene version="3.0.0"><bsdf type="diffuse" id="included"/></scene>)");
  }
  // Nothing is written, and every name is a file in any case.
  Result<Asset> keep(std::string_view name, const std::string&) override { return find(name); }
};

void check_needs(const Scene& scene) {
  for (const bool sees_media : {false, true}) {
    const auto needs = ls::scene::needs_of(scene, sees_media);
    must(canonical_json(needs) == canonical_json(ls::scene::needs_of(scene, sees_media)),
         "needs are the scene's alone");
    (void)in_words(needs);
    const ls::scene::PrunedFor whom{sees_media, !sees_media};
    const auto once = ls::scene::pruned(scene, whom), twice = ls::scene::pruned(once.scene, whom);
    must(serialize(once.scene) == serialize(twice.scene), "pruning what is pruned changes nothing");
  }
}

void check_scene(const Scene& scene, AssetSource& files) {
  const std::string json = serialize(scene);
  const auto back = deserialize_scene(json);
  must(back.has_value(), "a scene that was read is one that workers take");
  must(serialize(*back) == json, "a canonical scene reads back as it was");
  check_needs(scene);
  const std::string xml = write_xml(scene);
  const auto again = read_scene("again.xml", xml, files, {});
  must(again.scene.has_value(), "a scene that was written as XML can be read");
  must(serialize(*again.scene) == json, "a scene that was written as XML reads back as it was");
}

void check_diagnostics(const std::vector<Diagnostic>& found, bool accepted) {
  must(accepted || !found.empty(), "what is refused is told why");
  for (const Diagnostic& d : found) must(!d.text.empty(), "a diagnostic says something");
  (void)format_diagnostics(found);
}

}  // namespace

void scene_xml(Bytes input) {
  AnyFile files;
  ReadOptions options;
  options.defines = {{"n", "2"}, {"name", "a#.png"}};
  if (input.size() % 2) options.frame = 7;
  const auto as_test = read_nori_test("fuzz.xml", text_of(input), files, options);
  check_diagnostics(as_test.diagnostics, as_test.test.has_value());
  const auto read = read_scene("fuzz.xml", text_of(input), files, options);
  check_diagnostics(read.diagnostics, read.scene.has_value());
  if (read.scene) check_scene(*read.scene, files);
}

void scene_pbrt(Bytes input) {
  AnyFile files;
  ReadOptions options;
  if (input.size() % 2) options.frame = 7;
  const auto read = read_scene("fuzz.pbrt", text_of(input), files, options);
  check_diagnostics(read.diagnostics, read.scene.has_value());
  for (const Diagnostic& d : read.diagnostics) must(d.place.line > 0, "a diagnostic has a place");
  if (read.scene) check_scene(*read.scene, files);
}

void scene_gltf(Bytes input) {
  AnyFile files;
  ReadOptions options;
  if (input.size() % 2) options.defines = {{"environment", "1"}, {"time", "0.4"}, {"animation", "*"}};
  const auto read = read_scene("fuzz.gltf", text_of(input), files, options);
  check_diagnostics(read.diagnostics, read.scene.has_value());
  for (const Diagnostic& d : read.diagnostics) must(d.place.line > 0, "a diagnostic has a place");
  if (read.scene) check_scene(*read.scene, files);
}

void scene_json(Bytes input) {
  const auto scene = deserialize_scene(text_of(input));
  if (!scene) return must(!scene.error().message.empty(), "what is refused is told why");
  const std::string json = serialize(*scene);
  const auto back = deserialize_scene(json);
  must(back && serialize(*back) == json, "a canonical scene reads back as it was");
  check_needs(*scene);
}

Seeds scene_xml_seeds() {
  return {
      R"(<scene version="3.0.0"><default name="n" value="3"/><integrator type="volpath"><integer name="max_depth" value="8"/></integrator>
<sensor type="thinlens"><float name="fov" value="40"/><float name="aperture_radius" value="0.1"/><float name="focus_distance" value="4"/>
<transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
<sampler type="independent"><integer name="sample_count" value="16"/></sampler>
<film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="24"/><rfilter type="gaussian"/></film></sensor>
<medium type="heterogeneous" id="fog"><volume name="sigma_t" type="gridvolume"><string name="filename" value="fog.vol"/>
<transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume><rgb name="albedo" value="0.9, 0.8, 0.6"/>
<float name="scale" value="$n"/><phase type="hg"><float name="g" value="0.4"/></phase></medium>
<shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="9, 8, 7"/></emitter><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter></scene>)",
      R"(<scene version="2.1.0"><bsdf type="principled" id="p"><texture name="base_color" type="bitmap"><string name="filename" value="$name"/>
<string name="wrap_mode" value="mirror"/></texture><float name="roughness" value=".3"/></bsdf>
<bsdf type="bumpmap" id="b"><texture name="arbitrary" type="checkerboard"><rgb name="color0" value="1"/></texture><bsdf type="roughconductor"><string name="material" value="Au"/></bsdf></bsdf>
<shape type="obj"><string name="filename" value="a.obj"/><ref id="p"/></shape><shape type="shapegroup" id="g"><shape type="sphere"><ref id="b"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><rotate x="1" angle="30"/><matrix value="1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"/></transform></shape>
<emitter type="point"><point name="position" x="1" y="2" z="3"/><spectrum name="intensity" value="400:1, 700:2"/></emitter>
<emitter type="spot"/><emitter type="directional"/><include filename="part.xml"/></scene>)",
      R"(<scene version="0.6.0"><integrator type="volpath"><integer name="maxDepth" value="5"/></integrator><shape type="cylinder"><point name="p0" x="0" y="0" z="0"/>
<bsdf type="dielectric"><float name="intIOR" value="1.5"/></bsdf></shape><medium id="m" type="homogeneous"><rgb name="sigmaA" value="1"/><rgb name="sigmaS" value="2"/></medium></scene>)",
      R"(<scene><integrator type="path_mis"/><camera type="perspective"><transform name="toWorld"><lookat target="0,0,0" origin="1,2,3" up="0,1,0"/></transform>
<float name="fov" value="30"/><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="gaussian"/></camera>
<sampler type="independent"><integer name="sampleCount" value="8"/></sampler><mesh type="obj"><string name="filename" value="a.obj"/>
<bsdf type="microfacet"><color name="kd" value="0.2 0.3 0.4"/><float name="alpha" value=".1"/></bsdf><emitter type="area"><color name="radiance" value="3,3,3"/></emitter></mesh></scene>)",
      R"(<test type="ttest"><string name="references" value="0.5"/><scene><camera type="perspective"/><mesh type="obj"><string name="filename" value="a.obj"/></mesh></scene></test>)",
      R"(<scene version="3.0.0"><include filename="self.xml"/><shape type="ply"><string name="filename" value="missing.ply"/></shape><shape type="spere"/></scene>)",
  };
}

Seeds scene_pbrt_seeds() {
  return {
      R"(LookAt 0 1 -4 0 0 0 0 1 0 Camera "perspective" "float fov" 40 "float lensradius" .1 "float focaldistance" 4
Film "rgb" "integer xresolution" 32 "integer yresolution" [ 24 ] "float iso" 200 "float cropwindow" [ 0 .5 .25 1 ]
Sampler "halton" "integer pixelsamples" 8 PixelFilter "triangle" "float xradius" 1 Integrator "volpath" "integer maxdepth" 8
WorldBegin
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ .1 .2 .3 ] "rgb sigma_s" [ 1 2 3 ] "float g" .3 "blackbody Le" 2000
MakeNamedMedium "smoke" "string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 1 2 ]
MakeNamedMedium "cloud" "string type" "nanovdb" "string filename" "c.nvdb"
AttributeBegin MediumInterface "fog" "" Material "interface" Translate 1 0 0 Rotate 30 0 1 0 Scale 2 2 2 Shape "sphere" AttributeEnd
MediumInterface "smoke" "" Material "none" Shape "sphere" "float radius" 2
MediumInterface "" "" AreaLightSource "diffuse" "blackbody L" 4000 "float scale" 2
Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 ] "point2 uv" [ 0 0 1 0 0 1 ] "integer indices" [ 0 1 2 ])",
      R"(Camera "orthographic" WorldBegin Texture "t" "spectrum" "imagemap" "string filename" "a.png" "float vscale" 2
Texture "c" "float" "checkerboard" "float tex1" .3 "texture tex2" "t" Texture "k" "float" "constant" "float value" .25
MakeNamedMaterial "a" "string type" "coateddiffuse" "texture reflectance" "t" "float roughness" .1
MakeNamedMaterial "b" "string type" "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "texture roughness" "k"
Material "mix" "string materials" [ "a" "b" ] "texture amount" "c" Shape "disk" "float radius" 2
NamedMaterial "b" ObjectBegin "o" Shape "plymesh" "string filename" "m.ply" "float alpha" .5 ObjectEnd
CoordinateSystem "here" ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 2 3 4 1 ] ObjectInstance "o" CoordSysTransform "here"
LightSource "spot" "point3 from" [ 0 0 5 ] "spectrum I" [ 400 1 700 2 ] LightSource "infinite" "string mapname" "sky.exr"
LightSource "distant" "rgb L" [ 1 1 1 ] LightSource "point" "float power" 10 Import "part.pbrt" Include "part.pbrt"
Material "dielectric" "spectrum eta" "glass-BK7" Shape "cylinder" ReverseOrientation Shape "bilinearmesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 ])",
      R"(Camera "perspective" WorldBegin MakeNamedMedium "r" "string type" "rgbgrid" "integer nx" 1 "rgb sigma_s" [ 1 2 3 ]
MediumInterface "r" "" Material "" Shape "sphere" Include "self.pbrt" Shape "plymesh" "string filename" "missing.ply")",
  };
}

Seeds scene_gltf_seeds() {
  const std::string mesh =
      R"("buffers":[{"byteLength":80,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA="},{"byteLength":256,"uri":"more.bin"}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":1,"byteLength":256,"byteStride":16},{"buffer":0,"byteOffset":36,"byteLength":2}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},
{"bufferView":2,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},
{"componentType":5126,"count":3,"type":"VEC2","sparse":{"count":1,"indices":{"bufferView":3,"componentType":5121},"values":{"bufferView":2}}},
{"componentType":5126,"count":2,"type":"MAT4"},{"componentType":5121,"count":3,"type":"VEC4"},{"bufferView":0,"componentType":5126,"count":1,"type":"SCALAR"}],)";
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2,3]}],"nodes":[{"mesh":0,"children":[1],"translation":[1,2,3],"rotation":[0,0,1,0]},
{"camera":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]},{"mesh":0,"scale":[1,-2,3],"extensions":{"KHR_lights_punctual":{"light":0},"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":2,"ROTATION":3}}}},{"mesh":1,"skin":0,"weights":[0.5]}],"skins":[{"joints":[0,1],"inverseBindMatrices":5}],
"cameras":[{"type":"perspective","name":"c","perspective":{"yfov":0.7,"aspectRatio":1.5,"znear":0.1}}],
"extensionsUsed":["KHR_materials_sheen"],"extensionsRequired":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","intensity":3,"spot":{"outerConeAngle":0.5}}]}},
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":2,"TEXCOORD_0":4,"COLOR_0":3},"indices":1,"material":0},{"attributes":{"POSITION":2},"mode":5,"material":1}]},
{"primitives":[{"attributes":{"POSITION":0,"NORMAL":2,"JOINTS_0":6,"WEIGHTS_0":3},"targets":[{"POSITION":2,"NORMAL":0}]}],"weights":[1]}],
"images":[{"uri":"a%20b.png"},{"uri":"data:image/png;base64,iVBORw0KGgo="}],"textures":[{"source":0,"sampler":0},{"source":1}],"samplers":[{"wrapS":33071,"wrapT":33648,"magFilter":9728}],
"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"offset":[0.1,0.2],"rotation":1,"scale":[2,3]}}},"metallicRoughnessTexture":{"index":1}},
"normalTexture":{"index":1,"scale":0.5},"alphaMode":"MASK","extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":0.5},"KHR_materials_specular":{"specularFactor":0.3}}},
{"emissiveFactor":[1,0.5,0.2],"doubleSided":true,"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":5},"KHR_materials_ior":{"ior":1.4},"KHR_materials_transmission":{"transmissionFactor":1},
"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[0.5,0.6,0.9]}},"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0}}],)" +
      mesh +
      R"("animations":[{"name":"go","samplers":[{"input":7,"output":0},{"input":7,"output":3,"interpolation":"STEP"},{"input":7,"output":0,"interpolation":"CUBICSPLINE"}],
"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}},{"sampler":1,"target":{"node":2,"path":"rotation"}},{"sampler":2,"target":{"node":3,"path":"weights"}}]}]})";
  while (json.size() % 4) json += ' ';
  const auto word = [](std::size_t x) {
    std::string out;
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(x >> shift & 0xff);
    return out;
  };
  const std::string small =
      R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":6,"type":"VEC3"}],"bufferViews":[{"buffer":0,"byteLength":72}],"buffers":[{"byteLength":72}]})";
  const std::string chunk = word(small.size()) + "JSON" + small + word(72) + std::string("BIN\0", 4) +
                            std::string(36, '\x3f') + std::string(36, '\x40');
  return {json, "glTF" + word(2) + word(12 + chunk.size()) + chunk,
          R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"]})"};
}

Seeds scene_json_seeds() {
  AnyFile files;
  Seeds seeds{"{}"};
  for (const std::string& xml : scene_xml_seeds()) {
    const auto read = read_scene("seed.xml", xml, files, {{{"name", "a.png"}}});
    if (read.scene) seeds.push_back(serialize(*read.scene));
  }
  return seeds;
}

}  // namespace ls::fuzz
