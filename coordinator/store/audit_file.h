// The audits under way of one job, FOLDER/audits: a line each, "TILE ROUND", or "TILE ROUND WORKER DIGEST"
// where another worker's result differs and a third has to decide. Written anew with every change; not
// synced, so that a power failure may lose some audits (no result).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/domain/event.h"

namespace ls::coordinator {

std::string audits_text(const std::vector<JobRestored::Audit>& audits);
// Lines that are none are passed over.
std::vector<JobRestored::Audit> parse_audits(std::string_view text);

Result<void> write_audits(const std::filesystem::path& folder, const std::string& text);
std::vector<JobRestored::Audit> read_audits(
    const std::filesystem::path& folder);  // none where there is no file

}  // namespace ls::coordinator
