#include "coordinator/service/state/worker_entry.h"

#include "coordinator/base/limits.h"
#include "core/base/safe_text.h"

namespace ls::coordinator {

void WorkerEntry::note(std::string_view text) {
  if (log.size() >= limits::kWorkerLogLines) log.erase(log.begin());
  log.push_back({system_unix_seconds(), plain_text(text.substr(0, limits::kWorkerLogBytes))});
}

}  // namespace ls::coordinator
