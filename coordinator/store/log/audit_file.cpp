#include "coordinator/store/log/audit_file.h"

#include <fmt/format.h>

#include <sstream>

#include "coordinator/store/files.h"
#include "util/protocol/limits.h"

namespace ls::coordinator {
namespace {
constexpr std::uint64_t kMostBytes = 1 << 20;
constexpr const char* kName = "audits";
}  // namespace

std::string audits_text(const std::vector<JobRestored::Audit>& audits) {
  std::string text;
  for (const JobRestored::Audit& audit : audits) {
    text += fmt::format("{} {}", audit.tile, audit.round);
    if (audit.second) text += fmt::format(" {} {}", audit.second->first.value, audit.second->second.hex());
    text += '\n';
  }
  return text;
}

std::vector<JobRestored::Audit> parse_audits(std::string_view text) {
  std::vector<JobRestored::Audit> audits;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    JobRestored::Audit audit;
    if (!(words >> audit.tile >> audit.round)) continue;
    std::string worker, hex, more;
    if (words >> worker) {
      const auto digest = words >> hex && !(words >> more) ? Digest::parse(hex) : std::nullopt;
      if (!digest || worker.size() > ls::limits::kIdBytes) continue;
      audit.second = {{worker}, *digest};
    }
    audits.push_back(std::move(audit));
  }
  return audits;
}

Result<void> write_audits(const std::filesystem::path& folder, const std::string& text) {
  if (auto made = make_folder(folder); !made) return made;
  auto file = AtomicFile::create(folder / kName);
  if (!file) return tl::unexpected(file.error());
  if (auto written = file->write(std::as_bytes(std::span(text))); !written) return written;
  return file->commit_unsynced();
}

std::vector<JobRestored::Audit> read_audits(const std::filesystem::path& folder) {
  const auto bytes = read_file(folder / kName, kMostBytes);
  if (!bytes) return {};
  return parse_audits({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
}

}  // namespace ls::coordinator
