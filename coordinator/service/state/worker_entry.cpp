#include "coordinator/service/state/worker_entry.h"

#include <algorithm>

#include "coordinator/base/limits.h"
#include "core/base/safe_text.h"

namespace ls::coordinator {

void WorkerEntry::note(std::string_view text) {
  if (log.size() >= limits::kWorkerLogLines) log.erase(log.begin());
  // A text that is too long ends before the character (UTF-8) in which the limit lies
  const auto within_character = [&](std::size_t at) {
    return at < text.size() && (static_cast<unsigned char>(text[at]) & 0xc0) == 0x80;
  };
  std::size_t end = std::min(text.size(), limits::kWorkerLogBytes);
  while (end > 0 && within_character(end)) --end;
  log.push_back({system_unix_seconds(), plain_text(text.substr(0, end))});
}

}  // namespace ls::coordinator
