// Light linking: which shapes and media receive the light of which lights, and which shapes shade it
// (LightLinks in scene_shapes.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "core/base/light/link_names.h"
#include "core/scene/scene.h"

namespace ls::scene {

// A set of lists of link sets: bit i is for list i. The lights of a scene have at most kMostLinkLists
// different lists, not counting the list of everything, kEverything.
using LinkMask = std::uint64_t;
using LinkIndex = std::uint8_t;
inline constexpr std::size_t kMostLinkLists = std::numeric_limits<LinkMask>::digits;
inline constexpr LinkIndex kEverything = std::numeric_limits<LinkIndex>::max();

// True if the list of this index has the objects that are in the lists of the mask.
constexpr bool linked(LinkIndex list, LinkMask of_object) {
  return list == kEverything || ((of_object >> list) & 1) != 0;
}

// The different lists of a scene's lights, numbered in the order of the lights: first those with a shape. Of
// a scene with more than kMostLinkLists lists it has the first ones, and too_many() is true.
class LinkLists {
 public:
  explicit LinkLists(const Scene& scene);
  bool any() const { return !lists_.empty(); }
  bool too_many() const { return too_many_; }
  // The number of a light's list, given as in LightLinks.
  LinkIndex index(const std::string& list) const;
  // The lists that have a shape or a medium with these link_sets.
  LinkMask having(const std::string& link_sets) const;
  // The lists of blockers of the scene's lights.
  LinkMask blockers() const { return blockers_; }

 private:
  void add(const LightLinks& links);

  std::vector<LinkList> lists_;
  LinkMask blockers_ = 0;
  bool too_many_ = false;
  mutable std::unordered_map<std::string, LinkMask> known_;  // what having() has returned: texts repeat
};

// Returns the number of lights that are linked to receivers or blockers.
std::uint32_t linked_lights(const Scene& scene);

// Removes lists that have all shapes and media of the scene that they could leave out, and the link sets of
// all objects if no list is left. Returns the number of removed lists.
std::uint32_t drop_idle_links(Scene& scene);

}  // namespace ls::scene
