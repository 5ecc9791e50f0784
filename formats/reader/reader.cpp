#include "formats/reader/reader.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/file_form.h"
#include "core/base/frame_range.h"
#include "core/base/text/suggest.h"
#include "core/scene/analysis/shape_place.h"
#include "core/scene/limits.h"
#include "core/scene/schema/light_links.h"
#include "core/scene/schema/validate.h"
#include "formats/file_names.h"
#include "formats/gltf/asset.h"
#include "formats/nori/translate.h"
#include "formats/pbrt/description.h"
#include "formats/read.h"
#include "formats/reader/mitsuba_plugins.h"
#include "formats/reader/unsupported.h"
#include "formats/xml/transform_element.h"

namespace ls {
namespace scene {

void unknown_plugin(const Element& e, Report& report) {
  const std::string_view type = e.get("type");
  const PluginRow* row = plugin_row(e.tag, type);
  report.error(
      value_place(e, "type"),
      row ? fmt::format("the {} \"{}\" is not supported: {}", e.tag, type, row->note)
          : fmt::format("there is no {} \"{}\"{}", e.tag, type, suggestion(type, read_plugins(e.tag))));
}

Reader::Reader(const Document& document, AssetSource& assets, Report& report)
    : document_(document), assets_(assets), report_(report), ids_(check_structure(document.root, report)) {}

Scene Reader::read() {
  if (report_.has_errors()) return {};
  for (const Element& child : document_.root.children) {
    if (report_.full()) return {};
    read_child(child);
  }
  read_idle_parts();
  finish_motions();
  check_links();
  warn_of_media_around_camera();
  if (!meters_.empty())
    finish_meters();
  else if (!sensor_)
    report_.error(document_.root.at, "the scene has no <sensor>: nothing to see it with");
  return std::move(scene_);
}

void Reader::note_links(const Element& e, std::string_view parameter, const std::string& names) {
  if (parameter != "link_sets")
    links_.push_back({&e, link_list(names), parameter == "blockers"});
  else
    for (std::string& name : link_sets(names)) link_sets_.insert(std::move(name));
}

// Checks that something is in each set to which a light is linked, since the name may be misspelt, and that
// there are not too many lists.
void Reader::check_links() {
  if (report_.has_errors()) return;  // the sets of what could not be read are missing
  const std::vector<std::string> known(link_sets_.begin(), link_sets_.end());
  std::vector<LinkList> lists;
  for (const auto& [element, list, blockers] : links_) {
    for (const auto* names : {&list.with, &list.without})
      for (const std::string& name : *names)
        if (name != kNoLinkSet && !link_sets_.contains(name))
          return report_.error(value_place(*element, "value"),
                               fmt::format("no shape or medium is in the link set \"{}\"{}", name,
                                           known.empty() ? ": give some of them the parameter 'link_sets'"
                                                         : suggestion(name, known)));
    if (std::ranges::find(lists, list) != lists.end()) continue;
    lists.push_back(list);
    if (lists.size() > kMostLinkLists)
      return report_.error(element->at,
                           fmt::format("the lights of a scene have {} different lists of receivers and "
                                       "blockers at most, and this is one more: link lights to sets that "
                                       "they share",
                                       kMostLinkLists));
  }
  warn_of_idle_links();
}

// Warns of sets that cannot do what a light's list says: media are no blockers, and boundaries of media (bsdf
// "null") neither receive light nor stop it.
void Reader::warn_of_idle_links() {
  std::set<std::string> surfaces, receivers;
  const auto add = [](const std::string& names, std::set<std::string>& to) {
    if (!names.empty())
      for (std::string& name : link_sets(names)) to.insert(std::move(name));
  };
  for (const Shape& s : scene_.shapes)
    if (!std::holds_alternative<NullBsdf>(scene_.bsdfs[s.bsdf.value])) add(s.link_sets, surfaces);
  receivers = surfaces;
  for (const Medium& m : scene_.media) std::visit([&](const auto& one) { add(one.link_sets, receivers); }, m);
  for (const auto& [element, list, blockers] : links_)
    for (const auto* names : {&list.with, &list.without})
      for (const std::string& name : *names) {
        if (name == kNoLinkSet || (blockers ? surfaces : receivers).contains(name)) continue;
        report_.warning(value_place(*element, "value"),
                        blockers
                            ? fmt::format("no surface is in the link set \"{}\", so that it has no effect "
                                          "here: media attenuate all light, whatever its blockers are",
                                          name)
                            : fmt::format("no surface and no medium is in the link set \"{}\", so that it "
                                          "has no effect here: give the medium within the boundary the "
                                          "parameter 'link_sets'",
                                          name));
      }
}

// Warns if the camera is inside a shape with an interior medium but has no `medium` itself: as in Mitsuba,
// the camera's medium is the sensor's `medium` alone.
void Reader::warn_of_media_around_camera() {
  if (!sensor_ || scene_.sensor.medium || report_.has_errors()) return;
  const Vec3 camera = origin_of(scene_.sensor.to_world);
  for (std::size_t i = 0; i < scene_.shapes.size() && i < shape_elements_.size(); ++i) {
    const Shape& s = scene_.shapes[i];
    if (!s.interior || s.group || !invertible(s.to_world) || !holds(s, camera)) continue;
    std::string id = "...";
    for (const auto& [element, index] : media_)
      if (index == s.interior && element->find("id")) id = element->get("id");
    return report_.warning(sensor_->at,
                           fmt::format("the camera is inside of a {} that holds a medium ({}), but its "
                                       "sensor names none, so that it sees none up to the first boundary, as "
                                       "in Mitsuba: add <ref name=\"medium\" id=\"{}\"/> to the sensor",
                                       shape_elements_[i]->get("type"),
                                       report_.refer_to(shape_elements_[i]->at, sensor_->at), id));
  }
}

// A reference at the top level is treated as the object that it refers to, as in any other parent element.
void Reader::read_child(const Element& child) {
  const TagKind kind = kind_of(child);
  if (kind == TagKind::alias) return;
  if (kind == TagKind::property || kind == TagKind::transform || kind == TagKind::animation)
    return report_.error(
        child.at, fmt::format("<{}> stands in no object: <scene> itself has no parameters", child.tag));
  const Element* e = kind == TagKind::reference ? resolve(child) : &child;
  if (!e) return;
  if (e->tag == "shape") return read_shape(*e);
  if (e->tag == "emitter") return read_emitter(*e);
  if (e->tag == "sensor") return read_sensor(*e);
  if (e->tag == "integrator") return read_integrator(*e, 0);
  if (e->tag == "bsdf") return void(bsdf(*e, child));
  if (is_spectrum(*e)) return void(spectrum(*e, child));
  if (e->tag == "texture" || e->tag == "spectrum") return void(texture(*e, child));
  if (e->tag == "volume") return void(volume(*e, child));
  if (e->tag == "phase") return void(phase(*e, child));
  if (e->tag == "medium") return void(medium(*e, child));
  // A film, filter or sampler with an id is kept for a sensor that refers to it.
  if (e->find("id")) return parts_.push_back(e);
  report_.error(e->at, fmt::format("a <{}> belongs into a <sensor>", e->tag));
}

// Reads films, filters and samplers that no sensor uses, so that their errors are reported.
void Reader::read_idle_parts() {
  const FilmSettings film = scene_.film;
  const std::uint64_t sample_count = scene_.sample_count;
  for (const Element* e : parts_) {
    if (report_.full()) return;
    if (used_parts_.contains(e)) continue;
    if (e->tag == "film") read_film(*e);
    if (e->tag == "rfilter") read_filter(*e);
    if (e->tag == "sampler") read_sampler(*e);
    scene_.film = film;
    scene_.sample_count = sample_count;
  }
}

const Element* Reader::resolve(const Element& child) {
  if (kind_of(child) != TagKind::reference) return &child;
  const auto it = ids_.find(child.get("id"));
  if (it != ids_.end()) return it->second;
  if (report_.full() || !bad_refs_.insert(&child).second) return nullptr;
  report_.error(value_place(child, "id"),
                fmt::format("no object has the id \"{}\"{}", child.get("id"), hint_for(child)));
  return nullptr;
}

// Returns a suggestion for a reference whose target does not exist.
std::string Reader::hint_for(const Element& reference) const {
  if (ids_.empty()) return "; no object here has one";
  std::vector<std::string> known;
  for (const auto& [id, object] : ids_) known.push_back(id);
  const auto near = nearest_name(reference.get("id"), known);
  if (!near) return listing(known);
  return fmt::format("; did you mean \"{}\" ({})?", *near,
                     report_.refer_to(ids_.find(*near)->second->at, reference.at));
}

template <class I, class F>
std::optional<I> Reader::once(Memo<I>& memo, std::string_view kind, const Element& object, const Element& use,
                              F read) {
  if (report_.full()) return std::nullopt;
  if (object.tag != kind && !(kind == "texture" && object.tag == "spectrum"))
    return report_.refuse(use.at, fmt::format("a {} is wanted here, not a {}", kind, object.tag));
  if (const auto it = memo.find(&object); it != memo.end()) return it->second;
  if (in_progress_.contains(&object))
    return report_.refuse(
        use.at, fmt::format("this {} contains itself: it is referred to from within (it begins in {})", kind,
                            report_.refer_to(object.at, use.at)));
  if (in_progress_.size() >= static_cast<std::size_t>(kMaxReferenceDepth))
    return report_.refuse(use.at, fmt::format("objects are nested more than {} deep", kMaxReferenceDepth));
  in_progress_.insert(&object);
  const std::optional<I> index = read(object);
  in_progress_.erase(&object);
  memo.emplace(&object, index);
  return index;
}

std::optional<TextureIndex> Reader::texture(const Element& object, const Element& use) {
  return once(textures_, "texture", object, use, [&](const Element& e) { return read_texture(e); });
}
std::optional<Reader::Spectrum> Reader::spectrum(const Element& object, const Element& use) {
  return once(spectra_, "spectrum", object, use, [&](const Element& e) { return read_spectrum(e); });
}
std::optional<BsdfIndex> Reader::bsdf(const Element& object, const Element& use) {
  return once(bsdfs_, "bsdf", object, use, [&](const Element& e) { return read_bsdf(e); });
}
std::optional<VolumeIndex> Reader::volume(const Element& object, const Element& use) {
  return once(volumes_, "volume", object, use, [&](const Element& e) { return read_volume(e); });
}
std::optional<PhaseIndex> Reader::phase(const Element& object, const Element& use) {
  return once(phases_, "phase", object, use, [&](const Element& e) { return read_phase(e); });
}
std::optional<MediumIndex> Reader::medium(const Element& object, const Element& use) {
  return once(media_, "medium", object, use, [&](const Element& e) { return read_medium(e); });
}

const std::optional<Reader::Bounds>& Reader::bounds(TextureIndex texture) {
  // A texture's inner textures precede it in the list, so their bounds are known.
  for (std::size_t i = texture_bounds_.size(); i < scene_.textures.size(); ++i) {
    std::optional<Bounds> b;
    const auto include = [&](double low, double high) {
      b = b ? Bounds{std::min(b->low, low), std::max(b->high, high)} : Bounds{low, high};
    };
    if (const auto* constant = std::get_if<ConstantTexture>(&scene_.textures[i])) {
      for (const double x : constant->value) include(x, x);
    } else if (const auto* checks = std::get_if<CheckerboardTexture>(&scene_.textures[i])) {
      for (const TextureIndex inner : {checks->color0, checks->color1})
        if (inner.value < i && texture_bounds_[inner.value])
          include(texture_bounds_[inner.value]->low, texture_bounds_[inner.value]->high);
    } else if (const auto* peak = std::get_if<PeakTexture>(&scene_.textures[i])) {
      const TextureIndex inner = peak->texture;
      if (peak->hue)
        include(0, 1);
      else if (inner.value < i && texture_bounds_[inner.value])
        include(texture_bounds_[inner.value]->low, texture_bounds_[inner.value]->high);
    } else if (const auto* product = std::get_if<ProductTexture>(&scene_.textures[i])) {
      const auto of = [&](TextureIndex t) { return t.value < i ? texture_bounds_[t.value] : std::nullopt; };
      const auto x = of(product->first), y = of(product->second);
      if (product->threshold > 0)
        include(0, 1);
      else if (x && y)
        include(x->low * y->low, x->high * y->high);
    }
    texture_bounds_.push_back(b);
  }
  return texture_bounds_[texture.value];
}

const Rgb* Reader::constant(VolumeIndex volume) const {
  const auto* c = std::get_if<ConstVolume>(&scene_.volumes[volume.value]);
  return c ? &c->value : nullptr;
}
const Rgb* Reader::constant(TextureIndex texture) const {
  const auto* c = std::get_if<ConstantTexture>(&scene_.textures[texture.value]);
  return c ? &c->value : nullptr;
}

std::vector<std::string> Reader::places_of(const std::string& name) const {
  std::vector<std::string> places;
  for (const std::string& path : document_.search_paths) places.push_back(join_path(path, name));
  places.push_back(join_path("", name));
  return places;
}

std::optional<AssetIndex> Reader::asset(const std::string& written, const Span& at) {
  const std::string name = document_.frame ? numbered(written, *document_.frame) : written;
  if (const auto it = assets_by_name_.find(name); it != assets_by_name_.end()) return it->second;
  if (name.empty()) return report_.refuse(at, "the name of a file is wanted here");
  Error last;
  for (const std::string& place : places_of(name)) {
    auto found = assets_.find(place);
    if (!found) {
      last = found.error();
      if (last.code != Errc::not_found) break;
      continue;
    }
    found->name = place;
    const auto index = added<AssetIndex>(std::move(*found));
    assets_by_name_.emplace(name, index);
    return index;
  }
  if (!document_.frame && has_frame_number(name))
    last.message += "; if its # stand for the number of a frame, say which frames are wanted (--frames A-B)";
  return report_.refuse(at, last.message);
}

}  // namespace scene

ReadResult read_scene(std::string_view file_name, std::string_view text, AssetSource& assets,
                      const ReadOptions& options) {
  scene::Report report(options.strict);
  ReadResult result;
  text = without_mark(text);
  const std::string_view kind = without_gz(file_name);  // its ending tells the language
  // The Python package converts a USD stage to XML and sends the XML under the stage's name. So a text with a
  // <scene> is read even if its name has the ending of another format.
  const bool has_scene_element = text.substr(0, 4096).find("<scene") != text.npos;
  if (std::string why = scene::why_no_scene(kind); !why.empty() && !has_scene_element) {
    const std::uint32_t file = report.add_file(scene::SourceText(std::string(file_name), ""));
    report.error({file, 0, 1}, std::move(why));
    result.diagnostics = report.take();
    return result;
  }
  const auto load = scene::pbrt::is_pbrt(kind)   ? scene::pbrt::load_document
                    : scene::gltf::is_gltf(kind) ? scene::gltf::load_document
                                                 : scene::load_document;
  auto document = load(file_name, text, assets, options, report);
  if (document && scene::nori::translate(*document, report)) {
    const Scene read = scene::Reader(*document, assets, report).read();
    if (!report.has_errors()) result.scene = scene::compacted(read);
  }
  result.diagnostics = report.take();
  return result;
}

SceneReader scenes_in_this_process() {
  return [](std::string_view file_name, std::string_view text, AssetSource& assets,
            const ReadOptions& options) { return read_scene(file_name, text, assets, options); };
}

}  // namespace ls
