#include "formats/reader/xml_write.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <variant>

#include "core/base/overloaded.h"
#include "core/scene/json/serialize.h"
#include "core/scene/motion.h"
#include "core/scene/schema/describe_fields.h"
#include "core/scene/schema/integrators.h"
#include "formats/reader/mitsuba_plugins.h"

namespace ls {
namespace scene {
namespace {

template <class List>
std::string numbers(const List& list) {
  std::string out;
  for (const double x : list) out += (out.empty() ? "" : " ") + shortest_number(x);
  return out;
}

// Escapes an attribute value. "$" is escaped too, since it would begin a parameter.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '$')
      out += "\\$";
    else
      out += c;
  }
  return out;
}

// A boolean parameter that Mitsuba 3 does not have. It is written only if it is true.
constexpr std::string_view kOurOwn = "node_centred";

// Returns the name of the Mitsuba plugin for an object of this type: the XML attribute `type`.
template <class T>
std::string_view plugin(const T&) {
  const TypeInfo& info = kInfo<T>;
  return info.plugins.empty() ? info.name : info.plugins.substr(0, info.plugins.find(','));
}
std::string_view plugin(const MeshShape& mesh) { return name_of(mesh.format); }
std::string_view plugin(const IntegratorSettings& integrator) { return integrator.name; }
bool is_pinhole(const Sensor& s) {
  return s.aperture_radius == 0 && s.focus_distance == Sensor{}.focus_distance && !s.aperture_scale;
}
std::string_view plugin(const Sensor& s) {
  if (s.projection != Projection::perspective) return name_of(s.projection);
  return is_pinhole(s) ? "perspective" : "thinlens";
}

std::string_view plugin(const Meter& m) { return name_of(m.kind); }

class Writer {
 public:
  explicit Writer(const Scene& s)
      : scene_(s), texture_uses_(s.textures.size()), volume_uses_(s.volumes.size()) {
    IndexWalker(overloaded{[&](TextureIndex i) { ++texture_uses_[i.value]; },
                           [&](VolumeIndex i) { ++volume_uses_[i.value]; }, [](const auto&) {}})
        .walk(s);
    name_assets();
  }

  WrittenScene run() {
    out_ = "<scene version=\"3.0.0\">\n";
    write_integrator();
    pool(scene_.textures, TextureIndex{});
    pool(scene_.bsdfs, BsdfIndex{});
    pool(scene_.volumes, VolumeIndex{});
    pool(scene_.phases, PhaseIndex{});
    pool(scene_.media, MediumIndex{});
    write_shapes();
    for (const Instance& instance : scene_.instances) {
      open(kInfo<Instance>.kind, plugin(instance), "", "");
      MovingFields fields{*this, instance.motion};
      describe(fields, instance);
      close(kInfo<Instance>.kind);
    }
    for (const Emitter& emitter : scene_.emitters) std::visit([&](const auto& e) { object(e); }, emitter);
    write_sensor();
    return {out_ + "</scene>\n", std::move(ours_)};
  }

  template <class T>
  void field(const Field& f, const T& value) {
    if (f.derived && f.given_as.empty()) return;  // a derived field that files do not have
    if constexpr (std::equality_comparable<T>)
      if (f.leaves_out(value)) return;
    const std::string_view name = f.given_as.starts_with('<') ? "" : f.name;
    constexpr bool is_object = requires { nested(name, value); };
    constexpr bool is_property = requires { property(f, value); };
    static_assert(is_object || is_property, "a type of fields that nothing here can write");
    if constexpr (is_object)
      if (f.derived) return nested(name, value);
    if constexpr (is_property) property(f, value);
  }

 private:
  // Makes the names of assets unique, so that two assets of the same name stay apart. It adds prefixes ("./"
  // or "/") that do not change the path.
  void name_assets() {
    std::map<std::string, int> seen;
    for (const Asset& a : scene_.assets) {
      std::string& name = asset_names_.emplace_back();
      for (int i = seen[a.name]++; i > 0; --i) name += a.name.starts_with('/') ? "/" : "./";
      name += a.name;
    }
  }

  // Adds what Mitsuba 3 does not read to the list.
  void note(std::string text) {
    if (std::ranges::find(ours_, text) == ours_.end()) ours_.push_back(std::move(text));
  }
  void note_parameter(std::string_view name) {
    if (name.empty() || objects_.empty()) return;
    const auto& [tag, type] = objects_.back();
    if (is_our_parameter(tag, type, name)) note(fmt::format("'{}' of {} \"{}\"", name, tag, type));
  }

