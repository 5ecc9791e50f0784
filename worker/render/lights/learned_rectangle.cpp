#include "worker/render/lights/learned_rectangle.h"

#include <algorithm>
#include <cmath>

namespace ls::render {
namespace {

// The part of the density's integral that is spread uniformly over the rectangle.
constexpr double kRectangleShare = .2;

}  // namespace

void LearnedRectangle::learn(V2 at, float weight) {
  if (weight > 0 && std::isfinite(weight)) found_.push_back({at, weight});
}

void LearnedRectangle::add(const LearnedRectangle& other) {
  found_.insert(found_.end(), other.found_.begin(), other.found_.end());
}

std::size_t LearnedRectangle::cell_of(V2 at) const {
  const auto index = [side = static_cast<float>(side_)](float x, float lo, float hi) {
    return static_cast<std::size_t>(std::clamp((x - lo) / (hi - lo) * side, 0.f, side - 1.f));
  };
  return index(at.x, lo_.x, hi_.x) * side_ + index(at.y, lo_.y, hi_.y);
}

float LearnedRectangle::density(V2 at) const {
  const bool inside = at.x >= lo_.x && at.x < hi_.x && at.y >= lo_.y && at.y < hi_.y;
  return inside ? density_[cell_of(at)] : 0;
}

void LearnedRectangle::finish(float margin, double outside_share) {
  if (found_.empty()) return;
  lo_ = hi_ = found_.front().at;
  for (const Found& f : found_) {
    lo_ = {std::min(lo_.x, f.at.x), std::min(lo_.y, f.at.y)};
    hi_ = {std::max(hi_.x, f.at.x), std::max(hi_.y, f.at.y)};
  }
  const V2 around = (hi_ - lo_) * (1 / static_cast<float>(side_)) + V2(margin);
  lo_ -= around;
  hi_ += around;
  const std::size_t n = side_ * side_;
  std::vector<double> weight(n, 0.);
  double sum = 0;
  for (const Found& f : found_) {
    weight[cell_of(f.at)] += double{f.weight};
    sum += double{f.weight};
  }
  const double cell = double{hi_.x - lo_.x} * double{hi_.y - lo_.y} / static_cast<double>(n);
  last_.resize(n);
  density_.resize(n);
  double up_to = 0;
  std::uint64_t words = 0;
  for (std::size_t i = 0; i < n; ++i) {
    up_to +=
        (1 - kRectangleShare - outside_share) * weight[i] / sum + kRectangleShare / static_cast<double>(n);
    const bool to_the_end = i + 1 == n && outside_share == 0;
    const auto end = static_cast<std::uint64_t>(std::ldexp(to_the_end ? 1. : up_to, 32));
    last_[i] = static_cast<std::uint32_t>(end - 1);
    density_[i] = static_cast<float>(std::ldexp(static_cast<double>(end - words), -32) / cell);
    words = end;
  }
  outside_share_ = std::ldexp(static_cast<double>((std::uint64_t{1} << 32) - words), -32);
  found_ = {};
}

// Returns the index of the cell that `word` chooses, or side * side if it chooses none.
std::size_t LearnedRectangle::chosen(std::uint32_t word) const {
  return static_cast<std::size_t>(std::lower_bound(last_.begin(), last_.end(), word) - last_.begin());
}

V2 LearnedRectangle::in_cell(std::size_t cell, V2 u) const {
  const V2 corner(static_cast<float>(cell / side_), static_cast<float>(cell % side_));
  return lo_ + (corner + u) * (hi_ - lo_) * (1 / static_cast<float>(side_));
}

std::optional<V2> LearnedRectangle::sample(std::uint32_t word, V2 u) const {
  const std::size_t cell = chosen(word);
  if (cell == last_.size()) return std::nullopt;
  return in_cell(cell, u);
}

std::optional<V2> LearnedRectangle::sample(std::uint32_t word, float v) const {
  const std::size_t cell = chosen(word);
  if (cell == last_.size()) return std::nullopt;
  const std::uint32_t first = cell > 0 ? last_[cell - 1] + 1 : 0;
  const double u = (double{word - first} + .5) / (double{last_[cell] - first} + 1);
  return in_cell(cell, {std::min(static_cast<float>(u), kBelowOne), v});
}

}  // namespace ls::render
