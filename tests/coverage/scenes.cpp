#include "tests/coverage/scenes.h"

#include <fmt/format.h>

namespace ls::test {
namespace {

std::string scene(const std::string& inside, const std::string& eye = "0, 0, 3.9", int depth = 8,
                  int path_reuse = -1) {
  return fmt::format(R"(<scene version="3.0.0">
<integrator type="volpath"><integer name="max_depth" value="{}"/><integer name="rr_depth" value="5"/><integer name="path_reuse" value="{}"/></integrator>
<sensor type="perspective"><float name="fov" value="39"/>
  <transform name="to_world"><lookat origin="{}" target="0, 0, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.73, 0.73, 0.73"/></bsdf></bsdf>
<bsdf type="twosided" id="red"><bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.07, 0.05"/></bsdf></bsdf>
<bsdf type="twosided" id="green"><bsdf type="diffuse"><rgb name="reflectance" value="0.12, 0.45, 0.1"/></bsdf></bsdf>
{}</scene>)",
                     depth, path_reuse, eye, inside);
}

std::string cube(double sx, double sy, double sz, double x, double y, double z, const std::string& rest) {
  return fmt::format(
      R"(<shape type="cube"><transform name="to_world"><scale x="{}" y="{}" z="{}"/><translate x="{}" y="{}" z="{}"/></transform>{}</shape>
)",
      sx, sy, sz, x, y, z, rest);
}

std::string sphere(double x, double y, double z, double radius, const std::string& rest) {
  return fmt::format(
      R"(<shape type="sphere"><point name="center" x="{}" y="{}" z="{}"/><float name="radius" value="{}"/>{}</shape>
)",
      x, y, z, radius, rest);
}

std::string ref(const std::string& id) { return fmt::format(R"(<ref id="{}"/>)", id); }

std::string sky(double level) {
  return fmt::format(R"(<emitter type="constant"><rgb name="radiance" value="{0}, {0}, {0}"/></emitter>
)",
                     level);
}

// In front of the room and above what the camera sees.
std::string lamp(double level, double radius = .25) {
  return sphere(.2, 1.15, 1.7, radius,
                fmt::format(R"(<emitter type="area"><rgb name="radiance" value="{}, {}, {}"/></emitter>)",
                            level, .83 * level, .61 * level));
}

std::string room(const std::string& light) {
  return cube(1.1, .05, 1.1, 0, -1.05, 0, ref("white")) + cube(1.1, .05, 1.1, 0, 1.05, 0, ref("white")) +
         cube(1, 1, .05, 0, 0, -1.05, ref("white")) + cube(.05, 1, 1.1, -1.05, 0, 0, ref("red")) +
         cube(.05, 1, 1.1, 1.05, 0, 0, ref("green")) + cube(.3, .6, .3, -.4, -.4, -.3, ref("white")) +
         sphere(.45, -.65, .2, .35, ref("white")) + light;
}

std::string fog(double sigma, double albedo, double half) {
  return fmt::format(
             R"(<medium type="homogeneous" id="fog"><rgb name="sigma_t" value="{0}, {0}, {0}"/><rgb name="albedo" value="{1}, {1}, {1}"/><phase type="hg"><float name="g" value="0.2"/></phase></medium>
)",
             sigma, albedo) +
         cube(half, half, half, 0, 0, 0, R"(<bsdf type="null"/><ref name="interior" id="fog"/>)");
}

// Light through a ball of glass falls on the floor along paths that only chance finds.
std::string caustic() {
  return cube(1.1, .05, 1.1, 0, -1.05, 0, ref("white")) + cube(1, 1, .05, 0, 0, -1.05, ref("white")) +
         sphere(0, -.3, 0, .4, R"(<bsdf type="dielectric"><float name="int_ior" value="1.5"/></bsdf>)") +
         sphere(.3, 1.4, .2, .1,
                R"(<emitter type="area"><rgb name="radiance" value="300, 300, 300"/></emitter>)");
}

