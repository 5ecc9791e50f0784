// Checks the structure of a document: that its elements are known, have the right attributes and are nested
// as allowed. This is done for a whole document before anything is interpreted, so that the readers of
// objects can rely on a correct structure.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "formats/xml/document.h"

namespace ls::scene {

enum class TagKind { object, property, transform, animation, step, reference, alias, unknown };

// A row of a format's table of elements: the tag, its kind, and the attributes that it must and may have.
struct TagRow {
  std::string_view tag;
  TagKind kind;
  std::vector<std::string> required, optional;
};
// Reports attributes of `e` that are not in the row, and required attributes of the row that `e` lacks.
void check_attributes(const Element& e, const TagRow& row, Report& report);

TagKind kind_of(const Element& e);  // for example, a <spectrum type="..."> is an object

using Ids = std::map<std::string, const Element*, std::less<>>;
// Reports structural errors, duplicate ids and aliases without a target. Returns the objects that have ids,
// as pointers into `root`.
Ids check_structure(const Element& root, Report& report);

}  // namespace ls::scene
