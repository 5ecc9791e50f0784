// The file FOLDER/audits, which lists the open audits of one job. In an audit another worker renders a unit
// again, and the results are compared. Each audit has one line: "TILE ROUND", or "TILE ROUND WORKER DIGEST"
// (worker and digest of the second result) if the second result differed and a third worker has to decide.
// The file is rewritten with every change, without sync: a power failure may lose some audits, but no result.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/domain/event.h"

namespace ls::coordinator {

std::string audits_text(const std::vector<JobRestored::Audit>& audits);
// Reads audits from the text of the file; ignores invalid lines.
std::vector<JobRestored::Audit> parse_audits(std::string_view text);

Result<void> write_audits(const std::filesystem::path& folder, const std::string& text);
// Reads the file in `folder`. Returns an empty list if there is no file.
std::vector<JobRestored::Audit> read_audits(const std::filesystem::path& folder);

}  // namespace ls::coordinator