// A closed room into which the sun shines through a slit: its paths are connected to light vertices, which
// all pixels share.
std::string slit() {
  return cube(1.1, .05, 1.1, 0, -1.05, 0, ref("white")) + cube(1.1, .05, 1.1, 0, 1.05, 0, ref("white")) +
         cube(1, 1, .05, 0, 0, -1.05, ref("white")) + cube(1, 1, .05, 0, 0, 4.5, ref("white")) +
         cube(.05, 1, 2.8, -1.05, 0, 1.7, ref("red")) + cube(.05, .55, 2.8, 1.05, -.45, 1.7, ref("green")) +
         cube(.05, .3, 2.8, 1.05, .7, 1.7, ref("green")) +
         R"(<emitter type="directional"><vector name="direction" x="-1" y="-0.6" z="-0.2"/><rgb name="irradiance" value="40, 36, 30"/></emitter>)";
}

// Nearly all noise is light that was scattered several times.
std::string lit_from_within() {
  return room(
             R"(<shape type="rectangle"><transform name="to_world"><scale x="0.25" y="0.25"/><rotate x="1" angle="90"/><translate y="0.985"/></transform><emitter type="area"><rgb name="radiance" value="18, 15, 11"/></emitter></shape>
)") + fog(.6, .9, .995);
}

std::string in_group(const std::string& group, double red, double green, double blue) {
  return fmt::format(
      R"(<emitter type="area"><string name="light_group" value="{}"/><rgb name="radiance" value="{}, {}, {}"/></emitter>)",
      group, red, green, blue);
}

}  // namespace

std::string mix_scene(bool with_fog) {
  return scene(room(sphere(.2, 1.15, 1.7, .25, in_group("key", 60, 50, 37)) +
                    sphere(-.6, .6, .6, .15, in_group("fill", 5, 9, 20)) +
                    sphere(.5, .7, -.6, .1, in_group("rim", 30, 10, 5)) + sky(.2)) +
                   (with_fog ? fog(.6, .9, .995) : ""),
               "0, 0, 3.9", 8, 0);
}

const std::vector<CoverageScene>& coverage_scenes() {
  static const std::vector<CoverageScene> all = {
      {"surfaces, smooth",
       scene(cube(1.5, .05, 1.5, 0, -1.05, 0, ref("white")) + sphere(-.4, -.5, 0, .5, ref("red")) +
             sphere(.6, -.6, .3, .4, ref("green")) + sky(.8))},
      {"surfaces, noisy", scene(room(lamp(400, .1)))},
      {"surfaces, dark", scene(room(lamp(40, .1)))},
      {"media, smooth", scene(fog(.5, .9, .9) + sky(.7))},
      {"media, noisy", scene(room(lamp(60)) + fog(.6, .9, .995))},
      {"media, dark", scene(fog(2, .95, .9) + lamp(2))},
      {"surfaces, connected", scene(slit())},
      {"media, connected", scene(slit() + fog(.3, .9, .99))},
      {"surfaces, shared", scene(room(lamp(400, .1)), "0, 0, 3.9", 8, 16)},
      {"media, shared", scene(room(lamp(60)) + fog(.6, .9, .995), "0, 0, 3.9", 8, 16)},
      {"fog, lit from within", scene(lit_from_within(), "0, 0, 3.9", 16, 16)},
      {"surfaces, to a target", scene(room(lamp(400, .1))), 4096, false, 1.5e-3},
      {"media, to a target", scene(fog(1, .9, .9) + lamp(60, .1)), 4096, false, 1e-4},
      {"surfaces, shared, to a target", scene(room(lamp(400, .1)), "0, 0, 3.9", 8, 16), 4096, false, 1e-3},
      {"media, shared, to a target", scene(room(lamp(60)) + fog(.6, .9, .995), "0, 0, 3.9", 8, 16), 4096,
       false, 6e-4},
      {"fireflies", scene(caustic()), 64, true},
      {"fireflies, to a target", scene(caustic()), 1024, true, .2},
  };
  return all;
}

}  // namespace ls::test
