#include "core/scene/schema/light_links.h"

#include <algorithm>
#include <variant>

namespace ls::scene {
namespace {

// Calls f with the LightLinks of each light of the scene: of the shapes, then of the other emitters.
template <class S, class F>
void for_links(S& scene, const F& f) {
  for (auto& shape : scene.shapes)
    if (shape.emitter) f(shape.emitter->links);
  for (auto& emitter : scene.emitters) std::visit([&](auto& light) { f(light.links); }, emitter);
}

std::vector<std::string> sets_of(const std::string& text) {
  return text.empty() ? std::vector<std::string>{} : link_sets(text);
}

template <class T>
auto& link_sets_of(T& medium) {
  return std::visit(
      [](auto& m) -> auto& { return m.link_sets; }, medium);
}

}  // namespace

LinkLists::LinkLists(const Scene& scene) {
  for_links(scene, [&](const LightLinks& links) { add(links); });
}

void LinkLists::add(const LightLinks& links) {
  for (const std::string* text : {&links.receivers, &links.blockers}) {
    if (text->empty()) continue;
    LinkList list = link_list(*text);
    if (std::ranges::find(lists_, list) != lists_.end()) continue;
    if (lists_.size() == kMostLinkLists)
      too_many_ = true;
    else
      lists_.push_back(std::move(list));
  }
  if (const LinkIndex i = index(links.blockers); i != kEverything) blockers_ |= LinkMask{1} << i;
}

LinkIndex LinkLists::index(const std::string& text) const {
  if (text.empty()) return kEverything;
  const auto at = std::ranges::find(lists_, link_list(text));
  return at == lists_.end() ? kEverything : static_cast<LinkIndex>(at - lists_.begin());
}

LinkMask LinkLists::having(const std::string& link_sets) const {
  if (lists_.empty()) return 0;
  if (const auto known = known_.find(link_sets); known != known_.end()) return known->second;
  const std::vector<std::string> sets = sets_of(link_sets);
  LinkMask mask = 0;
  for (std::size_t i = 0; i < lists_.size(); ++i)
    if (lists_[i].has(sets)) mask |= LinkMask{1} << i;
  known_.emplace(link_sets, mask);
  return mask;
}

std::uint32_t linked_lights(const Scene& scene) {
  std::uint32_t count = 0;
  for_links(scene, [&](const LightLinks& links) { count += links != LightLinks{}; });
  return count;
}

std::uint32_t drop_idle_links(Scene& scene) {
  const LinkLists lists(scene);
  if (!lists.any() || lists.too_many()) return 0;
  // The lists that have all receivers, and those that have all blockers. Light passes null surfaces anyhow.
  LinkMask all_receive = ~LinkMask{0}, all_block = ~LinkMask{0};
  for (const Shape& s : scene.shapes) {
    if (std::holds_alternative<NullBsdf>(scene.bsdfs[s.bsdf.value])) continue;
    const LinkMask mask = lists.having(s.link_sets);
    all_receive &= mask;
    all_block &= mask;
  }
  for (const Medium& m : scene.media) all_receive &= lists.having(link_sets_of(m));
  // Meters are in no set.
  if (!scene.meters.empty()) all_receive &= lists.having("");
  std::uint32_t dropped = 0;
  const auto drop = [&](std::string& list, LinkMask idle) {
    if (list.empty() || !linked(lists.index(list), idle)) return;
    list.clear();
    ++dropped;
  };
  for_links(scene, [&](LightLinks& links) {
    drop(links.receivers, all_receive);
    drop(links.blockers, all_block);
  });
  if (linked_lights(scene) > 0) return dropped;
  for (Shape& s : scene.shapes) s.link_sets.clear();
  for (Medium& m : scene.media) link_sets_of(m).clear();
  return dropped;
}

}  // namespace ls::scene
