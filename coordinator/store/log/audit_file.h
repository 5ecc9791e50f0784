// The file FOLDER/audits, which lists the open audits of one job. An audit lets another worker render a unit
// (one tile in one round of samples) again, to compare the results. Each audit has one line: "TILE ROUND", or
// "TILE ROUND WORKER DIGEST" if that other worker's result differed and a third worker has to decide. The
// file is rewritten with every change, without sync: a power failure may lose some audits, but no result.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/domain/event.h"

namespace ls::coordinator {

std::string audits_text(const std::vector<JobRestored::Audit>& audits);
// Invalid lines are ignored.
std::vector<JobRestored::Audit> parse_audits(std::string_view text);

Result<void> write_audits(const std::filesystem::path& folder, const std::string& text);
// Empty if there is no file
std::vector<JobRestored::Audit> read_audits(const std::filesystem::path& folder);

}  // namespace ls::coordinator
