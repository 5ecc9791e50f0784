// every() calls act() once per `pause` until a stop is requested through `token`. The first call comes after
// one pause. It blocks its thread.
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
