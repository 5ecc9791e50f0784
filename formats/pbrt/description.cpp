#include "formats/pbrt/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <utility>

#include "core/base/file_form.h"
#include "core/base/frame_range.h"
#include "core/base/parse_number.h"
#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "formats/file_names.h"
#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

constexpr std::string_view kDefaultMaterial = "default material";

class Loader {
 public:
  Loader(AssetSource& assets, const ReadOptions& options, Report& report)
      : report_(report), options_(options), t_{.assets = assets, .report = report} {}

  std::optional<Document> run(std::string_view file_name, std::string_view text) {
    const auto file = opened(std::string(file_name), std::string(text), nullptr);
    if (!file) return std::nullopt;
    const Span start{*file, 0, 1};
    t_.scene = made("scene", "", start);
    set(t_.scene, "version", "3.0.0", start);
    now_.material = {std::string(kDefaultMaterial)};
    add_default_material(start);
    parse(*file);
    if (!report_.has_errors()) close(start);
    if (report_.has_errors()) return std::nullopt;
    return Document{std::move(t_.scene), {}, options_.frame, options_.labels};
  }

 private:
  using Directive = void (Loader::*)(const Token&);

  void add_default_material(const Span& at) {
    Element out = made("bsdf", "twosided", at), grey = made("bsdf", "diffuse", at);
    set(out, "id", std::string(kDefaultMaterial), at);
    add(out, std::move(grey));
    add(t_.scene, std::move(out));
  }

  std::optional<std::uint32_t> opened(std::string name, std::string text, const Span* included_at) {
    text.erase(0, text.size() - without_mark(text).size());
    total_bytes_ += text.size();
    const bool too_large = text.size() > kMaxTextBytes || total_bytes_ > kMaxTotalTextBytes;
    const std::uint32_t file =
        report_.add_file(SourceText(std::move(name), too_large ? "" : std::move(text)));
    const std::string& kept = report_.file(file).text();
    const std::size_t bad = std::min(find_invalid_utf8(kept), kept.find('\0'));
    if (too_large)
      report_.error(included_at ? *included_at : Span{file, 0, 1},
                    fmt::format("scene text is limited to {} MiB a file and {} MiB with everything included",
                                kMaxTextBytes >> 20, kMaxTotalTextBytes >> 20));
    else if (bad != std::string::npos)
      report_.error({file, bad, 1}, fmt::format("this file {}", why_no_utf8(kept).empty()
                                                                    ? "is no UTF-8 text, as a pbrt file is"
                                                                    : why_no_utf8(kept)));
    else
      return file;
    return std::nullopt;
  }

  void parse(std::uint32_t file) {
    Tokens tokens(file, report_);
    Tokens* const outer = std::exchange(tokens_, &tokens);
    while (tokens.peek() && !report_.full()) {
      const Token token = tokens.take();
      if (token.kind != Token::Kind::word) {
        report_.error(token.at, "a directive is wanted here, such as Shape");
        break;
      }
      if (++directives_ > kMaxElements) {
        report_.error(token.at, fmt::format("more than {} directives", kMaxElements));
        break;
      }
      if (!run(token) || !count_elements(token)) break;
    }
    tokens_ = outer;
  }

  // Counts the elements of the translated scene, and reports an error if there are more than kMaxElements,
  // which is also the limit for an XML file. The elements in a group are not counted here: each was counted
  // when it was added to the group.
  bool count_elements(const Token& token) {
    for (; counted_ < t_.scene.children.size(); ++counted_)
      if (t_.scene.children[counted_].get("type") != "shapegroup")
        elements_ += size_of(t_.scene.children[counted_]);
    if (elements_ <= kMaxElements) return true;
    report_.error(token.at,
                  fmt::format("the scene is too large: written as XML it would have more than {} elements",
                              kMaxElements));
    return false;
  }

  // Returns false if the text after the directive cannot be understood.
  bool run(const Token& token) {
    const auto& known = directives();
    const auto found = known.find(token.text);
    if (found == known.end()) {
      std::vector<std::string> names;
      for (const auto& [name, run] : known) names.emplace_back(name);
      report_.error(token.at,
                    fmt::format("there is no directive {}{}", token.text, suggestion(token.text, names)));
      return false;
    }
    lost_ = false;
    (this->*found->second)(token);
    return !lost_ && !tokens_->broken();
  }

  static const std::map<std::string_view, Directive>& directives();

