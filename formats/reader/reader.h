// Converts a Document to a Scene. The class Reader has the functions that read the objects, with a .cpp file
// for each kind of object, and the data that these functions share.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <variant>
#include <vector>

#include "core/base/light/link_names.h"
#include "core/scene/motion.h"
#include "core/scene/schema/traits.h"
#include "core/scene/spectrum.h"
#include "formats/reader/params.h"
#include "formats/xml/grammar.h"

namespace ls::scene {

// Reports that the object's type is unsupported or unknown. The message for an unknown type has a suggestion.
void unknown_plugin(const Element& e, Report& report);

class Reader {
 public:
  Reader(const Document& document, AssetSource& assets, Report& report);
  Scene read();  // valid only if the report has no errors afterwards

  Report& report() { return report_; }
  // Notes the names in the parameter `link_sets` of an object, or in `receivers` or `blockers` of a light.
  void note_links(const Element& e, std::string_view parameter, const std::string& names);
  // Returns the object that `child` is or refers to. nullptr: there is none, which has been reported.
  const Element* resolve(const Element& child);

  // Each returns the index of `object` in the scene. An object is read only once, however often it is
  // referred to; `use` is the place of the reference. nullopt: an error was reported.
  std::optional<TextureIndex> texture(const Element& object, const Element& use);
  std::optional<BsdfIndex> bsdf(const Element& object, const Element& use);
  std::optional<VolumeIndex> volume(const Element& object, const Element& use);
  std::optional<PhaseIndex> phase(const Element& object, const Element& use);
  std::optional<MediumIndex> medium(const Element& object, const Element& use);

  // A spectrum given as an object. Rgb: a colour for any use. LightColour: the colour of a light, allowed for
  // emitters only. SpectralCurve: a curve whose colour depends on its use; the curve of an emitter is
  // converted to a colour as it is, any other curve is multiplied by the illuminant D65 first (in files of
  // version 3).
  struct LightColour {
    Rgb value;
  };
  using Spectrum = std::variant<Rgb, LightColour, SpectralCurve>;
  static bool is_spectrum(const Element& object);
  std::optional<Spectrum> spectrum(const Element& object, const Element& use);

  TextureIndex add_constant_texture(const Rgb& value) { return added<TextureIndex>(ConstantTexture{value}); }
  VolumeIndex add_constant_volume(const Rgb& value) { return added<VolumeIndex>(ConstVolume{value}); }
  // Bounds of a texture's values. nullopt if they depend on an image.
  struct Bounds {
    double low, high;
  };
  const std::optional<Bounds>& bounds(TextureIndex texture);
  const Rgb* constant(VolumeIndex volume) const;    // nullptr: the volume varies
  const Rgb* constant(TextureIndex texture) const;  // nullptr: the texture varies
  std::optional<AssetIndex> asset(const std::string& name, const Span& at);
  // Returns the paths at which to look for the file that the scene calls `name`, the likeliest first.
  std::vector<std::string> places_of(const std::string& name) const;

 private:
  template <class I>
  using Memo = std::unordered_map<const Element*, std::optional<I>>;
  template <class I, class F>
  std::optional<I> once(Memo<I>& memo, std::string_view kind, const Element& object, const Element& use,
                        F read);

  // Adds an object to its list in the scene, and returns its index.
  template <class I, class T>
  I added(T&& object) {
    auto& list = pool(scene_, I{});
    list.emplace_back(std::forward<T>(object));
    return {static_cast<std::uint32_t>(list.size() - 1)};
  }

  std::string hint_for(const Element& reference) const;
  void read_child(const Element& child);
  void read_idle_parts();
  void check_links();
  void warn_of_idle_links();

