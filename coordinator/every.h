// What a thread does again and again until it is to stop: the first time after a pause.
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
