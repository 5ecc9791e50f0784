#include <fmt/format.h>

#include <charconv>

#include "coordinator/views/job_view.h"

namespace ls::coordinator {
namespace {

// Cannot be part of any other id: those are "j-" and hexadecimal digits
constexpr std::string_view kMark = "-frame";

}  // namespace

JobId frame_job(const JobId& sequence, std::uint32_t frame) {
  return {fmt::format("{}{}{}", sequence.value, kMark, frame)};
}

std::optional<FrameId> frame_of(const JobId& job) {
  const std::size_t at = job.value.rfind(kMark);
  if (at == 0 || at == std::string::npos) return std::nullopt;
  const std::string_view digits = std::string_view(job.value).substr(at + kMark.size());
  FrameId id{{job.value.substr(0, at)}, 0};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), id.frame);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  // Only the form that frame_job() writes counts: "-frame07" is no frame.
  if (!whole || id.frame > kMaxFrameNumber || frame_job(id.sequence, id.frame) != job) return std::nullopt;
  return id;
}

}  // namespace ls::coordinator
