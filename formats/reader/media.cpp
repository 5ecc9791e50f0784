// Reads volumes, phase functions and media.
#include <fmt/format.h>

#include <map>
#include <utility>

#include "core/base/file_form.h"
#include "core/scene/schema/phase_tables.h"
#include "core/scene/schema/volume_rules.h"
#include "formats/reader/reader.h"
#include "formats/xml/transform_element.h"

namespace ls::scene {
namespace {

void need_both(Params& p, const char* one, const char* other, Report& report) {
  if (p.has(one) && p.has(other)) return;
  report.error(p.object().at, fmt::format("{} needs {} and {}", p.title(), one, other));
}

// Checks that a medium of Mitsuba 0.x gives either sigma_a and sigma_s or sigma_t and albedo. Converts the
// first pair to the second.
void read_old_coefficients(Params& p, HomogeneousMedium& medium, Report& report) {
  const bool apart = p.has("sigma_a") || p.has("sigma_s"), together = p.has("sigma_t") || p.has("albedo");
  if (apart && together)
    return report.error(p.object().at,
                        fmt::format("{} gives both sigma_a or sigma_s and sigma_t or albedo", p.title()));
  if (!apart && !together)
    return report.error(p.object().at,
                        fmt::format("{} needs its coefficients: sigma_a and sigma_s, or sigma_t and albedo; "
                                    "those of human skin, the default of Mitsuba 0.x, are not known here",
                                    p.title()));
  if (!apart) return need_both(p, "sigma_t", "albedo", report);
  need_both(p, "sigma_a", "sigma_s", report);
  Rgb absorption{}, scattering{};
  p.read({.name = "sigma_a", .doc = "", .range = kNonNegative, .constvolume = true}, absorption);
  p.read({.name = "sigma_s", .doc = "", .range = kNonNegative, .constvolume = true}, scattering);
  for (std::size_t i = 0; i < 3; ++i) {
    medium.sigma_t[i] = absorption[i] + scattering[i];
    medium.albedo[i] = medium.sigma_t[i] > 0 ? scattering[i] / medium.sigma_t[i] : 0;
  }
}

void read_old_coefficients(Params& p, HeterogeneousMedium&, Report& report) {
  if (!p.has("sigma_t")) report.error(p.object().at, fmt::format("{} needs density", p.title()));
  if (!p.has("albedo")) report.error(p.object().at, fmt::format("{} needs albedo", p.title()));
}

void need_inverse(const Transform& to_world, const Element& e, Report& report) {
  if (!invertible(to_world))
    report.error(e.at, "to_world flattens this volume or leaves the range of numbers: it can't be inverted");
}

// Records which of those parameters are given that have no effect on their own: emission_scale (`light`)
// needs an emission; temperature_scale, temperature_offset (`heat`), peak_one and emission_weight (`of_heat`)
// need a temperature. Must be constructed before parameters are taken from `p`.
struct Factors {
  explicit Factors(const Params& p)
      : light(p.has("emission_scale")), heat(p.has("temperature_scale") || p.has("temperature_offset")) {
    for (const char* name : {"peak_one", "emission_weight"})
      if (p.has(name)) of_heat.emplace_back(name);
  }
  bool light, heat;
  std::vector<std::string> of_heat;
};

void check_medium(const Params& p, const Factors& given, const HeterogeneousMedium& m, Report& report) {
  const int sources = m.emission.has_value() + m.source_radiance.has_value() + m.temperature.has_value();
  if (sources > 1)
    report.error(p.object().at,
                 fmt::format("{} gives more than one of emission, source_radiance and temperature; give one",
                             p.title()));
  if (given.heat && !m.temperature)
    report.error(
        p.object().at,
        fmt::format("{} gives temperature_scale or temperature_offset, but no temperature", p.title()));
  for (const std::string& name : given.of_heat)
    if (!m.temperature)
      report.error(p.object().at, fmt::format("{} gives {}, but no temperature", p.title(), name));
  if (given.light && sources == 0)
    report.error(p.object().at,
                 fmt::format("{} gives emission_scale, but none of emission, source_radiance and temperature",
                             p.title()));
}
void check_medium(const Params&, const Factors&, const HomogeneousMedium&, Report&) {}

// The places of an object's parameters, for messages. Must be constructed before parameters are taken.
class ParameterPlaces {
 public:
  explicit ParameterPlaces(const Params& p) {
    for (const Element& e : p.object().children) at_.emplace(e.get("name"), &e);
  }
  void check(const Params& p, const ParameterProblem& problem, Report& report) const {
    if (problem.what.empty()) return;
    const auto e = at_.find(problem.parameter);
    const bool is_given = e != at_.end();
    report.error(!is_given                  ? p.object().at
                 : e->second->find("value") ? value_place(*e->second, "value")
                                            : e->second->at,
                 fmt::format("'{}' of {} {}", problem.parameter, p.title(), problem.what));
  }