  // Functions that write XML elements.
  void line(std::string_view text) { out_ += fmt::format("{:{}}{}\n", "", 2 * depth_, text); }
  void open(std::string_view tag, std::string_view type, const std::string& id, std::string_view name) {
    line(fmt::format("<{} type=\"{}\"{}{}>", tag, type, id.empty() ? "" : fmt::format(" id=\"{}\"", id),
                     name.empty() ? "" : fmt::format(" name=\"{}\"", name)));
    note_parameter(name);
    const PluginRow* row = plugin_row(tag, type);
    if (row && row->origin != Origin::mitsuba3) note(fmt::format("{} \"{}\"", tag, type));
    objects_.emplace_back(tag, type);
    ++depth_;
    opened_ = out_.size();
  }
  void close(std::string_view tag) {
    objects_.pop_back();
    --depth_;
    if (out_.size() == opened_) {  // the object has no members
      out_.replace(out_.size() - 2, 1, "/>");
      return;
    }
    line(fmt::format("</{}>", tag));
  }
  void value(std::string_view tag, std::string_view name, std::string_view text) {
    note_parameter(name);
    line(fmt::format("<{} name=\"{}\" value=\"{}\"/>", tag, name, escaped(text)));
  }
  void matrix(std::string_view name, const std::array<double, 16>& m) {
    line(fmt::format("<transform name=\"{}\"><matrix value=\"{}\"/></transform>", name, numbers(m)));
  }
  void reference(std::string_view name, const std::string& id) {
    note_parameter(name);
    line(fmt::format("<ref {}id=\"{}\"/>", name.empty() ? "" : fmt::format("name=\"{}\" ", name), id));
  }

  template <class T>
  void object(const T& x, const std::string& id = "", std::string_view name = "") {
    open(kInfo<T>.kind, plugin(x), id, name);
    describe(*this, x);
    close(kInfo<T>.kind);
  }

  template <class List, class I>
  void pool(const List& list, I index) {
    for (const auto& one : list) {
      if (!inline_value(index)) std::visit([&](const auto& x) { object(x, id_of(index)); }, one);
      ++index.value;
    }
  }
  // Returns the value of a constant texture or volume that only one object uses: its value is written inside
  // that object. nullptr: the texture or volume is written as an element of its own, with an id.
  const Rgb* inline_value(TextureIndex i) const {
    const auto* c = std::get_if<ConstantTexture>(&scene_.textures[i.value]);
    return c && texture_uses_[i.value] == 1 ? &c->value : nullptr;
  }
  const Rgb* inline_value(VolumeIndex i) const {
    const auto* c = std::get_if<ConstVolume>(&scene_.volumes[i.value]);
    return c && c->to_world == Transform{} && volume_uses_[i.value] == 1 ? &c->value : nullptr;
  }
  template <class I>
  const Rgb* inline_value(I) const {
    return nullptr;
  }
  static std::string id_of(TextureIndex i) { return fmt::format("texture{}", i.value); }
  static std::string id_of(BsdfIndex i) { return fmt::format("bsdf{}", i.value); }
  static std::string id_of(VolumeIndex i) { return fmt::format("volume{}", i.value); }
  static std::string id_of(PhaseIndex i) { return fmt::format("phase{}", i.value); }
  static std::string id_of(MediumIndex i) { return fmt::format("medium{}", i.value); }
  static std::string id_of(GroupIndex i) { return fmt::format("group{}", i.value); }

  // Writes the fields of a geometry, except flip_tex_coords for a mesh of the plugin "serialized", which does
  // not have this parameter.
  struct GeometryFields {
    Writer& writer;
    const Geometry& geometry;
    template <class T>
    void field(const Field& f, const T& x) {
      const auto* mesh = std::get_if<MeshShape>(&geometry);
      if (!mesh || mesh->format != MeshFormat::serialized || f.name != "flip_tex_coords") writer.field(f, x);
    }
  };
  // Writes the fields of an object that may move.
  struct MovingFields {
    Writer& writer;
    const std::vector<MotionKey>& motion;
    template <class T>
    void field(const Field& f, const T& x) {
      if (f.name == "to_world" && !motion.empty()) return writer.property(f, motion);
      writer.field(f, x);
    }
  };
  // Writes the shapes. The shapes of a group, which are contiguous in the scene, are written inside the
  // group's element.
  void write_shapes() {
    std::optional<GroupIndex> group;
    const auto go_to = [&](std::optional<GroupIndex> next) {
      if (group == next) return;
      if (group) close("shape");
      group = next;
      if (group) open("shape", kInfo<ShapeGroup>.name, id_of(*group), "");
    };
    for (const Shape& shape : scene_.shapes) {
      go_to(shape.group);
      write_shape(shape);
    }
    go_to(std::nullopt);
  }
  void write_shape(const Shape& shape) {
    std::visit(
        [&](const auto& geometry) {
          open("shape", plugin(geometry), "", "");
          GeometryFields fields{*this, shape.geometry};
          describe(fields, geometry);
        },
        shape.geometry);
    MovingFields fields{*this, shape.motion};
    describe(fields, shape);
    nested("", shape.meter);
    close("shape");
  }

