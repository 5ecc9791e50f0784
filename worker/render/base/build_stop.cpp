#include "worker/render/base/build_stop.h"

namespace ls::render {
namespace {

thread_local const std::atomic<bool>* t_stop = nullptr;

}  // namespace

BuildStop::BuildStop(const std::atomic<bool>& stop) { t_stop = &stop; }
BuildStop::~BuildStop() { t_stop = nullptr; }

const std::atomic<bool>* BuildStop::flag() { return t_stop; }

Result<void> BuildStop::go_on() {
  if (t_stop && *t_stop) return fail(Errc::unavailable, "told to stop building the world");
  return {};
}

}  // namespace ls::render