  // Functions that read the text after a directive.
  std::optional<std::string> quoted(const Token& d) {
    const Token* next = tokens_->peek();
    if (next && next->kind == Token::Kind::quoted) {
      last_ = next->at;
      return tokens_->take().text;
    }
    if (!tokens_->broken())
      report_.error(next ? next->at : d.at, fmt::format("{} wants a quoted text here", d.text));
    lost_ = true;
    return std::nullopt;
  }

  std::optional<std::vector<double>> numbers(const Token& d, std::size_t count) {
    std::vector<double> all;
    const bool bracketed = tokens_->peek() && tokens_->peek()->kind == Token::Kind::open;
    if (bracketed) tokens_->take();
    while (all.size() < count) {
      const Token* next = tokens_->peek();
      const auto x = next && next->kind == Token::Kind::word ? number(next->text) : std::nullopt;
      if (!x) return no_numbers(d, next, count);
      all.push_back(*x);
      tokens_->take();
    }
    if (!bracketed) return all;
    const Token* next = tokens_->peek();
    if (!next || next->kind != Token::Kind::close) return no_numbers(d, next, count);
    tokens_->take();
    return all;
  }

  static std::optional<double> number(std::string_view text) {
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto x = ls::parse_number<double>(text);
    return x && std::abs(*x) <= 1e30 ? x : std::nullopt;
  }

  std::nullopt_t no_numbers(const Token& d, const Token* next, std::size_t count) {
    if (!tokens_->broken())
      report_.error(next ? next->at : d.at, fmt::format("{} wants {} numbers", d.text, count));
    lost_ = true;
    return std::nullopt;
  }

  // Reads a type and its parameters. nullopt: they are wrong or not supported, which is reported.
  std::optional<Params> object(const Token& d) {
    const auto type = quoted(d);
    if (!type) return std::nullopt;
    const Span at = last_;
    auto params = parameters();
    return params ? known(d.text, *type, at, std::move(*params)) : std::nullopt;
  }

  std::optional<std::vector<Param>> parameters() {
    auto params = read_params(*tokens_, report_);
    lost_ = lost_ || !params;
    if (params)
      for (Param& p : *params) p.space = now_.space;
    return params;
  }

  std::optional<Params> known(std::string_view directive, const std::string& type, const Span& at,
                              std::vector<Param> params) {
    const Row* row = find_row(directive, type);
    if (row && row->is_read) return Params(*row, at, std::move(params), report_);
    return report_.refuse(at, row ? fmt::format("{} \"{}\" is not read: {}", directive, type, row->meaning)
                                  : fmt::format("there is no {} \"{}\"{}", directive, type,
                                                suggestion(type, types_of(directive))));
  }

  // Reads the parameters of a directive that defines a named object, such as MakeNamedMaterial. The object's
  // type is in the parameter "type".
  std::optional<Params> named(std::string_view directive, const Span& at) {
    auto params = parameters();
    if (!params) return std::nullopt;
    const auto type =
        std::find_if(params->begin(), params->end(), [](const Param& p) { return p.name == "type"; });
    if (type == params->end() || type->texts.size() != 1)
      return report_.refuse(at, "\"string type\" is missing: it says which type of object this is");
    const std::string name = type->texts[0];
    const Span type_at = type->at;
    params->erase(type);
    return known(directive, name, type_at, std::move(*params));
  }

