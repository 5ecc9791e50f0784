#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <pugixml.hpp>

#include "core/scene/limits.h"
#include "formats/xml/document.h"

namespace ls::scene {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// Finds the positions of the attributes of an element in the text: pugixml reports only where the tag begins.
// `at` is the offset of the tag's name in well-formed XML.
class AttributePlaces {
 public:
  AttributePlaces(std::uint32_t file, std::string_view text, std::size_t at)
      : file_(file), text_(text), at_(at) {
    while (more() && !is_space(text_[at_]) && text_[at_] != '>' && text_[at_] != '/') ++at_;
  }

  void next(Attribute& out) {
    skip_space();
    const std::size_t name = at_;
    while (more() && !is_space(text_[at_]) && text_[at_] != '=' && text_[at_] != '>') ++at_;
    out.name_at = {file_, name, at_ - name};
    skip_space();
    if (more()) ++at_;  // skips '='
    skip_space();
    const char quote = more() ? text_[at_] : '"';
    const std::size_t value = std::min(at_ + 1, text_.size());
    at_ = std::min(text_.find(quote, value), text_.size());
    out.value_at = {file_, value, at_ - value};
    if (more()) ++at_;
  }

 private:
  bool more() const { return at_ < text_.size(); }
  void skip_space() {
    while (more() && is_space(text_[at_])) ++at_;
  }
  std::uint32_t file_;
  std::string_view text_;
  std::size_t at_;
};

// Returns what is wrong with an attribute's value, in which pugixml has decoded character numbers such as
// &#65;; empty if it is valid. `raw` is the value as written in the file.
std::string_view unprintable(const Attribute& a, std::string_view raw) {
  if (find_invalid_utf8(a.value) != std::string_view::npos) return "a number that is no character";
  if (find_control(a.value) != std::string_view::npos) return "a control character";
  // pugixml returns the decoded value as a C string, which ends before a zero byte (&#0;). So zero bytes are
  // searched for in the raw text.
  for (std::size_t at = raw.find("&#"); at != std::string_view::npos; at = raw.find("&#", at + 2)) {
    std::size_t digit = at + 2;
    if (digit < raw.size() && raw[digit] == 'x') ++digit;
    const std::size_t end = raw.find_first_not_of('0', digit);
    if (end != digit && end < raw.size() && raw[end] == ';') return "a zero byte";
  }
  return {};
}

class TreeBuilder {
 public:
  TreeBuilder(std::uint32_t file, Report& report)
      : file_(file), report_(report), text_(report.file(file).text()) {}

  // The depth of recursion is bounded by kMaxNesting.
  bool build(pugi::xml_node node, Element& out, int depth) {
    out.tag = node.name();
    out.at = {file_, static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, node.offset_debug())),
              out.tag.size()};
    if (depth > kMaxNesting)
      return report_.error(out.at, fmt::format("elements are nested more than {} deep", kMaxNesting)), false;
    if (!read_attributes(node, out)) return false;
    for (const pugi::xml_node child : node.children()) {
      if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata)
        return report_.error(out.at,
                             fmt::format("text inside <{}>: a scene says everything in attributes", out.tag)),
               false;
      if (child.type() != pugi::node_element) continue;
      out.children.emplace_back();
      if (!build(child, out.children.back(), depth + 1)) return false;
    }
    return true;
  }

 private:
  bool read_attributes(pugi::xml_node node, Element& out) {
    AttributePlaces places(file_, text_, out.at.offset);
    for (const pugi::xml_attribute attribute : node.attributes()) {
      // The limit bounds the time of the search for duplicate names below, which is quadratic in their
      // number.
      if (out.attributes.size() == kMaxElementAttributes)
        return report_.error(out.at,
                             fmt::format("<{}> has more than {} attributes", out.tag, kMaxElementAttributes)),
               false;
      Attribute a{attribute.name(), attribute.value(), {}, {}};
      places.next(a);
      if (out.find(a.name))
        return report_.error(a.name_at, fmt::format("<{}> has the attribute '{}' twice", out.tag, a.name)),
               false;
      if (const auto wrong = unprintable(a, text_.substr(a.value_at.offset, a.value_at.length));
          !wrong.empty())
        return report_.error(a.value_at, fmt::format("the value of '{}' has {} in it", a.name, wrong)), false;
      if (a.value.size() > kMaxValueBytes)
        return report_.error(a.name_at, fmt::format("the value of '{}' is longer than {} bytes", a.name,
                                                    kMaxValueBytes)),
               false;
      out.attributes.push_back(std::move(a));
    }
    return true;
  }

  std::uint32_t file_;
  Report& report_;
  std::string_view text_;
};

