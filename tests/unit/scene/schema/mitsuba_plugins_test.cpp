// Compares the table of Mitsuba's plugins with the result of reading each plugin.
#include "formats/reader/mitsuba_plugins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/integrators.h"
#include "tests/unit/scene/scene_testing.h"

namespace ls::scene {
namespace {

// Returns a scene with the plugin in an element that may contain it.
std::string scene_with(const PluginRow& row) {
  const std::string object = fmt::format("<{} type=\"{}\"/>", row.tag, row.name);
  const auto sensor = [](std::string_view inside) {
    return fmt::format("<scene version=\"3.0.0\"><sensor type=\"perspective\">{}</sensor></scene>", inside);
  };
  if (row.tag == "sensor") return fmt::format("<scene version=\"3.0.0\">{}</scene>", object);
  if (row.tag == "film" || row.tag == "sampler") return sensor(object);
  if (row.tag == "rfilter") return sensor(fmt::format("<film type=\"hdrfilm\">{}</film>", object));
  if (row.tag == "emitter" && row.name.ends_with("area"))
    return with_sensor(fmt::format("<shape type=\"sphere\">{}</shape>", object));
  return with_sensor(object);
}

TEST(MitsubaPlugins, AreReadOrRefusedWithTheReasonOfTheTable) {
  for (const PluginRow& row : mitsuba_plugins()) {
    const ReadResult r = read(scene_with(row));

    const std::string said = messages(r);
    const std::string refusal =
        fmt::format("the {} \"{}\" is not supported: {}", row.tag, row.name, row.note);
    if (row.standing == Standing::refused) {
      EXPECT_NE(said.find(refusal), std::string::npos) << said;
      EXPECT_FALSE(r.scene) << row.name;
    } else {
      EXPECT_EQ(said.find("is not supported"), std::string::npos) << said;
      EXPECT_EQ(said.find("there is no "), std::string::npos) << said;
    }
  }
}

TEST(MitsubaPlugins, SayWhatIsLeftOutAndWhatToUseInstead) {
  std::set<std::pair<std::string_view, std::string_view>> seen;
  for (const PluginRow& row : mitsuba_plugins()) {
    EXPECT_TRUE(row.standing == Standing::read || !row.note.empty()) << row.name;
    EXPECT_TRUE(seen.emplace(row.tag, row.name).second) << row.tag << " " << row.name << " stands twice";
  }
}

template <class Variant>
void expect_all_read(std::string_view tag, std::set<std::string_view> internal = {}) {
  for (const std::string_view name : kKindsOf<Variant>)
    EXPECT_NE(internal.contains(name), is_read_plugin(tag, name)) << tag << " " << name;
}

TEST(MitsubaPlugins, ListAllPluginsOfTheReader) {
  expect_all_read<Bsdf>("bsdf");
  expect_all_read<Texture>("texture", {"constant"});  // in files it is a colour
  expect_all_read<Emitter>("emitter");
  expect_all_read<Medium>("medium");
  expect_all_read<Phase>("phase");
  expect_all_read<Volume>("volume");
  expect_all_read<Geometry>("shape", {"mesh"});  // in files it is named by its format
  expect_all_read<ReconstructionFilter>("rfilter");
  for (const IntegratorRow& row : integrators())
    EXPECT_TRUE(is_read_plugin("integrator", row.name)) << row.name;
  for (const WrapperRow& row : integrator_wrappers())
    EXPECT_TRUE(is_read_plugin("integrator", row.name)) << row.name;
}

// The default max_depth of Mitsuba 3's differentiable integrators is 6.
TEST(MitsubaPlugins, HaveMitsubasDefaultDepth) {
  const auto depth = [](const std::string& integrator) {
    return must_read(with_sensor(integrator)).integrator.max_depth;
  };
  for (const char* type : {"prb", "prb_basic", "prb_projective", "prbvolpath"}) {
    EXPECT_EQ(depth(fmt::format("<integrator type=\"{}\"/>", type)), 6);
    EXPECT_EQ(depth(fmt::format(
                  "<integrator type=\"{}\"><integer name=\"max_depth\" value=\"-1\"/></integrator>", type)),
              -1);
  }
  EXPECT_EQ(depth("<integrator type=\"path\"/>"), -1);
  EXPECT_EQ(depth("<integrator type=\"direct_projective\"/>"), 2);
}

// The parameters that Mitsuba 3.9.1 has, of those that write_xml() writes: it loads a scene with all of them,
// and refuses each other one as unreferenced.
bool mitsuba_has(std::string_view plugin, std::string_view parameter) {
  using Names = std::vector<std::string_view>;
  static const Names glass{"int_ior", "ext_ior", "specular_reflectance", "specular_transmittance"},
      rough{"distribution", "alpha_u", "alpha_v"}, metal{"eta", "k", "specular_reflectance"},
      coat{"int_ior", "ext_ior", "nonlinear", "diffuse_reflectance", "specular_reflectance"},
      mapped{"flip_invalid_normals", "use_shadowing_function"},
      mesh{"filename", "face_normals", "flip_tex_coords"},
      view{"to_world", "fov", "fov_axis", "near_clip", "far_clip", "shutter_open", "shutter_close"},
      path{"max_depth", "rr_depth", "hide_emitters"}, medium{"sigma_t", "albedo", "scale"};
  static const std::map<std::string_view, std::vector<Names>> all{
      {"sphere", {{"center", "radius"}}},
      {"cylinder", {{"p0", "p1", "radius"}}},
      {"obj", {mesh}},
      {"ply", {mesh}},
      {"serialized", {mesh, {"shape_index"}}},
      {"instance", {{"to_world"}}},
      {"diffuse", {{"reflectance"}}},
      {"conductor", {metal}},
      {"roughconductor", {metal, rough}},
      {"dielectric", {glass}},
      {"thindielectric", {glass}},
      {"roughdielectric", {glass, rough}},
      {"plastic", {coat}},
      {"roughplastic", {coat, {"distribution", "alpha"}}},
      {"mask", {{"opacity"}}},
      {"blendbsdf", {{"weight"}}},
      {"normalmap", {mapped, {"normalmap"}}},
      {"bumpmap", {mapped, {"texture", "scale"}}},
      {"principled",
       {{"base_color", "roughness", "anisotropic", "metallic", "spec_trans", "eta", "spec_tint", "sheen",
         "sheen_tint", "flatness", "clearcoat", "clearcoat_gloss"}}},
      {"bitmap", {{"filename", "filter_type", "wrap_mode", "raw", "to_uv"}}},
      {"checkerboard", {{"color0", "color1", "to_uv"}}},
      {"mesh_attribute", {{"name", "scale"}}},
      {"area", {{"radiance"}}},
      {"constant", {{"radiance"}}},
      {"directional", {{"direction", "irradiance"}}},
      {"point", {{"position", "intensity"}}},
      {"spot", {{"to_world", "intensity", "cutoff_angle", "beam_width", "texture"}}},
      {"envmap", {{"filename", "scale", "to_world"}}},
      {"projector", {{"irradiance", "scale", "to_world", "fov", "fov_axis"}}},
      {"homogeneous", {medium}},
      {"heterogeneous", {medium}},
      {"hg", {{"g"}}},
      {"tabphase", {{"values"}}},
      {"blendphase", {{"weight"}}},
      {"constvolume", {{"value", "to_world"}}},
      {"gridvolume", {{"filename", "filter_type", "wrap_mode", "raw", "to_world", "use_grid_bbox"}}},
      {"perspective", {view, {"principal_point_offset_x", "principal_point_offset_y"}}},
      {"thinlens", {view, {"aperture_radius", "focus_distance"}}},
      {"tent", {{"radius"}}},
      {"gaussian", {{"stddev"}}},
      {"path", {path}},
      {"volpath", {path}},
  };
  const auto found = all.find(plugin);
  return found != all.end() && std::ranges::any_of(found->second, [&](const Names& names) {
           return std::ranges::find(names, parameter) != names.end();
         });
}

// Asks about each parameter that files of a kind of objects have, and those of its plugins that Mitsuba has.
struct Asker {
  std::string_view tag, plugin;
  std::vector<std::string>* wrong;
  template <class T>
  void field(const Field& f, const T&) const {
    // Objects of these two kinds stand within others without a name, or have no place in files of their own.
    if (f.given_as.starts_with('<') || (f.derived && f.given_as.empty())) return;
    if (f.name == "interior" || f.name == "exterior" || f.name == "medium") return;
    if (!f.belongs_to(plugin)) return;
    if (mitsuba_has(plugin, f.name) == is_our_parameter(tag, plugin, f.name))
      wrong->push_back(fmt::format("{} \"{}\" {}", tag, plugin, f.name));
  }
};
template <class Kind>
void ask(std::vector<std::string>& wrong, std::initializer_list<std::string_view> plugins) {
  for (const std::string_view plugin : plugins) {
    const PluginRow* row = plugin_row(kInfo<Kind>.kind, plugin);
    if (row && row->origin == Origin::mitsuba3) {
      Asker asker{kInfo<Kind>.kind, plugin, &wrong};
      const Kind object{};
      describe(asker, object);
    }
  }
}
template <class... Kinds>
void ask_all(std::vector<std::string>& wrong, std::type_identity<std::variant<Kinds...>>) {
  (ask<Kinds>(wrong, {kInfo<Kinds>.name}), ...);
}

// If this fails for a new parameter: is_our_parameter() has to say that it is ours, so that `convert` does,
// or Mitsuba has it, and it belongs into the table above.
TEST(MitsubaPlugins, LightshaftsOwnParametersAreKnown) {
  std::vector<std::string> wrong;
  ask<MeshShape>(wrong, {"obj", "ply", "serialized"});
  ask<IntegratorSettings>(wrong, {"path", "volpath"});
  ask_all(wrong, std::type_identity<Geometry>{});
  ask_all(wrong, std::type_identity<Bsdf>{});
  ask_all(wrong, std::type_identity<Texture>{});
  ask_all(wrong, std::type_identity<Emitter>{});
  ask<AreaEmitter>(wrong, {"area"});
  ask_all(wrong, std::type_identity<Medium>{});
  ask_all(wrong, std::type_identity<Phase>{});
  ask_all(wrong, std::type_identity<Volume>{});
  ask_all(wrong, std::type_identity<ReconstructionFilter>{});
  ask<Sensor>(wrong, {"perspective", "thinlens"});

  EXPECT_THAT(wrong, ::testing::IsEmpty());
}

}  // namespace
}  // namespace ls::scene
