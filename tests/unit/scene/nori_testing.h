// A Nori scene with one object of each kind, each on a line of its own.
#pragma once

#include <string>

#include "tests/unit/scene/scene_testing.h"

namespace ls {

inline const std::string kNoriCamera =
    R"(<integrator type="path_mis"/><camera type="perspective"><integer name="width" value="8"/><integer name="height" value="8"/></camera>)";

// Returns a Nori scene of these objects and a camera. The objects begin in line 2, column 1.
inline std::string nori_scene(std::string_view objects) {
  return fmt::format("<scene>\n{}\n{}</scene>\n", objects, kNoriCamera);
}

inline const std::string kNoriExample = R"(<?xml version="1.0" encoding="utf-8"?>
<scene>
  <!-- a room -->
  <integrator type="volpath_distant_mis">
    <string name="distance" value="equiangular"/>
    <string name="heuristic" value="balance"/>
  </integrator>
  <sampler type="independent">
    <integer name="sampleCount" value="32"/>
  </sampler>
  <camera type="perspective">
    <transform name="toWorld">
      <scale value="-1,1,1"/>
      <lookat origin="0, 1, -5" target="0, 1, 0" up="0, 1, 0"/>
    </transform>
    <float name="fov" value="40"/>
    <float name="nearClip" value="0.01"/>
    <float name="farClip" value="1000"/>
    <integer name="width" value="64"/>
    <integer name="height" value="48"/>
    <float name="apertureRadius" value="0.05"/>
    <float name="focusDistance" value="5"/>
    <rfilter type="gaussian">
      <float name="stddev" value="0.4"/>
      <float name="radius" value="1.6"/>
    </rfilter>
  </camera>
  <mesh type="obj">
    <string name="filename" value="mesh.obj"/>
    <transform name="toWorld">
      <scale value="2 2 2"/>
      <rotate angle="90" axis="0 1 0"/>
      <translate value="0.5,0,0"/>
    </transform>
    <bsdf type="diffuse">
      <texture type="checkerboard_color" name="albedo">
        <color name="value1" value="0.1 0.2 0.3"/>
        <color name="value2" value="0.8,0.7,0.6"/>
        <vector name="scale" value="0.5,0.25"/>
        <point name="delta" value="0.5,0"/>
      </texture>
    </bsdf>
  </mesh>
  <mesh type="obj">
    <string name="filename" value="mesh.obj"/>
    <bsdf type="microfacet">
      <float name="alpha" value="0.2"/>
      <float name="intIOR" value="1.5"/>
      <float name="extIOR" value="1"/>
      <color name="kd" value="0.2 0.4 0.1"/>
    </bsdf>
  </mesh>
  <mesh type="obj">
    <string name="filename" value="mesh.obj"/>
    <bsdf type="microfacet_tex">
      <texture type="imagetexture" name="kd">
        <string name="filename" value="wood.png"/>
        <boolean name="srgb" value="false"/>
        <string name="wrap" value="mirror"/>
        <string name="filter" value="nearest"/>
      </texture>
    </bsdf>
  </mesh>
  <mesh type="obj">
    <string name="filename" value="mesh.obj"/>
    <bsdf type="roughconductor">
      <color name="eta" value="0.2 0.9 1.1"/>
      <color name="k" value="3.9 2.5 2.1"/>
      <float name="alpha" value="0.3"/>
      <string name="distribution" value="ggx"/>
    </bsdf>
  </mesh>
  <mesh type="sphere">
    <point name="center" value="1 2 3"/>
    <float name="radius" value="0.5"/>
    <medium type="homogeneous">
      <color name="sigma_t" value="0.5 0.6 0.7"/>
      <color name="albedo" value="0.9 0.8 0.7"/>
      <float name="scale" value="2"/>
      <phase type="hg">
        <float name="g" value="0.5"/>
      </phase>
    </medium>
  </mesh>
  <mesh type="sphere">
    <bsdf type="dielectric">
      <float name="intIOR" value="1.33"/>
      <float name="extIOR" value="1"/>
    </bsdf>
  </mesh>
  <mesh type="sphere">
    <bsdf type="mirror"/>
    <emitter type="spot">
      <color name="radiance" value="5 4 3"/>
      <float name="cutoff" value="30"/>
      <float name="beam_width" value="10"/>
      <float name="falloff" value="4"/>
    </emitter>
  </mesh>
  <mesh type="obj">
    <string name="filename" value="mesh.obj"/>
    <emitter type="area">
      <color name="radiance" value="15,15,15"/>
    </emitter>
  </mesh>
  <mesh type="sphere">
    <medium type="heterogeneous">
      <volume type="gridvolume" name="sigma_t">
        <string name="filename" value="cloud.vol"/>
      </volume>
      <volume type="constvolume" name="albedo">
        <float name="value" value="0.6"/>
      </volume>
    </medium>
    <bsdf type="transparent"/>
  </mesh>
  <emitter type="point">
    <point name="position" value="1, 2, 3"/>
    <color name="power" value="4 5 6"/>
  </emitter>
  <emitter type="distant">
    <vector name="direction" value="0,-1,0"/>
    <color name="irradiance" value="2 2 2"/>
    <float name="angularRadius" value="0.267"/>
  </emitter>
  <emitter type="spot">
    <point name="position" value="0 5 0"/>
    <vector name="direction" value="0 -1 0"/>
    <color name="intensity" value="9 9 9"/>
    <float name="cutoff" value="40"/>
  </emitter>
  <emitter type="envmap">
    <string name="filename" value="wood.png"/>
    <float name="strength" value="0.5"/>
  </emitter>
</scene>
)";

}  // namespace ls
