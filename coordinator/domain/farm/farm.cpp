#include "coordinator/domain/farm/farm.h"

#include <algorithm>

#include "coordinator/domain/farm/farm_state.h"

namespace ls::coordinator {

Farm::Farm() : Farm(Options{}) {}
Farm::Farm(Options options) : state_(std::make_unique<State>(std::move(options))) {}
Farm::~Farm() = default;
Farm::Farm(Farm&&) noexcept = default;
Farm& Farm::operator=(Farm&&) noexcept = default;

std::vector<Effect> Farm::handle(const Event& event, TimePoint now) {
  State& state = *state_;
  state.now = std::max(state.now, now);
  state.work_appeared = false;
  state.dirty.clear();
  state.effects.clear();
  std::visit([&](const auto& e) { state.on(e); }, event);
  state.dispatch();
  return std::move(state.effects);
}

}  // namespace ls::coordinator