  std::optional<TextureIndex> read_texture(const Element& e);
  template <class T>
  std::optional<TextureIndex> read_plain_texture(const Element& e);
  std::optional<TextureIndex> read_mesh_attribute(const Element& e);
  void refuse_attributes(const Element& e, TextureIndex t, std::string_view parameter);
  void check_attributes(const Element& e, const Shape& shape);
  std::optional<TextureIndex> read_uniform_texture(const Element& e, std::string_view parameter);
  std::optional<TextureIndex> read_raw_constant(const Element& e);
  std::optional<Spectrum> read_spectrum(const Element& e);
  std::optional<BsdfIndex> read_bsdf(const Element& e);
  template <class Kind>
  std::optional<BsdfIndex> read_bsdf_as(const Element& e);
  template <class T>
  void bind_alphas(Params& p, T& b, const Range& range);
  template <class T>
  std::optional<BsdfIndex> add_around_one(Params& p, T& b);
  TextureIndex old_number(const Element& e, TextureIndex t);
  void check_multiple_scattering(const Element& e, TextureIndex alpha_u, TextureIndex alpha_v);
  bool read_heights(Params& p, BumpMapBsdf& b);
  void check_sum(const Element& e, const DiffuseTransmissionBsdf& b);
  std::optional<BsdfIndex> read_difftrans(const Element& e);
  std::optional<std::vector<BsdfIndex>> read_inner_bsdfs(Params& p, std::size_t at_least,
                                                         std::size_t at_most);
  std::optional<BsdfIndex> add_bsdf(const Element& e, const Bsdf& bsdf);
  const BsdfTraits& traits(BsdfIndex bsdf);
  void read_metal_preset(Params& p, Rgb& eta, Rgb& k);
  std::optional<VolumeIndex> read_volume(const Element& e);
  std::optional<PhaseIndex> read_phase(const Element& e);
  bool read_parts(Params& p, BlendPhase& blend);
  std::optional<MediumIndex> read_medium(const Element& e);
  template <class Kind>
  std::optional<MediumIndex> read_medium_as(const Element& e);
  std::optional<MediumIndex> read_unbounded(const Element& e);
  void unbound_constant_density(const Element& e);

  void read_shape(const Element& e);
  template <class T>
  void read_geometry(const Element& e, T geometry);
  void read_shape_parts(Params& p, Shape& shape);
  std::vector<MotionKey> read_shape_keys(const Element& e, const Element& animation, const Shape& shape);
  void check_visibility(Params& p, const Shape& shape);
  std::optional<AreaEmitter> read_area(const Element& e);
  // Reports a to_world that the shape cannot have, at the element `at`. Returns whether it can have it.
  bool check_placement(const Element& e, const Element& at, const Shape& shape);
  void warn_of_media_around_camera();
  void read_shape_group(const Element& e);
  void read_instance(const Element& e);
  void read_merge(const Element& e);
  void refuse_in_group(const Element& use, std::string_view type);

  void read_emitter(const Element& e);
  template <class Kind>
  void read_emitter_as(const Element& e);
  void check_only_environment(const Element& e);

  void read_sensor(const Element& e);
  void read_batch(const Element& e);
  // Reads a sensor that is a meter; `shape` is the shape in which it stands, null outside of shapes. Returns
  // its index if it belongs to the shape.
  std::optional<MeterIndex> read_meter(const Element& e, const Shape* shape);
  std::optional<std::vector<MeterPoint>> read_meter_points(const Element& e, Params& p, MeterKind kind);
  std::optional<MeterPoint> read_meter_point(const Element& e, Params& p, MeterKind kind);
  std::optional<std::vector<MeterPoint>> read_meter_file(const std::string& name, const Span& at,
                                                         MeterKind kind);
  void read_meter_film(Params& p);
  void finish_meters();
  void read_projection(const Element& e, Params& p, Sensor& sensor);
  void read_sensor_medium(Params& p, std::optional<MediumIndex>& medium_of_sensor);
  bool check_place(const Element& e, const Transform& to_world, Projection projection);
  // Returns the keys of an <animation>. What is wrong is reported. `fits`, called with the element and the
  // transform of a key, reports a transform that the object cannot have, and returns whether it can.
  std::vector<MotionKey> read_keys(const Element& animation,
                                   const std::function<bool(const Element&, const Transform&)>& fits);
  void read_motion(const Element& animation, Sensor& s);
  // Cuts the motion to the exposure, and sets the place of the object from it.
  template <class T>
  void place_in_exposure(const Element& animation, const Motion& motion, T& object);
  // Keeps the motion of a shape or an instance, the last one of its list, for finish_motions().
  void note_motion(const Element& animation, bool instance, std::vector<MotionKey> keys);
  void finish_motions();
  // Reports a shutter that closes before it opens and, if there is an animation, one that is never open;
  // `what` begins a sentence.
  void check_shutter(const Element* animation, std::string_view what);
  void read_fov(Params& p, Sensor& sensor);
  void read_film(const Element& e);
  void check_crop(const Element& e, Params& p, bool has_width, bool has_height);
  ReconstructionFilter read_filter(const Element& e);
  void read_sampler(const Element& e);
  void read_integrator(const Element& e, int depth);
  void read_channels(Params& p);