  // Directives for settings.
  void setting(const Token& d, std::optional<Params>& slot) {
    const Span at = d.at;
    if (in_world_) report_.error(at, fmt::format("{} belongs before WorldBegin", d.text));
    auto p = object(d);
    if (slot)
      report_.error(at,
                    fmt::format("a second {}; the first is in {}", d.text, report_.refer_to(slot->at(), at)));
    if (p) slot = std::move(*p);
  }
  void film(const Token& d) {
    setting(d, settings_.film);
    expose(d);
  }
  void expose(const Token& d) {
    const double factor = exposure_of(settings_);
    if (t_.lit && factor != t_.exposure_factor)
      report_.error(
          d.at,
          fmt::format("{} changes the exposure of media that stand before it: put it before them", d.text));
    t_.exposure_factor = factor;
  }
  void pixel_filter(const Token& d) { setting(d, settings_.filter); }
  void sampler(const Token& d) { setting(d, settings_.sampler); }
  void integrator(const Token& d) { setting(d, settings_.integrator); }
  void camera(const Token& d) {
    setting(d, settings_.camera);
    expose(d);
    settings_.camera_ctm = now_.ctm;
    settings_.camera_end_ctm = now_.end_ctm;
    settings_.start_time = t_.start_time;
    settings_.end_time = t_.end_time;
    settings_.camera_medium = now_.outside;
    System world{now_.ctm, now_.end_ctm};
    std::swap(world.start.to, world.start.from);
    std::swap(world.end.to, world.end.from);
    systems_["camera"] = world;
  }
  void accelerator(const Token& d) {
    if (quoted(d)) parameters();
  }
  void color_space(const Token& d) {
    const auto name = quoted(d);
    if (!name) return;
    if (const auto space = colour_space(*name)) return void(now_.space = *space);
    const std::vector<std::string> known{"srgb", "dci-p3", "rec2020", "aces2065-1"};
    report_.error(last_, fmt::format("there is no ColorSpace \"{}\"{}", *name, suggestion(*name, known)));
  }
  bool next_is(Token::Kind kind) {
    const Token* next = tokens_->peek();
    return next && next->kind == kind;
  }
  // Takes one value, which may stand in brackets.
  std::optional<std::string> option_value() {
    const bool brackets = next_is(Token::Kind::open);
    if (brackets) tokens_->take();
    if (!tokens_->peek() || next_is(Token::Kind::open) || next_is(Token::Kind::close)) return std::nullopt;
    std::string value = tokens_->take().text;
    if (!brackets) return value;
    if (!next_is(Token::Kind::close)) return std::nullopt;
    tokens_->take();
    return value;
  }
  void option(const Token& d) {
    // pbrt-v4 reads a name and one value, and files may also have the type before the name.
    auto name = quoted(d);
    if (!name) return;
    const Span at = last_;
    name->erase(0, name->find_last_of(" \t") + 1);
    const std::optional<std::string> given = option_value();
    if (!given) {
      lost_ = true;
      if (!tokens_->broken())
        report_.error(at, fmt::format("the Option '{}' {}", *name,
                                      tokens_->peek() ? "wants one value" : "has no value"));
      return;
    }
    const std::string& value = *given;
    std::string lower;
    for (const char c : *name)
      if (c != '-') lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    static constexpr std::string_view kIdle[] = {"seed",
                                                 "disabletexturefiltering",
                                                 "disablewavelengthjitter",
                                                 "displacementedgescale",
                                                 "msereferenceimage",
                                                 "msereferenceout",
                                                 "rendercoordsys",
                                                 "pixelstats",
                                                 "wavefront",
                                                 "quiet"};
    const bool changes_pixels = lower == "forcediffuse" || lower == "disablepixeljitter";
    if (std::find(std::begin(kIdle), std::end(kIdle), lower) != std::end(kIdle))
      report_.warning(at, fmt::format("the Option '{}' has no effect here: how the picture is computed is "
                                      "chosen by the command line or the job",
                                      *name));
    else if (!changes_pixels || value != "false")
      report_.error(at, fmt::format("the Option '{}' is not read: leave it out", *name));
  }

  // Directives for the graphics state.
  void world_begin(const Token& d) {
    if (in_world_) return report_.error(d.at, "a second WorldBegin: a file has one scene");
    in_world_ = true;
    now_.at_start = now_.at_end = true;
    now_.ctm = now_.end_ctm = {};
    systems_["world"] = {};
  }
  void world_end(const Token&) {}
  void attribute_begin(const Token& d) { push(d); }
  void attribute_end(const Token& d) { pop(d); }

  // A coordinate system, at the two times.
  struct System {
    Placed start, end;
  };
  struct Saved {
    Attributes attributes;
    Span at;
  };
  void push(const Token& d) {
    if (saved_.size() >= kMaxPbrtNesting) {
      lost_ = true;
      return report_.error(d.at, fmt::format("attributes are nested more than {} deep", kMaxPbrtNesting));
    }
    saved_.push_back({now_, d.at});
  }
  void pop(const Token& d) {
    if (saved_.size() <= floor_)
      return report_.error(d.at, fmt::format("this {} ends nothing that was begun", d.text));
    now_ = std::move(saved_.back().attributes);
    saved_.pop_back();
  }