  // Writes only the fields that are parameters of this integrator.
  struct OwnParameters {
    Writer& writer;
    std::string_view integrator;
    template <class T>
    void field(const Field& f, const T& x) {
      if (f.belongs_to(integrator)) writer.field(f, x);
    }
  };
  void write_integrator() {
    const IntegratorSettings& i = scene_.integrator;
    OwnParameters own{*this, i.name};
    if (!scene_.aovs.empty()) {
      open("integrator", "aov", "", "");
      value("string", "aovs", mitsuba_channels(scene_.aovs));
    }
    open("integrator", plugin(i), "", "");
    describe(own, i);
    close("integrator");
    if (!scene_.aovs.empty()) close("integrator");
  }

  // Writes only the fields that the plugin of the camera has.
  struct SensorFields {
    Writer& writer;
    const Sensor& sensor;
    template <class T>
    void field(const Field& f, const T& x) {
      const bool lens =
          f.name == "aperture_radius" || f.name == "focus_distance" || f.name == "aperture_scale";
      const bool clip = f.name.ends_with("_clip"),
                 always = f.name == "to_world" || f.name == "medium" || f.name.starts_with("shutter_");
      if (f.name == "to_world" && !sensor.motion.empty()) return writer.property(f, sensor.motion);
      if (always || (clip && sensor.projection == Projection::orthographic) ||
          (sensor.projection == Projection::perspective && !(lens && is_pinhole(sensor))))
        writer.field(f, x);
    }
  };
  void write_sampler() {
    open("sampler", "independent", "", "");
    value("integer", "sample_count", std::to_string(scene_.sample_count));
    close("sampler");
  }
  void write_meter(const Meter& m) {
    open("sensor", plugin(m), escaped(m.name), "");
    describe(*this, m);
    write_sampler();
    close("sensor");
  }
  // An attribute can hold a part of a long list of points only: the others get a sensor each.
  void write_meters() {
    constexpr std::size_t kMost = 256;
    for (const Meter& m : scene_.meters)
      for (std::size_t begin = 0; begin < m.points.size(); begin += kMost) {
        Meter part = m;
        if (begin > 0) part.name += fmt::format("-{}", begin + 1);
        const auto at = [&](std::size_t i) { return m.points.begin() + static_cast<std::ptrdiff_t>(i); };
        part.points.assign(at(begin), at(std::min(begin + kMost, m.points.size())));
        write_meter(part);
      }
  }
  void write_sensor() {
    const Sensor& s = scene_.sensor;
    if (s.projection == Projection::meters) return write_meters();
    open("sensor", plugin(s), "", "");
    SensorFields fields{*this, s};
    describe(fields, s);
    write_sampler();
    object(scene_.film);
    close("sensor");
  }

  // Functions that write one member of an object: an overload for each type of member.
  template <class Tag>
  requires(!std::is_same_v<Tag, AssetTag>) void nested(std::string_view name, const Index<Tag>& i) {
    reference(name, id_of(i));
  }
  void nested(std::string_view, MeterIndex i) { write_meter(scene_.meters[i.value]); }
  template <class T>
  void nested(std::string_view name, const std::optional<T>& x) {
    if (x) nested(name, *x);
  }
  template <class... Ts>
  void nested(std::string_view name, const std::variant<Ts...>& x) {
    std::visit([&](const auto& alternative) { object(alternative, "", name); }, x);
  }
  template <Described T>
  void nested(std::string_view name, const T& x) {
    object(x, "", name);
  }

