// Scene texts of strangers: read, described, written in both forms and read back to the same scene.
#include "common/scene/analysis/needs.h"
#include "common/scene/analysis/prune.h"
#include "common/scene/diagnostic.h"
#include "common/scene/json/serialize.h"
#include "common/scene/read.h"
#include "common/scene/reader/nori_test.h"
#include "common/scene/reader/xml_write.h"
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
    return std::string(R"(<scene version="3.0.0"><bsdf type="diffuse" id="included"/></scene>)");
  }
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
  if (is_nori_test(text_of(input))) {
    const auto read = read_nori_test("fuzz.xml", text_of(input), files, options);
    return check_diagnostics(read.diagnostics, read.test.has_value());
  }
  const auto read = read_scene("fuzz.xml", text_of(input), files, options);
  check_diagnostics(read.diagnostics, read.scene.has_value());
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
