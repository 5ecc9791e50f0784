// Which elements there are, what attributes they have, what may stand in what. Checked for a whole document
// before anything in it is interpreted, so that the readers of objects can rely on it.
#pragma once

#include <map>
#include <string>

#include "common/scene/document.h"

namespace ls::scene {

enum class TagKind { object, property, transform, step, reference, alias, unknown };

TagKind kind_of(const Element& e);  // a <spectrum type="..."> is an object

using Ids = std::map<std::string, const Element*, std::less<>>;
// Reports what doesn't fit, duplicate ids and aliases of nothing; returns the objects that have ids. Points
// into `root`.
Ids check_structure(const Element& root, Report& report);

}  // namespace ls::scene
