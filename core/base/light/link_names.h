// The names of link sets. A link set is a set of shapes and media; a light is linked to the sets that receive
// its light and to the sets that shade it. A list of names is a text, in which commas separate the names.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ls {

// Most names of a list, and bytes of a name.
inline constexpr std::size_t kMostLinkNames = 64, kMostLinkNameBytes = 63;
// The set that nothing is in.
inline constexpr std::string_view kNoLinkSet = "none";

// A choice of sets: an object is in it if it is in none of the sets `without` and, unless `with` is empty, in
// one of the sets `with`. The names are sorted, each of them once.
struct LinkList {
  std::vector<std::string> with, without;

  bool operator==(const LinkList&) const = default;
  // True if it has every object.
  bool everything() const { return with.empty() && without.empty(); }
  // True if it has an object that is in these sets.
  bool has(const std::vector<std::string>& sets) const;
};

// Each of the two returns why the text is no such list, or an empty text. A name has ASCII letters, digits,
// '_' and '-', and does not begin with '-'. wrong_link_sets() is for the sets of an object, which is not in
// kNoLinkSet; wrong_link_list() for lists in which a '-' before a name makes it one of `without`.
std::string wrong_link_sets(std::string_view text);
std::string wrong_link_list(std::string_view text);

// Both expect a text for which wrong_link_sets() or wrong_link_list() returns an empty text.
std::vector<std::string> link_sets(std::string_view text);
LinkList link_list(std::string_view text);

}  // namespace ls