  void grow(const Placed& inner) { set_ctm({then(now_.ctm, inner), then(now_.end_ctm, inner)}); }
  void identity(const Token&) { set_ctm({}); }
  void translate(const Token& d) {
    if (const auto n = numbers(d, 3)) grow(moved(Vec3{{(*n)[0], (*n)[1], (*n)[2]}}));
  }
  void scale(const Token& d) {
    const auto n = numbers(d, 3);
    if (!n) return;
    if (std::any_of(n->begin(), n->end(), [](double x) { return !std::isnormal(x); }))
      return report_.error(d.at, "Scale by 0 flattens all that follows: it can't be inverted");
    grow(scaled(Vec3{{(*n)[0], (*n)[1], (*n)[2]}}));
  }
  void rotate(const Token& d) {
    const auto n = numbers(d, 4);
    if (!n) return;
    const Vec3 axis{{(*n)[1], (*n)[2], (*n)[3]}};
    if (!std::isnormal(dot(axis, axis))) return report_.error(d.at, "the axis of Rotate has no direction");
    grow(turned((*n)[0], axis));
  }
  void look_at(const Token& d) {
    const auto n = numbers(d, 9);
    if (!n) return;
    const auto& x = *n;
    if (const auto p = looking(Vec3{{x[0], x[1], x[2]}}, Vec3{{x[3], x[4], x[5]}}, Vec3{{x[6], x[7], x[8]}}))
      return grow(*p);
    report_.error(d.at, "LookAt has its eye at its target, or looks along its up");
  }
  std::optional<Placed> matrix(const Token& d) {
    const auto n = numbers(d, 16);
    const auto p = n ? of_columns(*n) : std::nullopt;
    if (n && !p) report_.error(d.at, fmt::format("the matrix of {} can't be inverted", d.text));
    return p;
  }
  void transform(const Token& d) {
    if (const auto p = matrix(d)) set_ctm({*p, *p});
  }
  void concat_transform(const Token& d) {
    if (const auto p = matrix(d)) grow(*p);
  }
  void coordinate_system(const Token& d) {
    if (const auto name = quoted(d)) systems_[*name] = {now_.ctm, now_.end_ctm};
  }
  void coord_sys_transform(const Token& d) {
    const auto name = quoted(d);
    if (!name) return;
    if (const auto found = systems_.find(*name); found != systems_.end())
      set_ctm(found->second);
    else
      report_.error(last_, fmt::format("no CoordinateSystem \"{}\" stands before this", *name));
  }
  void active_transform(const Token& d) {
    const Token* next = tokens_->peek();
    const std::string which = next && next->kind == Token::Kind::word ? tokens_->take().text : "";
    if (which != "All" && which != "StartTime" && which != "EndTime") {
      lost_ = true;
      if (!tokens_->broken())
        report_.error(d.at, "ActiveTransform wants one of All, StartTime and EndTime after it");
      return;
    }
    now_.at_start = which != "EndTime";
    now_.at_end = which != "StartTime";
  }
  // Sets those of the two current transforms that are active.
  void set_ctm(const System& ctm) {
    if (now_.at_start) now_.ctm = ctm.start;
    if (now_.at_end) now_.end_ctm = ctm.end;
  }
  void transform_times(const Token& d) {
    const auto n = numbers(d, 2);
    if (!n) return;
    if (!((*n)[0] < (*n)[1]))
      return report_.error(d.at, fmt::format("TransformTimes end at {} and begin at {}: let them end later",
                                             (*n)[1], (*n)[0]));
    t_.start_time = (*n)[0];
    t_.end_time = (*n)[1];
  }
  void reverse_orientation(const Token&) { now_.reversed = !now_.reversed; }
  void attribute(const Token& d) {
    report_.error(d.at, "Attribute is not read: write the parameters into each of the objects");
    lost_ = true;
  }

