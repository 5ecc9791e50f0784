#include "formats/reader/unsupported.h"

#include <algorithm>
#include <iterator>
#include <sstream>

namespace ls::scene {

const std::vector<MeaninglessRow>& meaningless_table() {
  static const std::string_view output = "the output format is chosen by the command line or the job";
  static const std::string_view sampling = "it only affects sampling, which Lightshaft chooses itself";
  static const std::vector<MeaninglessRow> rows = [] {
    std::vector<MeaninglessRow> all;
    const auto add = [&](std::string_view tag, std::string_view plugin, const char* parameters,
                         std::string_view because) {
      std::istringstream names(parameters);
      all.push_back({tag, plugin, {std::istream_iterator<std::string>(names), {}}, because});
    };
    add("film", "",
        "pixel_format component_format file_format banner attach_log high_quality_edges compensate fps",
        output);
    add("film", "", "sample_border", "pixels at the border see samples from beyond it in any case");
    add("film", "ldrfilm", "gamma exposure tonemap_method key burn", "colours stay linear");
    add("film", "mfilm", "digits variable", output);
    add("rfilter", "mitchell", "A B C", "a Gaussian is used instead");
    add("rfilter", "lanczos", "lobes", "a Gaussian is used instead");
    add("sampler", "", "seed scramble jitter dimension strict", "samples are this program's own (--seed)");
    add("integrator", "", "strict_normals samples_per_pass block_size timeout render_time_step",
        "it does not change the exact answer");
    add("integrator", "direct", "shading_samples emitter_samples bsdf_samples luminaire_samples", sampling);
    add("integrator", "volpath", "version max_null_collisions", "all light is followed");
    add("integrator", "volpathmis", "use_spectral_mis", sampling);
    for (const char* plugin : {"prb_projective", "direct_projective"})
      add("integrator", plugin, "sppc sppp sppi guiding guiding_proj guiding_rounds project_seed", sampling);
    add("integrator", "bdpt", "light_image sample_direct", sampling);
    add("integrator", "erpt",
        "num_chains max_chains chain_length direct_samples bidirectional_mutation lens_perturbation "
        "caustic_perturbation multi_chain_perturbation manifold_perturbation lambda",
        sampling);
    add("integrator", "mlt",
        "luminance_samples direct_samples two_stage bidirectional_mutation lens_perturbation "
        "caustic_perturbation multi_chain_perturbation manifold_perturbation lambda",
        sampling);
    add("integrator", "photonmapper",
        "direct_samples glossy_samples global_photons caustic_photons volume_photons global_lookup_radius "
        "caustic_lookup_radius lookup_size granularity",
        sampling);
    for (const char* plugin : {"ppm", "sppm"})
      add("integrator", plugin, "photon_count initial_radius alpha granularity max_passes", sampling);
    add("integrator", "pssmlt", "bidirectional luminance_samples direct_samples two_stage p_large", sampling);
    add("integrator", "vpl", "shadow_map_resolution clamping", sampling);
    add("integrator", "adaptive", "max_error p_value max_sample_factor", sampling);
    add("integrator", "irrcache",
        "resolution quality gradients clamp_neighbor clamp_screen overture quality_adjustment indirect_only "
        "debug",
        sampling);
    for (const char* meter : {"irradiancemeter", "radiancemeter", "fluxmeter", "fluencemeter"})
      add("sensor", meter, "shutter_open shutter_close", "a meter measures at one time");
    add("sensor", "", "srf", "colours are linear RGB");
    add("sensor", "perspective", "focus_distance", "a pinhole has everything in focus");
    add("shape", "", "silhouette_sampling_weight sampling_weight", sampling);
    add("shape", "obj", "collapse", "files are read as they are");
    add("shape", "ply", "srgb", "colours of vertices are not used");
    add("bsdf", "roughconductor", "sample_visible", sampling);
    add("bsdf", "roughdielectric", "sample_visible", sampling);
    add("bsdf", "roughplastic", "sample_visible specular_sampling_weight", sampling);
    add("bsdf", "principled",
        "diffuse_reflectance_sampling_rate main_specular_sampling_rate clearcoat_sampling_rate", sampling);
    add("emitter", "", "sampling_weight", sampling);
    add("emitter", "", "medium", "which medium light crosses follows from the shapes around it");
    add("emitter", "constant", "to_world", "it is the same from everywhere");
    add("emitter", "envmap", "mis_compensation", sampling);
    add("emitter", "envmap", "cache", "it does not change the values");
    add("texture", "srgb", "unbounded", "colours are linear RGB");
    add("spectrum", "srgb", "unbounded", "colours are linear RGB");
    add("texture", "uniform", "wavelength_min wavelength_max", "colours are linear RGB");
    add("spectrum", "uniform", "wavelength_min wavelength_max", "colours are linear RGB");
    add("spectrum", "blackbody", "wavelength_min wavelength_max", "colours are linear RGB");
    add("texture", "bitmap", "format accel cache max_anisotropy", "it does not change the values");
    add("volume", "gridvolume", "accel max_value send_data", "it does not change the values");
    add("medium", "",
        "sample_emitters has_spectral_extinction majorant_resolution_factor majorant_factor "
        "majorant_grid_resolution max_density method step_size",
        sampling);
    return all;
  }();
  return rows;
}

std::string_view meaningless_because(std::string_view tag, std::string_view plugin,
                                     std::string_view parameter) {
  for (const MeaninglessRow& row : meaningless_table())
    if (row.tag == tag && (row.plugin.empty() || row.plugin == plugin) &&
        std::find(row.parameters.begin(), row.parameters.end(), parameter) != row.parameters.end())
      return row.because;
  return {};
}

std::vector<std::string> meaningless_parameters(std::string_view tag, std::string_view plugin) {
  std::vector<std::string> all;
  for (const MeaninglessRow& row : meaningless_table())
    if (row.tag == tag && (row.plugin.empty() || row.plugin == plugin))
      all.insert(all.end(), row.parameters.begin(), row.parameters.end());
  return all;
}

std::string_view replacement(std::string_view tag, std::string_view parameter) {
  static constexpr std::string_view kCoefficients =
      "Mitsuba 3 describes media by sigma_t = sigma_a + sigma_s and albedo = sigma_s / sigma_t";
  static constexpr struct {
    std::string_view tag, parameter, instead;
  } rows[] = {
      {"medium", "sigma_a", kCoefficients},
      {"medium", "sigma_s", kCoefficients},
      {"medium", "density", "the density is the volume `sigma_t`; `scale` multiplies it"},
      {"medium", "material", "measured media are not known by name here; give their coefficients"},
      {"shape", "max_smooth_angle",
       "normals are those of the file or, with face_normals, those of its triangles"},
      {"texture", "gamma", "only 1 is understood, for values that are linear as they are"},
      {"texture", "wrap_mode_u", "only the same mode in both directions is understood"},
      {"texture", "wrap_mode_v", "only the same mode in both directions is understood"},
  };
  for (const auto& row : rows)
    if (row.tag == tag && row.parameter == parameter) return row.instead;
  return {};
}

}  // namespace ls::scene