  void property(const Field& f, double x) {
    if (x != f.unwritten) value("float", f.name, shortest_number(x));
  }
  void property(const Field& f, int x) {
    // The default 0 is left out: it means no crop, an offset of 0, or the first mesh of a file.
    if (x == 0 && (f.name.starts_with("crop_") || f.name == "shape_index")) return;
    if (x == f.unwritten) return;
    value("integer", f.name, std::to_string(x));
  }
  void property(const Field& f, std::uint64_t x) { value("integer", f.name, std::to_string(x)); }
  void property(const Field& f, bool x) {
    if (x || f.name != kOurOwn) value("boolean", f.name, x ? "true" : "false");
  }
  void property(const Field& f, const std::string& x) {
    if (!x.empty()) value("string", f.name, x);
  }
  template <class E>
  requires std::is_enum_v<E>
  void property(const Field& f, E e) { value("string", f.name, name_of(e)); }
  void property(const Field& f, GridOrder o) {  // not in Mitsuba 3: written only if not the default
    if (o != GridOrder{}) value("string", f.name, name_of(o));
  }
  void property(const Field& f, const Vec3& x) {
    line(fmt::format("<{} name=\"{}\" x=\"{}\" y=\"{}\" z=\"{}\"/>",
                     f.given_as == "vector" ? "vector" : "point", f.name, shortest_number(x[0]),
                     shortest_number(x[1]), shortest_number(x[2])));
  }
  void property(const Field& f, const std::vector<MeterPoint>& points) {
    std::string rows;
    for (const MeterPoint& p : points) {
      rows += (rows.empty() ? "" : "; ") + numbers(p.position);
      if (p.direction != Vec3{0, 0, 0}) rows += " " + numbers(p.direction);
    }
    if (!rows.empty()) value("string", f.name, rows);
  }
  void property(const Field& f, const std::vector<double>& x) { value("string", f.name, numbers(x)); }
  void property(const Field& f, const Rgb& x) { colour(f, x, f.constvolume); }
  void colour(const Field& f, const Rgb& x, bool stands_for_volume) {
    const bool grey = is_grey(x);
    if (grey && x[0] == f.unwritten) return;
    if (grey) return value("float", f.name, shortest_number(x[0]));
    // Mitsuba 3 takes an <rgb> that stands for a volume for a reflectance, which is at most 1.
    if (!stands_for_volume || std::max({x[0], x[1], x[2]}) <= 1) return value("rgb", f.name, numbers(x));
    open("volume", kInfo<ConstVolume>.name, "", f.name);
    value("rgb", "value", numbers(x));
    close("volume");
  }
  void property(const Field& f, const Transform& x) {
    if (x != Transform{}) matrix(f.name, x.m);
  }
  void property(const Field& f, const std::vector<MotionKey>& keys) {
    line(fmt::format("<animation name=\"{}\">", f.name));
    for (const MotionKey& key : keys)
      line(fmt::format("  <transform time=\"{}\"><matrix value=\"{}\"/></transform>",
                       shortest_number(key.time), numbers(key.to_world.m)));
    line("</animation>");
  }
  void property(const Field& f, const UvTransform& x) {
    if (x != UvTransform{})
      matrix(f.name, {x.m[0], x.m[1], 0, x.m[2], x.m[3], x.m[4], 0, x.m[5], 0, 0, 1, 0, 0, 0, 0, 1});
  }
  void property(const Field& f, const AssetIndex& i) {
    const std::string& name = asset_names_[i.value];
    if (objects_.back().first == "volume" && !name.ends_with(".vol"))
      note(fmt::format("grids that are no .vol, such as {}", name));
    value("string", f.name, name);
  }
  template <class Tag>
  requires(std::is_same_v<Tag, TextureTag> ||
           std::is_same_v<Tag, VolumeTag>) void property(const Field& f, const Index<Tag>& i) {
    const Rgb* x = inline_value(i);
    if (!x) return reference(f.name, id_of(i));
    colour(f, *x, std::is_same_v<Tag, VolumeTag>);
  }
  void property(const Field& f, const std::optional<TextureIndex>& x) {
    if (x) property(f, *x);
  }
  void property(const Field& f, const std::optional<VolumeIndex>& x) {
    if (x) property(f, *x);
  }

  const Scene& scene_;
  std::vector<int> texture_uses_, volume_uses_;  // number of references to each texture or volume
  std::vector<std::string> asset_names_;         // names of assets as written to the file
  std::string out_;
  int depth_ = 1;
  std::vector<std::pair<std::string, std::string>> objects_;  // tag and type of the objects that are open
  std::vector<std::string> ours_;
  std::size_t opened_ = 0;  // offset at which the text of the last opened object begins
};

}  // namespace
}  // namespace scene

WrittenScene write_scene(const Scene& s) { return scene::Writer(s).run(); }
std::string write_xml(const Scene& s) { return write_scene(s).text; }

}  // namespace ls