  // Directives for objects.
  void need_world(const Token& d) {
    if (!in_world_) report_.error(d.at, fmt::format("{} belongs after WorldBegin", d.text));
  }
  void material(const Token& d) {
    need_world(d);
    auto p = object(d);
    if (!p) return;
    if (const auto m = add_material(t_, fmt::format("material {}", ++materials_), *p)) now_.material = *m;
  }
  void make_named_material(const Token& d) {
    const auto name = quoted(d);
    if (!name) return;
    const Span at = last_;
    auto p = named("Material", at);
    if (!p) return void(t_.materials.emplace(*name, Material{std::string(kDefaultMaterial)}));
    if (t_.materials.contains(*name))
      return report_.error(at, fmt::format("a second MakeNamedMaterial \"{}\"", *name));
    // After an error the name stands for the default material, so that its uses cause no further errors.
    const auto m = add_material(t_, *name, *p);
    t_.materials.emplace(*name, m.value_or(Material{std::string(kDefaultMaterial)}));
  }
  void named_material(const Token& d) {
    need_world(d);
    const auto name = quoted(d);
    if (!name) return;
    if (const auto found = t_.materials.find(*name); found != t_.materials.end()) {
      now_.material = found->second;
      return;
    }
    std::vector<std::string> names;
    for (const auto& [known, m] : t_.materials) names.push_back(known);
    report_.error(last_, fmt::format("no MakeNamedMaterial \"{}\" stands before this{}", *name,
                                     suggestion(*name, names)));
  }
  void texture(const Token& d) {
    const auto name = quoted(d);
    if (!name) return;
    const auto kind = quoted(d);
    if (!kind) return;
    if (*kind != "float" && *kind != "spectrum" && *kind != "color")
      report_.error(last_, fmt::format("a Texture is \"float\" or \"spectrum\", not \"{}\"", *kind));
    const TextureOf what = *kind == "float" ? TextureOf::numbers : TextureOf::colours;
    auto p = object(d);
    if (p)
      add_texture(t_, what, *name, *p);
    else
      set_texture(t_, what, *name, Texture{Rgb{1, 1, 1}, {}});
  }
  void light_source(const Token& d) {
    need_world(d);
    if (auto p = object(d)) add_light(t_, *p, now_.ctm);
  }
  void area_light_source(const Token& d) {
    need_world(d);
    if (auto p = object(d)) now_.light = area_light(t_, *p);
  }
  void make_named_medium(const Token& d) {
    const auto name = quoted(d);
    if (!name) return;
    const Span at = last_;
    auto p = named("MakeNamedMedium", at);
    if (p) add_medium(t_, *name, *p, now_.ctm);
  }
  void medium_interface(const Token& d) {
    const auto inside = quoted(d);
    if (!inside) return;
    now_.inside = now_.outside = *inside;
    const Token* next = tokens_->peek();
    if (next && next->kind == Token::Kind::quoted) now_.outside = tokens_->take().text;
  }
  void shape_(const Token& d) {
    need_world(d);
    auto p = object(d);
    if (!p) return;
    Attributes a = now_;
    if (group_ && a.light) {
      t_.warn_once(p->at(), "shapes of an ObjectBegin give no light, in pbrt neither");
      a.light.reset();
    }
    auto e = shape(t_, *p, a, group_.has_value());
    if (!e) return;
    if (group_) elements_ += size_of(*e);
    add(group_ ? *group_ : t_.scene, std::move(*e));
  }
  static std::string object_id(const std::string& name) { return fmt::format("object {}", name); }
  void object_begin(const Token& d) {
    need_world(d);
    const auto name = quoted(d);
    if (!name) return;
    if (group_) return report_.error(d.at, "an ObjectBegin within an ObjectBegin");
    push(d);
    group_ = made("shape", "shapegroup", last_);
    set(*group_, "id", object_id(*name), last_);
  }
  void object_end(const Token& d) {
    if (!group_) return report_.error(d.at, "this ObjectEnd ends nothing that was begun");
    add(t_.scene, std::move(*group_));
    group_.reset();
    pop(d);
  }
  void object_instance(const Token& d) {
    need_world(d);
    const auto name = quoted(d);
    if (!name) return;
    if (group_) return report_.error(d.at, "an ObjectInstance within an ObjectBegin: put its shapes here");
    Element out = made("shape", "instance", last_);
    refer(out, "", object_id(*name), last_);
    place_moving(t_, out, {now_.ctm.to, now_.end_ctm.to}, "", last_);
    add(t_.scene, std::move(out));
  }

