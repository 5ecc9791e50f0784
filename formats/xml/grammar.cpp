#include "formats/xml/grammar.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/base/text/suggest.h"

namespace ls::scene {
namespace {

const std::vector<TagRow>& tags() {
  static const std::vector<TagRow> rows = [] {
    std::vector<TagRow> r;
    r.push_back({"scene", TagKind::object, {}, {"version", "type", "id", "name"}});
    for (const char* tag : {"integrator", "sensor", "film", "rfilter", "sampler", "shape", "bsdf", "emitter",
                            "texture", "volume", "medium", "phase"})
      r.push_back({tag, TagKind::object, {"type"}, {"id", "name"}});
    for (const char* tag : {"float", "integer", "boolean", "string", "rgb", "color"})
      r.push_back({tag, TagKind::property, {"name", "value"}, {}});
    r.push_back({"spectrum", TagKind::property, {"name"}, {"value", "filename"}});
    for (const char* tag : {"vector", "point"})
      r.push_back({tag, TagKind::property, {"name"}, {"value", "x", "y", "z"}});
    r.push_back({"transform", TagKind::transform, {"name"}, {}});
    r.push_back({"animation", TagKind::animation, {"name"}, {}});
    for (const char* tag : {"translate", "scale"})
      r.push_back({tag, TagKind::step, {}, {"value", "x", "y", "z"}});
    r.push_back({"rotate", TagKind::step, {"angle"}, {"value", "x", "y", "z"}});
    r.push_back({"lookat", TagKind::step, {"origin", "target"}, {"up"}});
    r.push_back({"matrix", TagKind::step, {"value"}, {}});
    r.push_back({"ref", TagKind::reference, {"id"}, {"name"}});
    r.push_back({"alias", TagKind::alias, {"id", "as"}, {}});
    return r;
  }();
  return rows;
}

const TagRow* row_of(const Element& e) {
  static const TagRow spectrum_object{"spectrum", TagKind::object, {"type"}, {"id", "name"}};
  if (e.tag == "spectrum" && e.find("type")) return &spectrum_object;
  for (const TagRow& row : tags())
    if (row.tag == e.tag) return &row;
  return nullptr;
}

// The <transform> of a time in an <animation>.
const TagRow& key_row() {
  static const TagRow row{"transform", TagKind::transform, {"time"}, {}};
  return row;
}

class StructureChecker {
 public:
  explicit StructureChecker(Report& report) : report_(report) {}

  // The depth of recursion is bounded by kMaxNesting.
  void check(const Element& e, const Element* parent) {
    if (report_.full()) return;
    const bool is_key = parent && parent->tag == "animation" && e.tag == "transform";
    const TagRow* row = is_key ? &key_row() : row_of(e);
    if (!parent && e.tag != "scene")
      return report_.error(e.at, fmt::format("the root must be <scene>, not <{}>", e.tag));
    if (!row) return unknown_tag(e);
    check_attributes(e, *row);
    if (parent) check_parent(e, *row, *parent);
    if (const Attribute* id = row->kind == TagKind::object ? e.find("id") : nullptr)
      declare(id->value, &e, id->value_at);
    if (row->kind == TagKind::alias) alias(e);
    for (const Element& child : e.children) check(child, &e);
  }

  Ids ids;

 private:
  void unknown_tag(const Element& e) {
    std::vector<std::string> known{"include", "default", "path"};
    for (const TagRow& row : tags()) known.emplace_back(row.tag);
    const auto near = nearest_name(e.tag, known);
    report_.error(e.at, fmt::format("there is no element <{}>{}", e.tag,
                                    near ? fmt::format("; did you mean <{}>?", *near) : ""));
  }

  void check_attributes(const Element& e, const TagRow& row) {
    scene::check_attributes(e, row, report_);
    if (report_.full()) return;
    const bool triple = e.tag == "vector" || e.tag == "point";
    if (triple && !e.find("value") && !(e.find("x") && e.find("y") && e.find("z")))
      report_.error(e.at, fmt::format("<{}> needs x, y and z, or value", e.tag));
    if (row.kind == TagKind::property && e.tag == "spectrum" && e.find("value") && e.find("filename"))
      report_.error(e.at, "<spectrum> gives both value and filename");
    if (row.kind == TagKind::property && e.tag == "spectrum" && !e.find("value") && !e.find("filename"))
      report_.error(e.at, "<spectrum> needs a value");
  }

  void check_parent(const Element& e, const TagRow& row, const Element& parent) {
    const TagRow* above = row_of(parent);
    const TagKind kind = above ? above->kind : TagKind::unknown;
    if (kind == TagKind::unknown) return;
    if (kind == TagKind::animation) {
      if (row.kind != TagKind::transform)
        report_.error(
            e.at, fmt::format("<{}> can't stand in <animation>: only <transform time=\"...\"> can", e.tag));
      return;
    }
    const bool step = row.kind == TagKind::step;
    if (step != (kind == TagKind::transform)) {
      report_.error(
          e.at, step ? fmt::format("<{}> is a step of a <transform> and can only stand in one", e.tag)
                : kind == TagKind::transform ? fmt::format("<{}> is no step of a <transform>", e.tag)
                                             : fmt::format("<{}> can't stand in <{}>", e.tag, parent.tag));
      if (step || kind == TagKind::transform) return;
    }
    if (e.tag == "scene" || (kind != TagKind::object && kind != TagKind::transform))
      report_.error(e.at, fmt::format("<{}> can't stand in <{}>", e.tag, parent.tag));
  }

  void declare(const std::string& id, const Element* object, const Span& at) {
    const auto [it, fresh] = ids.emplace(id, object);
    if (!fresh)
      report_.error(at, fmt::format("the id \"{}\" is given twice; first in {}", id,
                                    report_.refer_to(it->second->at, at)));
  }

  // Handles an <alias>. As in Mitsuba, the object that it gives a second id must come before it in the file.
  void alias(const Element& e) {
    const auto it = ids.find(e.get("id"));
    if (it != ids.end()) return declare(std::string(e.get("as")), it->second, value_place(e, "as"));
    std::vector<std::string> known;
    for (const auto& [id, object] : ids) known.push_back(id);
    report_.error(value_place(e, "id"), fmt::format("nothing before this line has the id \"{}\"{}",
                                                    e.get("id"), suggestion(e.get("id"), known)));
  }

  static Span value_place(const Element& e, std::string_view name) {
    const Attribute* a = e.find(name);
    return a ? a->value_at : e.at;
  }

  Report& report_;
};

}  // namespace

void check_attributes(const Element& e, const TagRow& row, Report& report) {
  for (const Attribute& a : e.attributes) {
    if (report.full()) return;
    const auto is = [&](const std::string& name) { return name == a.name; };
    if (std::any_of(row.required.begin(), row.required.end(), is) ||
        std::any_of(row.optional.begin(), row.optional.end(), is))
      continue;
    std::vector<std::string> known = row.required;
    known.insert(known.end(), row.optional.begin(), row.optional.end());
    report.error(a.name_at,
                 fmt::format("<{}> has no attribute '{}'{}", e.tag, a.name, suggestion(a.name, known)));
  }
  for (const std::string& name : row.required)
    if (!e.find(name)) report.error(e.at, fmt::format("<{}> needs the attribute '{}'", e.tag, name));
}

TagKind kind_of(const Element& e) {
  const TagRow* row = row_of(e);
  return row ? row->kind : TagKind::unknown;
}

Ids check_structure(const Element& root, Report& report) {
  StructureChecker checker(report);
  checker.check(root, nullptr);
  return std::move(checker.ids);
}

}  // namespace ls::scene