// Returns the offset of the first attribute value that has no closing quote before the next '<', which XML
// does not allow in values; npos if there is none. (A parser would report such a missing quote at a later
// place.) Quotes in comments, CDATA and instructions are ignored.
std::size_t find_open_quote(std::string_view text) {
  static constexpr std::string_view kOpaque[][2] = {{"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}};
  bool in_tag = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!in_tag) {
      const auto opaque = std::find_if(std::begin(kOpaque), std::end(kOpaque), [&](const auto& marks) {
        return text.substr(i).starts_with(marks[0]);
      });
      if (opaque != std::end(kOpaque)) {
        const std::size_t end = text.find((*opaque)[1], i);
        if (end == std::string_view::npos) break;
        i = end;
      }
      in_tag = text[i] == '<';
    } else if (text[i] == '"' || text[i] == '\'') {
      const std::size_t end = text.find(text[i], i + 1);
      if (text.substr(i, end == std::string_view::npos ? end : end - i).find('<') != std::string_view::npos ||
          end == std::string_view::npos)
        return i;
      i = end;
    } else if (text[i] == '>') {
      in_tag = false;
    }
  }
  return std::string_view::npos;
}

// Reports a malformed text at a more helpful place than where pugixml stopped.
void malformed(std::uint32_t file, const pugi::xml_parse_result& result, Report& report) {
  if (result.status == pugi::status_out_of_memory) throw std::bad_alloc();  // not a fault of the text
  const std::string& text = report.file(file).text();
  if (const std::size_t quote = find_open_quote(text); quote != std::string_view::npos)
    return report.error({file, quote, 1},
                        fmt::format("malformed XML: the quote {} that opens here is not closed before the "
                                    "next element (a '<' in a value is written &lt;)",
                                    text[quote]));
  const auto offset = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, result.offset));
  report.error({file, offset, 1}, fmt::format("malformed XML: {}", result.description()));
}

// Checks that the numbers of tags and attributes are within the limits, which bounds pugixml's memory.
bool small_enough(std::uint32_t file, std::string_view text, Report& report, std::size_t& elements_left) {
  std::size_t tags = 0, attributes = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    tags += text[i] == '<' && i + 1 < text.size() && text[i + 1] != '/';
    attributes += text[i] == '=';
    if (tags <= elements_left && attributes <= kMaxAttributes) continue;
    report.error({file, i, 1}, fmt::format("the scene has more than {} elements or {} attributes",
                                           kMaxElements, kMaxAttributes));
    return false;
  }
  elements_left -= tags;
  return true;
}

}  // namespace

std::optional<Element> parse_xml(std::uint32_t file, Report& report, std::size_t& elements_left) {
  const std::string& text = report.file(file).text();
  if (const std::size_t bad = find_invalid_utf8(text); bad != std::string_view::npos)
    return report.refuse({file, bad, 1}, "this is not UTF-8 text");
  if (const std::size_t nul = text.find('\0'); nul != std::string::npos)
    return report.refuse({file, nul, 1}, "a zero byte in the text");
  if (!small_enough(file, text, report, elements_left)) return std::nullopt;

  pugi::xml_document xml;
  // pugixml expands only XML's five entities and character numbers, no entities of a DTD.
  const pugi::xml_parse_result result =
      xml.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    malformed(file, result, report);
    return std::nullopt;
  }
  const pugi::xml_node root = xml.document_element();
  if (!root) return report.refuse({file, 0, 1}, "no XML element in this file: it is empty or not XML");
  for (pugi::xml_node other = root.next_sibling(); other; other = other.next_sibling()) {
    if (other.type() != pugi::node_element) continue;
    return report.refuse(
        {file, static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, other.offset_debug())), 1},
        "a second root element: everything belongs into one <scene>");
  }
  Element tree;
  if (!TreeBuilder(file, report).build(root, tree, 1)) return std::nullopt;
  return tree;
}

}  // namespace ls::scene
