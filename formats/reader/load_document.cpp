#include "formats/xml/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "core/base/frame_range.h"
#include "core/base/text/suggest.h"
#include "core/scene/limits.h"
#include "formats/nori/translate.h"
#include "formats/reader/upgrade.h"

namespace ls::scene {
namespace {

constexpr std::string_view kFrameParameter = "frame";

bool is_name_char(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

// The values of the scene's parameters, which attributes refer to as $name. A `$name` within a substituted
// value is not substituted again, which excludes recursion and exponential growth.
class Parameters {
 public:
  Parameters(const ReadOptions& options, Report& report)
      : values_(options.defines.begin(), options.defines.end()), report_(report) {
    for (const auto& [name, value] : options.defines) {
      unused_.insert(name);
      note_length(name);
    }
    // $frame is not added to unused_: it causes no warning if the scene does not use it.
    if (!options.frame) return;
    values_.insert_or_assign(std::string(kFrameParameter), std::to_string(*options.frame));
    note_length(std::string(kFrameParameter));
  }

  // Warns of parameters that were given from outside (-D) but not used: they are probably misspelt.
  void warn_of_unused(const Span& at) const {
    std::vector<std::string> known;
    for (const auto& [name, value] : values_)
      if (!unused_.contains(name)) known.push_back(name);
    for (const std::string& name : unused_) {
      if (!report_.takes_warnings()) return;
      report_.warning(at, fmt::format("nothing in the scene asks for ${}, which was defined for it{}", name,
                                      known.empty() ? "; it has no parameters" : suggestion(name, known)));
    }
  }

  bool declare(const Element& e, std::string name, std::string value) {
    if (name.empty()) return complain(e.at, "<default> needs a name");
    if (name.size() > kMaxParameterNameBytes)
      return complain(e.at,
                      fmt::format("the name of a parameter is longer than {} bytes", kMaxParameterNameBytes));
    if (values_.size() >= kMaxParameters)
      return complain(e.at, fmt::format("more than {} parameters", kMaxParameters));
    note_length(name);
    values_.emplace(std::move(name), std::move(value));  // no effect if -D or an earlier <default> set it
    return true;
  }

  bool substitute(Attribute& a) {
    if (a.value.find('$') == std::string::npos) return true;
    std::string out;
    for (std::size_t i = 0; i < a.value.size();) {
      if (a.value.compare(i, 2, "\\$") == 0) {
        out += '$';
        i += 2;
      } else if (a.value[i] != '$') {
        out += a.value[i++];
      } else {
        const auto found = longest_at(a.value, i + 1);
        if (found == values_.end()) return undefined(a, i + 1);
        unused_.erase(found->first);
        out += found->second;
        i += 1 + found->first.size();
      }
      if (out.size() > kMaxValueBytes)
        return complain(a.value_at, fmt::format("with its parameters put in, this is longer than {} bytes",
                                                kMaxValueBytes));
    }
    // The substituted text is untrusted, so it is checked.
    if (find_invalid_utf8(out) != std::string_view::npos || find_control(out) != std::string_view::npos)
      return complain(a.value_at,
                      "with its parameters put in, this has bytes in it that are no UTF-8 text, or control "
                      "characters");
    total_ += out.size();
    if (total_ > kMaxSubstitutedBytes)
      return complain(a.value_at,
                      fmt::format("parameters fill in more than {} bytes altogether", kMaxSubstitutedBytes));
    a.value = std::move(out);
    return true;
  }

 private:
  using Values = std::map<std::string, std::string, std::less<>>;

  void note_length(const std::string& name) {
    longest_ = std::min(std::max(longest_, name.size()), kMaxParameterNameBytes);
  }

  // Returns the parameter with the longest name that the text has at position `at`, as in Mitsuba: "$resx"
  // means `resx` if that exists, otherwise the value of `res` followed by an x.
  Values::const_iterator longest_at(const std::string& text, std::size_t at) const {
    std::size_t end = at;
    while (end < std::min(text.size(), at + longest_) && is_name_char(text[end])) ++end;
    for (; end > at; --end)
      if (const auto it = values_.find(std::string_view(text).substr(at, end - at)); it != values_.end())
        return it;
    return values_.end();
  }

  bool undefined(const Attribute& a, std::size_t at) {
    std::size_t end = at;
    while (end < a.value.size() && is_name_char(a.value[end])) ++end;
    const std::string name = a.value.substr(at, end - at);
    std::vector<std::string> known;
    for (const auto& [key, value] : values_) known.push_back(key);
    return complain(a.value_at, fmt::format("the parameter ${} is not defined: give it by <default "
                                            "name=\"{}\" value=\"...\"/> or -D {}=...{}",
                                            name, name, name, suggestion(name, known)));
  }

  bool complain(const Span& at, std::string text) {
    report_.error(at, std::move(text));
    return false;
  }

  Values values_;
  std::set<std::string> unused_;  // parameters of -D that have not been used so far
  Report& report_;
  std::size_t longest_ = 0;  // length of the longest parameter name
  std::size_t total_ = 0;
};

class Loader {
 public:
  Loader(AssetSource& assets, const ReadOptions& options, Report& report)
      : assets_(assets), parameters_(options, report), report_(report), frame_(options.frame) {}

  bool load(std::string name, std::string text, const Span* included_at, Element& root) {
    total_bytes_ += text.size();
    if (text.size() > kMaxTextBytes || total_bytes_ > kMaxTotalTextBytes)
      return too_large(std::move(name), included_at);
    const std::uint32_t file = report_.add_file(SourceText(std::move(name), std::move(text)));
    auto tree = parse_xml(file, report_, elements_left_);
    if (!tree) return false;
    root = std::move(*tree);
    const Attribute* version = root.find("version");
    if (nori::is_nori(root)) return expand(root, false);
    if (!version)
      return report_.error(root.at, fmt::format("<{}> has no version: a Mitsuba file begins with <scene "
                                                "version=\"3.0.0\">, a Nori file has a <camera>",
                                                root.tag)),
             false;
    if (version->value.empty() || !std::isdigit(static_cast<unsigned char>(version->value[0])))
      return report_.error(version->value_at,
                           fmt::format("'{}' is not a version; write version=\"3.0.0\"", version->value)),
             false;
    return expand(root, is_old_version(version->value));
  }
  void warn_of_unused_defines(const Element& root) const { parameters_.warn_of_unused(root.at); }

  std::vector<std::string> search_paths;

 private:
  bool too_large(std::string name, const Span* included_at) {
    const std::string text =
        fmt::format("scene text is limited to {} MiB a file and {} MiB with everything included",
                    kMaxTextBytes >> 20, kMaxTotalTextBytes >> 20);
    const Span at =
        included_at ? *included_at : Span{report_.add_file(SourceText(std::move(name), "")), 0, 1};
    report_.error(at, text);
    return false;
  }

  // Substitutes parameters, inserts the files of <include>, and applies and removes <default> and <path>. The
  // depth of recursion is bounded by kMaxNesting and kMaxIncludeDepth.
  bool expand(Element& e, bool old) {
    for (Attribute& a : e.attributes)
      if (!parameters_.substitute(a)) return false;
    std::vector<Element> children;
    for (Element& child : e.children)
      if (!expand_child(child, old, children)) return false;
    e.children = std::move(children);
    if (old) upgrade(e);
    return true;
  }

  bool expand_child(Element& child, bool old, std::vector<Element>& out) {
    if (child.tag == "include") return include(child, out);
    if (!expand(child, old)) return false;
    if (child.tag == "default") {
      return check_attributes(child, {"name", "value"}) &&
             parameters_.declare(child, std::string(child.get("name")), std::string(child.get("value")));
    }
    if (child.tag == "path") {
      if (!check_attributes(child, {"value"})) return false;
      if (search_paths.size() >= kMaxSearchPaths)
        return report_.error(child.at, fmt::format("more than {} <path> elements", kMaxSearchPaths)), false;
      search_paths.insert(search_paths.begin(), join_path("", child.get("value")));
      return true;
    }
    out.push_back(std::move(child));
    return true;
  }

  bool check_attributes(const Element& e, std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names)
      if (!e.find(name))
        return report_.error(e.at, fmt::format("<{}> needs the attribute '{}'", e.tag, name)), false;
    for (const Attribute& a : e.attributes)
      if (std::find(names.begin(), names.end(), a.name) == names.end()) {
        const std::vector<std::string> known(names.begin(), names.end());
        report_.error(a.name_at,
                      fmt::format("<{}> has no attribute '{}'{}", e.tag, a.name, suggestion(a.name, known)));
        return false;
      }
    return true;
  }

  bool include(Element& e, std::vector<Element>& out) {
    for (Attribute& a : e.attributes)
      if (!parameters_.substitute(a)) return false;
    if (!check_attributes(e, {"filename"})) return false;
    const Span at = e.find("filename")->value_at;
    const std::string name = frame_ ? numbered(e.get("filename"), *frame_) : std::string(e.get("filename"));
    if (static_cast<int>(including_.size()) >= kMaxIncludeDepth || ++includes_ > kMaxIncludes)
      return report_.error(at, fmt::format("includes are limited to {} within each other and {} altogether",
                                           kMaxIncludeDepth, kMaxIncludes)),
             false;
    auto found = find_included(name);
    if (!found) return report_.error(at, found.error().message), false;
    if (std::find(including_.begin(), including_.end(), found->name) != including_.end())
      return report_.error(at, fmt::format("\"{}\" includes itself", name)), false;
    including_.push_back(found->name);
    Element root;
    const bool ok = load(std::move(found->name), std::move(found->text), &at, root);
    including_.pop_back();
    if (!ok) return false;
    if (root.tag != "scene") {
      std::erase_if(root.attributes, [](const Attribute& a) { return a.name == "version"; });
      out.push_back(std::move(root));
    } else {
      std::move(root.children.begin(), root.children.end(), std::back_inserter(out));
    }
    return true;
  }

  struct Included {
    std::string name, text;
  };
  // Searches for an included file as Mitsuba 3 does: in the folder of the including file, then in the folders
  // of the <path> elements, the latest of these first, then beside the main file.
  Result<Included> find_included(const std::string& name) {
    std::vector<std::string> places;
    if (!including_.empty()) places.push_back(join_path(join_path(including_.back(), ".."), name));
    for (const std::string& path : search_paths) places.push_back(join_path(path, name));
    for (const std::string& place : places)
      if (auto text = assets_.text(place)) return Included{place, std::move(*text)};
    const std::string own = join_path("", name);
    auto text = assets_.text(own);
    if (!text) return tl::unexpected<Error>(text.error());
    return Included{own, std::move(*text)};
  }

  AssetSource& assets_;
  Parameters parameters_;
  Report& report_;
  std::optional<std::uint32_t> frame_;
  std::vector<std::string> including_;
  std::size_t total_bytes_ = 0, elements_left_ = kMaxElements;
  int includes_ = 0;
};

}  // namespace

std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report) {
  Loader loader(assets, options, report);
  Document document;
  if (!loader.load(std::string(file_name), std::string(text.substr(0, kMaxTextBytes + 1)), nullptr,
                   document.root))
    return std::nullopt;
  loader.warn_of_unused_defines(document.root);
  document.search_paths = std::move(loader.search_paths);
  document.frame = options.frame;
  document.labels = options.labels;
  return document;
}

std::string join_path(std::string_view folder, std::string_view name) {
  const bool own_root = !name.empty() && name[0] == '/';
  const std::string joined =
      own_root || folder.empty() ? std::string(name) : fmt::format("{}/{}", folder, name);
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= joined.size();) {
    const std::size_t end = std::min(joined.find('/', begin), joined.size());
    const std::string_view part = std::string_view(joined).substr(begin, end - begin);
    begin = end + 1;
    if (part.empty() || part == ".") continue;
    if (part == ".." && !parts.empty() && parts.back() != "..")
      parts.pop_back();
    else
      parts.push_back(part);
  }
  std::string out = joined.empty() || joined[0] != '/' ? "" : "/";
  for (const std::string_view part : parts) {
    if (!out.empty() && out.back() != '/') out += '/';
    out += part;
  }
  return out;
}

}  // namespace ls::scene