 private:
  std::map<std::string_view, const Element*> at_;
};

// True if the object has a parameter of this name that is a volume other than "constvolume".
bool has_varying_volume(Reader& reader, const Element& e, std::string_view name) {
  return std::ranges::any_of(e.children, [&](const Element& c) {
    if (c.get("name") != name || (c.tag != "volume" && c.tag != "ref")) return false;
    const Element* volume = c.tag == "ref" ? reader.resolve(c) : &c;
    return volume && volume->tag == "volume" && volume->get("type") != "constvolume";
  });
}

// Checks that concern the file of a grid.
void check_grid(const GridVolume& volume, std::string_view file, const Element& e, Report& report) {
  if (volume.order != GridOrder{} && !file.ends_with(".bin"))
    report.error(e.at, "'order' is of .bin files; others say for themselves how their values lie");
  if (file.ends_with(".bin") && volume.wrap != Wrap::clamp)
    report.error(e.at, "a .bin grid ends at its outermost nodes: 'wrap_mode' can only be clamp");
  if (volume.node_centred && volume.wrap != Wrap::clamp)
    report.error(e.at, "a grid with node_centred ends at its outermost nodes: 'wrap_mode' can only be clamp");
  if (volume.border && (!file.ends_with(".vol") || volume.node_centred || volume.wrap != Wrap::clamp))
    report.error(e.at,
                 "'border' is of .vol files with values at the centres of voxels: it goes neither with "
                 "node_centred nor with a wrap_mode other than clamp");
}

}  // namespace

std::optional<VolumeIndex> Reader::read_volume(const Element& e) {
  std::optional<VolumeIndex> read;
  const auto read_as = [&]<class Kind>() {
    Params p(*this, e);
    const ParameterPlaces places(p);
    Kind volume;
    bind(p, volume);
    if constexpr (std::is_same_v<Kind, GridVolume>) {
      if (const auto name = p.take_string("gridname")) volume.grid_name = *name;
      check_grid(
          volume,
          volume.file.value < scene_.assets.size() ? without_gz(scene_.assets[volume.file.value].name) : "",
          e, report_);
    }
    if constexpr (requires { volume.to_world; }) need_inverse(volume.to_world, e, report_);
    p.finish();
    if (!report_.has_errors()) places.check(p, volume_problem(scene_.volumes, volume), report_);
    read = added<VolumeIndex>(std::move(volume));
    if (!report_.has_errors() && nesting_of(scene_.volumes, *read) > kMaxVolumeNesting)
      read = report_.refuse(e.at, fmt::format("volumes are nested more than {} deep", kMaxVolumeNesting));
  };
  if (!with_kind_named<Volume>(e.get("type"), read_as)) unknown_plugin(e, report_);
  return read;
}

std::optional<PhaseIndex> Reader::read_phase(const Element& e) {
  Params p(*this, e);
  std::optional<PhaseIndex> read;
  const auto read_as = [&]<class Kind>() {
    Kind phase;
    const ParameterPlaces places(p);
    bind(p, phase);
    if constexpr (std::is_same_v<Kind, BlendPhase>)
      if (!read_parts(p, phase)) return;
    p.finish();
    if constexpr (std::is_same_v<Kind, TabulatedPhase>)
      if (!report_.has_errors()) places.check(p, table_problem(phase), report_);
    if constexpr (std::is_same_v<Kind, BlendPhase>)
      if (!report_.has_errors()) places.check(p, phase_problem(scene_.volumes, phase), report_);
    read = added<PhaseIndex>(std::move(phase));
    if constexpr (std::is_same_v<Kind, BlendPhase>)
      if (!report_.has_errors() && nesting_of(scene_.phases, *read) > kMaxPhaseNesting)
        read = report_.refuse(e.at,
                              fmt::format("phase functions are nested more than {} deep", kMaxPhaseNesting));
  };
  if (!with_kind_named<Phase>(e.get("type"), read_as)) unknown_plugin(e, report_);
  return read;
}

// Reads the two phase functions of a blend, in their order in the file or, if both have names, by these.
bool Reader::read_parts(Params& p, BlendPhase& blend) {
  auto parts = p.take_nested("phase");
  if (parts.size() != 2) {
    report_.error(p.object().at,
                  fmt::format("{} needs two nested phase functions, not {}", p.title(), parts.size()));
    return false;
  }
  const auto name = [](const Params::Nested& n) { return n.use->get("name"); };
  const bool named = !name(parts[0]).empty() && !name(parts[1]).empty();
  if (named && name(parts[1]) < name(parts[0])) std::swap(parts[0], parts[1]);
  const auto first = phase(*parts[0].object, *parts[0].use), second = phase(*parts[1].object, *parts[1].use);
  if (!first || !second) return false;
  blend.first = *first;
  blend.second = *second;
  if (const Rgb* weight = report_.has_errors() ? nullptr : constant(blend.weight);
      weight && !is_grey(*weight)) {
    report_.error(p.object().at, fmt::format("'weight' of {} is one number, not a colour", p.title()));
    return false;
  }
  return true;
}

std::optional<MediumIndex> Reader::read_medium(const Element& e) {
  if (e.get("type") == "homogeneous" && !e.old && has_varying_volume(*this, e, "albedo"))
    return read_unbounded(e);
  std::optional<MediumIndex> read;
  if (!with_kind_named<Medium>(e.get("type"), [&]<class Kind>() { read = read_medium_as<Kind>(e); }))
    unknown_plugin(e, report_);
  return read;
}

template <class T>
std::optional<MediumIndex> Reader::read_medium_as(const Element& e) {
  Params p(*this, e);
  T medium;
  if (e.old) read_old_coefficients(p, medium, report_);
  const Factors given(p);
  const ParameterPlaces places(p);
  bind(p, medium);
  check_medium(p, given, medium, report_);
  if constexpr (std::is_same_v<T, HeterogeneousMedium>)
    if (const Rgb* t = medium.temperature ? constant(*medium.temperature) : nullptr; t && !is_grey(*t))
      report_.error(e.at, fmt::format("'temperature' of {} is one number, not a colour", p.title()));
  const auto given_phase = p.take_only("phase", p.title(), "phase function");
  p.finish();
  if constexpr (std::is_same_v<T, HeterogeneousMedium>)
    if (!report_.has_errors()) places.check(p, medium_problem(scene_.volumes, medium), report_);
  if (!given_phase)
    medium.phase = added<PhaseIndex>(IsotropicPhase{});
  else if (const auto index = phase(*given_phase->object, *given_phase->use))
    medium.phase = *index;
  const auto index = added<MediumIndex>(medium);
  if constexpr (std::is_same_v<T, HeterogeneousMedium>)
    if (e.old && !report_.has_errors()) unbound_constant_density(e);
  return index;
}

// Reads a medium "homogeneous" whose albedo varies, which Mitsuba 3 allows: a medium "heterogeneous" whose
// density is the same in a box that is larger than any scene.
std::optional<MediumIndex> Reader::read_unbounded(const Element& e) {
  const auto index = read_medium_as<HeterogeneousMedium>(e);
  if (!index || report_.has_errors()) return index;
  auto& medium = std::get<HeterogeneousMedium>(scene_.media.back());
  const Rgb* density = constant(medium.sigma_t);
  if (!density)
    return report_.refuse(e.at,
                          "sigma_t of medium \"homogeneous\" is the same everywhere: of a grid make it "
                          "\"heterogeneous\"");
  constexpr double kReach = 1e9;  // in scene units, from the origin
  const Transform box{
      {2 * kReach, 0, 0, -kReach, 0, 2 * kReach, 0, -kReach, 0, 0, 2 * kReach, -kReach, 0, 0, 0, 1}};
  medium.sigma_t = added<VolumeIndex>(ConstVolume{*density, box});
  return index;
}

// In Mitsuba 0.x a constant density fills all of space, not only the unit cube. So a medium with such a
// density becomes homogeneous.
void Reader::unbound_constant_density(const Element& e) {
  const auto medium = std::get<HeterogeneousMedium>(scene_.media.back());
  const Rgb* density = constant(medium.sigma_t);
  if (!density) return;
  const Rgb* albedo = constant(medium.albedo);
  if (!albedo)
    return report_.error(e.at, "the density of this medium is the same everywhere, but its albedo is a grid");
  if (medium.emission || medium.source_radiance || medium.temperature)
    return report_.error(e.at,
                         "the density of this medium is the same everywhere: write it as a medium "
                         "\"homogeneous\" to give it an emission");
  Rgb sigma_t = *density;
  for (std::size_t i = 0; i < 3; ++i) sigma_t[i] *= medium.tint[i];
  scene_.media.back() =
      HomogeneousMedium{sigma_t, *albedo, medium.scale, medium.phase, {}, {}, medium.priority};
}

}  // namespace ls::scene