  // Directives for other files.
  void include(const Token& d) { open(d, false); }
  void import(const Token& d) { open(d, true); }
  void open(const Token& d, bool apart) {
    const auto given = quoted(d);
    if (!given) return;
    const Span at = last_;
    const std::string name = join_path("", options_.frame ? numbered(*given, *options_.frame) : *given);
    if (static_cast<int>(including_.size()) >= kMaxIncludeDepth || ++includes_ > kMaxIncludes) {
      lost_ = true;
      return report_.error(at, fmt::format("includes are limited to {} within each other and {} altogether",
                                           kMaxIncludeDepth, kMaxIncludes));
    }
    if (std::find(including_.begin(), including_.end(), name) != including_.end())
      return report_.error(at, fmt::format("\"{}\" includes itself", *given));
    auto text = t_.assets.text(name);
    if (!text) return report_.error(at, text.error().message);
    const auto file = opened(name, std::move(*text), &at);
    if (!file) return;
    including_.push_back(name);
    if (apart) push(d);
    const std::size_t floor = std::exchange(floor_, apart ? saved_.size() : floor_);
    parse(*file);
    floor_ = floor;
    if (apart && !report_.has_errors()) pop(d);
    including_.pop_back();
    lost_ = false;
  }

  void close(const Span& start) {
    if (group_) report_.error(group_->at, "the ObjectEnd of this is missing");
    for (const Saved& s : saved_)
      if (!group_) report_.error(s.at, "this is begun and not ended");
    if (!in_world_)
      report_.error(start, "the file has no WorldBegin, after which its shapes and lights stand");
    add_settings(t_, settings_, start);
  }

  Report& report_;
  const ReadOptions& options_;
  Translation t_;
  Settings settings_;
  Attributes now_;
  std::vector<Saved> saved_;
  // While an imported file is read: the size of saved_ when the file began. Entries of saved_ are blocks that
  // are still open, such as AttributeBegin; the file cannot end the blocks that began before it.
  std::size_t floor_ = 0;
  std::map<std::string, System> systems_;
  std::optional<Element> group_;
  bool in_world_ = false, lost_ = false;
  Tokens* tokens_ = nullptr;
  Span last_;  // place of the quoted text that was read last
  std::vector<std::string> including_;
  std::size_t total_bytes_ = 0, directives_ = 0, elements_ = 0, counted_ = 0;
  int includes_ = 0, materials_ = 0;
};

const std::map<std::string_view, Loader::Directive>& Loader::directives() {
  static const std::map<std::string_view, Directive> all = {
      {"Accelerator", &Loader::accelerator},
      {"ActiveTransform", &Loader::active_transform},
      {"AreaLightSource", &Loader::area_light_source},
      {"Attribute", &Loader::attribute},
      {"AttributeBegin", &Loader::attribute_begin},
      {"AttributeEnd", &Loader::attribute_end},
      {"Camera", &Loader::camera},
      {"ColorSpace", &Loader::color_space},
      {"ConcatTransform", &Loader::concat_transform},
      {"CoordSysTransform", &Loader::coord_sys_transform},
      {"CoordinateSystem", &Loader::coordinate_system},
      {"Film", &Loader::film},
      {"Identity", &Loader::identity},
      {"Import", &Loader::import},
      {"Include", &Loader::include},
      {"Integrator", &Loader::integrator},
      {"LightSource", &Loader::light_source},
      {"LookAt", &Loader::look_at},
      {"MakeNamedMaterial", &Loader::make_named_material},
      {"MakeNamedMedium", &Loader::make_named_medium},
      {"Material", &Loader::material},
      {"MediumInterface", &Loader::medium_interface},
      {"NamedMaterial", &Loader::named_material},
      {"ObjectBegin", &Loader::object_begin},
      {"ObjectEnd", &Loader::object_end},
      {"ObjectInstance", &Loader::object_instance},
      {"Option", &Loader::option},
      {"PixelFilter", &Loader::pixel_filter},
      {"ReverseOrientation", &Loader::reverse_orientation},
      {"Rotate", &Loader::rotate},
      {"Sampler", &Loader::sampler},
      {"Scale", &Loader::scale},
      {"Shape", &Loader::shape_},
      {"Texture", &Loader::texture},
      {"Transform", &Loader::transform},
      {"TransformBegin", &Loader::attribute_begin},
      {"TransformEnd", &Loader::attribute_end},
      {"TransformTimes", &Loader::transform_times},
      {"Translate", &Loader::translate},
      {"WorldBegin", &Loader::world_begin},
      {"WorldEnd", &Loader::world_end},
  };
  return all;
}

}  // namespace

bool is_pbrt(std::string_view file_name) { return has_ending(file_name, {".pbrt"}); }

std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report) {
  return Loader(assets, options, report).run(file_name, text.substr(0, kMaxTextBytes + 1));
}

}  // namespace ls::scene::pbrt
