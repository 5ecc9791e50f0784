// A scene file as a tree of XML elements with their places in the text. Included files are inserted and
// $parameters substituted, but elements and values are not interpreted yet.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/read.h"
#include "formats/xml/source_text.h"

namespace ls::scene {

struct Attribute {
  std::string name, value;  // value: with entities decoded and parameters substituted
  Span name_at, value_at;   // places of both in the file; value_at: between the quotes
};

struct Element {
  std::string tag;
  Span at;  // place of the tag's name
  std::vector<Attribute> attributes;
  std::vector<Element> children;
  bool old = false;  // true for elements of a file of Mitsuba 0.x; see upgrade.h

  const Attribute* find(std::string_view attribute) const;
  // Returns the attribute's value; empty if there is no such attribute.
  std::string_view get(std::string_view attribute) const;
};

struct Document {
  Element root;
  std::vector<std::string> search_paths;  // folders of <path> elements, in the order in which they are tried
  std::optional<std::uint32_t> frame;     // ReadOptions::frame
  bool labels = false;                    // ReadOptions::labels
};

// Parses the XML text of the report's file number `file`. nullopt: the text is malformed, not UTF-8 or beyond
// the limits (core/scene/limits.h); this has been reported. `elements_left` is the number of elements that
// the scene may still have; the number of elements in the text is subtracted from it. No other function uses
// pugixml.
std::optional<Element> parse_xml(std::uint32_t file, Report& report, std::size_t& elements_left);

// Reads a scene file into a Document: parses it, inserts the files of <include>, and substitutes $parameters
// by options.defines or the values of <default>. The elements <include>, <default> and <path> are not in the
// result.
std::optional<Document> load_document(std::string_view file_name, std::string_view text, AssetSource& assets,
                                      const ReadOptions& options, Report& report);

// Returns the path of the file `name` in `folder`, with "." and ".." resolved where this is possible without
// looking at the disk. Either argument may be absolute or empty.
std::string join_path(std::string_view folder, std::string_view name);

// The functions below make elements in Mitsuba's format. Readers of other formats translate to these, and the
// common reader (formats/reader) then checks types, ranges and references. A new element gets the place
// of the text from which it is made, for messages.
Element made(std::string tag, std::string_view type, const Span& at);
void set(Element& e, std::string attribute, std::string value, const Span& at);
void add(Element& parent, Element child);
// Each adds a property element, such as <float name="..." value="..."/>. Numbers are written in the shortest
// form that reads back to the same bits.
void add(Element& parent, std::string tag, std::string name, std::string value, const Span& at);
void add(Element& parent, std::string tag, std::string name, const Vec3& value, const Span& at);
void add(Element& parent, std::string name, double value, const Span& at);
void add(Element& parent, std::string name, const Rgb& value, const Span& at);
// Adds a copy of the element `property` with another name.
void add_as(Element& parent, const Element* property, std::string name);
// Adds a <transform> with the steps `before` (<translate>, <matrix>, ...) followed by the steps of
// `transform`. Adds nothing if there are no steps at all.
void add_transform(Element& parent, const Element* transform, std::string name,
                   std::vector<Element> before = {});
// Adds a <transform> named "to_world" with this matrix; adds nothing if the matrix is the identity.
void place(Element& parent, const Transform& to_world, const Span& at);
// Returns the number of elements in the tree: e and all elements below it.
std::size_t size_of(const Element& e);
Element matrix_step(const std::array<double, 16>& m, const Span& at);

}  // namespace ls::scene
