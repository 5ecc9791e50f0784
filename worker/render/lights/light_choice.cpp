// The choice of a light: by the table of all lights or, if the shaded point is known, also by the tree or by
// the learned probabilities of its place. Each maps a word, a random integer of 32 bits, to a light.
#include <algorithm>
#include <cmath>

#include "worker/render/lights/light_table.h"
#include "worker/render/lights/lights.h"

namespace ls::render {
namespace {

// The smallest number of lights with a position for which the tree is used
// (docs/decisions/0008-many-lights.md). With fewer, the table is used alone.
constexpr std::ptrdiff_t kTreeFrom = 32;
// Of the words that choose lights in the tree, every kTableShare-th uses the table instead. So no light gets
// less than 1/16 of its probability in the table.
constexpr std::uint64_t kTableShare = 16;

}  // namespace

bool Lights::enough_for_tree() const {
  return std::count_if(lights_.begin(), lights_.end(), has_place) >= kTreeFrom;
}

// Moves the lights with a position to the front of the list, where build_tree() expects them, unless they are
// too few for a tree. Area lights have a position and are already first, so their order does not change.
void Lights::sort_places_first() {
  if (!enough_for_tree()) return;
  std::stable_partition(lights_.begin(), lights_.end(), has_place);
}

void Lights::build_tree() {
  std::vector<LightBounds> all;
  for (const Light& light : lights_) {
    if (!has_place(light)) break;
    LightBounds b = with_kind(light.kind, [&](const auto& l) -> LightBounds {
      if constexpr (std::decay_t<decltype(l)>::kHasPlace)
        return l.bounds(world());
      else
        __builtin_unreachable();
    });
    b.intensity = std::isfinite(b.intensity) ? std::clamp(b.intensity, 1e-30, 1e30) : 1e30;
    all.push_back(b);
  }
  if (static_cast<std::ptrdiff_t>(all.size()) < kTreeFrom || all.size() > LightTree::kMaxLights) return;
  tree_ = LightTree::build(all);
  tree_words_ = std::uint64_t{last_[all.size() - 1]} + 1;
  table_words_ = (tree_words_ + kTableShare - 1) / kTableShare;
}

// The probability of each of the n lights is half its share of the power plus half of 1/n, so none is below
// 1/(2n). Probabilities are exact shares of the 2^32 random words.
void Lights::set_probabilities() {
  last_.clear();
  suns_.clear();
  any_with_place_ = false;
  std::vector<double> p;
  double sum = 0;
  for (const Light& l : lights_) sum += p.emplace_back(std::max(0., power(l)));
  alone_ = p.size() == 1;
  const double uniform = .5 / static_cast<double>(p.size());
  for (double& x : p) x = (sum > 0 && std::isfinite(sum) ? .5 * x / sum : uniform) + uniform;
  append_light_table(p, last_);
  for (std::size_t i = 0; i < p.size(); ++i) {
    lights_[i].probability = probability_in_table(last_, static_cast<std::uint32_t>(i));
    any_with_place_ = any_with_place_ || has_place(lights_[i]);
    if (std::holds_alternative<SunLight>(lights_[i].kind)) suns_.push_back(static_cast<std::uint32_t>(i));
    if (std::holds_alternative<SkyLight>(lights_[i].kind)) sky_index_ = static_cast<std::uint32_t>(i);
  }
}

double Lights::spread_over(const LightVisits& visits) const {
  double sum = 0;
  for (std::size_t i = 0; i < visits.values.size(); ++i) {
    const double v = double{visits.values[i]};
    sum += v * v / double{lights_[i % lights_.size()].probability};
  }
  return visits.places.empty() ? 0 : sum / static_cast<double>(visits.places.size());
}

void Lights::set_local(const LightVisits* visits) {
  local_ = nullptr;
  if (!visits) return;
  std::vector<double> table;
  for (const Light& light : lights_) table.push_back(double{light.probability});
  local_ = std::make_unique<const LocalLights>(*visits, table);
}

std::uint64_t Lights::table_bytes() const {
  std::uint64_t n = lights_.size() * sizeof(Light) + last_.size() * sizeof(last_[0]);
  if (local_) n += local_->bytes();
  for (const Light& light : lights_)
    n += with_kind(light.kind, [](const auto& l) { return l.extra_bytes(); });
  return n;
}

DrawnLight Lights::by_table(std::uint32_t word) const {
  const std::uint32_t i = light_of_word(last_, word);
  return {i, lights_[i].probability};
}

// Returns how many of the words below table_words_ choose light i. These words choose by the table: word w is
// mapped to the table's word kTableShare * w.
std::uint64_t Lights::table_words(std::uint32_t i) const {
  const std::uint64_t first = i == 0 ? 0 : std::uint64_t{last_[i - 1]} + 1, end = std::uint64_t{last_[i]} + 1;
  return (end + kTableShare - 1) / kTableShare - (first + kTableShare - 1) / kTableShare;
}

DrawnLight Lights::draw(std::uint32_t word, const LightPlace& place) const {
  if (by_place(place)) return local_->draw(word, place.p, place.n);
  return by_tree(place) ? from_tree(word, place) : by_table(word);
}

DrawnLight Lights::from_tree(std::uint32_t word, const LightPlace& place) const {
  if (word >= tree_words_) return draw(word);
  const std::uint64_t words = tree_words_ - table_words_;
  if (word >= table_words_) {
    const LightTree::Found found = tree_.find(word - table_words_, words, place.p, place.n);
    return {found.light, probability_of_words(found.words + table_words(found.light))};
  }
  const std::uint32_t i = draw(static_cast<std::uint32_t>(word * kTableShare)).light;
  return {i, probability_of_words(tree_.words_of(i, words, place.p, place.n) + table_words(i))};
}

float Lights::probability_at(std::uint32_t i, const LightPlace& place) const {
  if (by_place(place)) return local_->probability(i, place.p, place.n);
  if (!by_tree(place) || !has_place(lights_[i])) return lights_[i].probability;
  return probability_of_words(tree_.words_of(i, tree_words_ - table_words_, place.p, place.n) +
                              table_words(i));
}

}  // namespace ls::render
