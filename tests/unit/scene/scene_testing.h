// Shared by the tests of scene reading: files in memory, and scenes that name them.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/json/serialize.h"
#include "formats/read.h"

namespace ls {

class MemoryAssets final : public AssetSource {
 public:
  std::map<std::string, std::string, std::less<>> files{{"cloud.vol", "VOL..."},
                                                        {"steam.vdb", "VDB..."},
                                                        {"wood.png", "PNG..."},
                                                        {"mesh.obj", "o"},
                                                        {"mesh.ply", "p"}};
  int reads = 0;

  Result<Asset> find(std::string_view name) override {
    const auto it = files.find(name);
    if (it == files.end()) return fail(Errc::not_found, fmt::format("there is no file \"{}\"", name));
    return Asset{std::string(name), sha256(it->second), it->second.size()};
  }
  Result<std::string> text(std::string_view name) override {
    ++reads;
    const auto it = files.find(name);
    if (it == files.end()) return fail(Errc::not_found, fmt::format("there is no file \"{}\"", name));
    return it->second;
  }
};

inline const std::string kSensor =
    R"(<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film></sensor>)";

// True if there is no diagnostic, except the warning that the camera is inside a medium. Many tests get this
// warning, since their camera is at the origin by default.
inline bool quiet(const ReadResult& r) {
  return std::all_of(r.diagnostics.begin(), r.diagnostics.end(), [](const Diagnostic& d) {
    return d.severity == Diagnostic::Severity::warning && d.text.starts_with("the camera is inside");
  });
}

// Returns a scene of these objects and a camera. The objects begin in line 2, column 1.
inline std::string with_sensor(std::string_view objects) {
  return fmt::format("<scene version=\"3.0.0\">\n{}\n{}</scene>\n", objects, kSensor);
}

inline ReadResult read(std::string_view text, const ReadOptions& options = {}) {
  MemoryAssets assets;
  return read_scene("test.xml", text, assets, options);
}

inline std::string first(const ReadResult& r) { return r.diagnostics.empty() ? "" : r.diagnostics[0].text; }
inline std::string messages(const ReadResult& r) { return format_diagnostics(r.diagnostics); }

inline Scene must_read(std::string_view text, const ReadOptions& options = {}) {
  ReadResult r = read(text, options);
  if (!r.scene) throw std::runtime_error(messages(r));
  return std::move(*r.scene);
}

// A scene with one object of each kind, each on a line of its own, so that a diagnostic's line identifies it.
inline const std::string kExample = R"(<scene version="3.0.0">
  <default name="spp" value="16"/>
  <integrator type="volpathmis">
    <integer name="max_depth" value="12"/>
    <integer name="rr_depth" value="4"/>
    <boolean name="hide_emitters" value="true"/>
  </integrator>
  <texture type="checkerboard" id="checks">
    <rgb name="color0" value="0.1, 0.2 0.3"/>
    <texture type="bitmap" name="color1">
      <string name="filename" value="wood.png"/>
      <string name="filter_type" value="nearest"/>
      <string name="wrap_mode" value="mirror"/>
      <boolean name="raw" value="true"/>
    </texture>
    <transform name="to_uv">
      <scale x="12" y="6"/>
      <translate x="0.5"/>
    </transform>
  </texture>
  <bsdf type="twosided" id="ground">
    <bsdf type="diffuse">
      <ref name="reflectance" id="checks"/>
    </bsdf>
    <bsdf type="roughplastic">
      <string name="distribution" value="ggx"/>
      <float name="alpha" value="0.2"/>
      <string name="int_ior" value="water"/>
      <boolean name="nonlinear" value="true"/>
      <rgb name="diffuse_reflectance" value="0.2"/>
    </bsdf>
  </bsdf>
  <bsdf type="roughconductor" id="brass">
    <float name="alpha_u" value="0.1"/>
    <float name="alpha_v" value="0.3"/>
    <rgb name="eta" value="0.4 0.5 1.1"/>
    <rgb name="k" value="3.7 2.8 1.8"/>
  </bsdf>
  <bsdf type="conductor" id="gold">
    <string name="material" value="Au"/>
  </bsdf>
  <phase type="hg" id="forward">
    <float name="g" value="0.5"/>
  </phase>
  <medium type="homogeneous" id="fog">
    <rgb name="sigma_t" value="0.5 0.6 0.7"/>
    <spectrum name="albedo" value="0.9"/>
    <float name="scale" value="2"/>
    <ref id="forward"/>
  </medium>
  <medium type="heterogeneous" id="cloud">
    <volume type="gridvolume" name="sigma_t">
      <string name="filename" value="cloud.vol"/>
      <boolean name="use_grid_bbox" value="true"/>
      <transform name="to_world">
        <rotate y="1" angle="30"/>
      </transform>
    </volume>
    <volume type="constvolume" name="albedo">
      <rgb name="value" value="0.99"/>
    </volume>
    <float name="temperature" value="1200"/>
    <phase type="isotropic"/>
  </medium>
  <shape type="rectangle">
    <transform name="to_world">
      <scale value="4"/>
      <rotate x="1" angle="-90"/>
    </transform>
    <ref id="ground"/>
  </shape>
  <shape type="sphere">
    <point name="center" x="1" y="2" z="3"/>
    <float name="radius" value="0.5"/>
    <bsdf type="dielectric">
      <string name="int_ior" value="bk7"/>
      <float name="ext_ior" value="1"/>
    </bsdf>
    <ref name="interior" id="fog"/>
    <ref name="exterior" id="cloud"/>
  </shape>
  <shape type="cube">
    <bsdf type="null"/>
    <ref name="interior" id="cloud"/>
  </shape>
  <shape type="disk">
    <boolean name="flip_normals" value="true"/>
    <emitter type="area">
      <rgb name="radiance" value="5 4 3"/>
    </emitter>
  </shape>
  <shape type="obj">
    <string name="filename" value="mesh.obj"/>
    <boolean name="face_normals" value="true"/>
    <ref id="brass"/>
  </shape>
  <shape type="ply">
    <string name="filename" value="mesh.ply"/>
    <ref id="gold"/>
  </shape>
  <emitter type="constant">
    <rgb name="radiance" value="0.1"/>
  </emitter>
  <emitter type="directional">
    <vector name="direction" x="0" y="-1" z="0"/>
    <rgb name="irradiance" value="2"/>
  </emitter>
  <emitter type="point">
    <point name="position" value="1, 2, 3"/>
    <float name="intensity" value="7"/>
  </emitter>
  <emitter type="spot">
    <transform name="to_world">
      <lookat origin="0 5 0" target="0 0 0" up="0 0 1"/>
    </transform>
    <float name="cutoff_angle" value="30"/>
    <float name="beam_width" value="10"/>
    <ref name="texture" id="checks"/>
  </emitter>
  <sensor type="thinlens">
    <float name="fov" value="40"/>
    <string name="fov_axis" value="smaller"/>
    <float name="aperture_radius" value="0.1"/>
    <float name="focus_distance" value="5"/>
    <float name="near_clip" value="0.1"/>
    <transform name="to_world">
      <matrix value="1 0 0 0 0 1 0 0 0 0 1 -5 0 0 0 1"/>
    </transform>
    <ref name="medium" id="fog"/>
    <sampler type="independent">
      <integer name="sample_count" value="$spp"/>
    </sampler>
    <film type="hdrfilm">
      <integer name="width" value="32"/>
      <integer name="height" value="24"/>
      <rfilter type="tent">
        <float name="radius" value="1.5"/>
      </rfilter>
    </film>
  </sensor>
</scene>
)";

}  // namespace ls
