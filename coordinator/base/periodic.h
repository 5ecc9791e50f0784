// Calls act() every `pause` until a stop is requested; the first call comes after one pause.
#pragma once

#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "common/base/clock.h"

namespace ls::coordinator {

template <class Act>
void every(Duration pause, const std::stop_token& token, Act&& act) {
  std::mutex mutex;
  std::condition_variable_any woken;
  std::unique_lock lock(mutex);
  while (!woken.wait_for(lock, token, pause, [&] { return token.stop_requested(); }) &&
         !token.stop_requested())
    act();
}

}  // namespace ls::coordinator