  std::string fresh_label(std::string name, std::string_view type, std::size_t index);
  void label_shape(const Element& e);  // adds the name of the last shape of scene_
  void label_instance(const Element& e);

  const Document& document_;
  AssetSource& assets_;
  Report& report_;
  Ids ids_;
  Scene scene_;
  std::vector<const Element*> shape_elements_;   // the elements of the scene's shapes, in the same order
  const Element* sensor_ = nullptr;              // the camera
  double shutter_open_ = 0, shutter_close_ = 0;  // of the camera, in the times of its file
  struct Moving {
    const Element* animation;
    bool instance;      // false: a shape
    std::size_t index;  // in the scene's instances or shapes
    std::vector<MotionKey> keys;
  };
  std::vector<Moving> motions_;         // what moves, until finish_motions()
  std::vector<const Element*> meters_;  // the elements of the scene's meters, in the same order
  bool sampled_ = false;                // true if the sampler of a meter was read
  std::size_t meter_points_ = 0;        // number of points of the meters read so far
  std::size_t meter_file_bytes_ = 0;    // bytes of the files of points read so far
  const Element* integrator_ = nullptr;
  const Element* material_ = nullptr;  // material of the last shape read; nullptr: the default material
  std::unordered_set<std::string> labels_;
  std::unordered_map<std::string, std::size_t> label_numbers_;  // by name: next number to append to it
  // parts_: the films, filters and samplers at the top level. used_parts_: the films, filters and samplers
  // that have been read for a sensor.
  std::vector<const Element*> parts_;
  std::optional<std::unordered_set<std::string_view>>
      referred_;  // ids with references; nullopt: not looked for
  std::unordered_set<const Element*> used_parts_;
  // Entry i belongs to scene_.textures[i] or scene_.bsdfs[i]. bounds() and traits() add entries when they are
  // needed.
  std::vector<std::optional<Bounds>> texture_bounds_;
  std::vector<BsdfTraits> bsdf_traits_;

  bool reads_attributes_ = false;  // true if some texture read so far is a mesh attribute
  // Maps a texture to the copy with swapped colours that old_number() has made of it.
  std::map<TextureIndex, TextureIndex> old_numbers_;
  Memo<TextureIndex> textures_;
  Memo<Spectrum> spectra_;
  Memo<BsdfIndex> bsdfs_;
  Memo<VolumeIndex> volumes_;
  Memo<PhaseIndex> phases_;
  Memo<MediumIndex> media_;
  // The indices of the shape groups read so far; nullopt: the group has no shape, or is wrong.
  std::unordered_map<const Element*, std::optional<GroupIndex>> groups_;
  std::optional<GroupIndex> group_;               // group whose shapes are being read; nullopt: none
  std::unordered_set<const Element*> merges_;     // the shapes "merge" that were read so far
  std::set<std::string, std::less<>> link_sets_;  // the link sets of the objects read so far
  struct LinkedTo {
    const Element* element;
    LinkList list;
    bool blockers;  // false: receivers
  };
  std::vector<LinkedTo> links_;  // what the lights read so far are linked to
  std::map<std::string, AssetIndex> assets_by_name_;
  std::unordered_set<const Element*> in_progress_;
  std::unordered_set<const Element*> bad_refs_;  // references whose errors have been reported
};

}  // namespace ls::scene
