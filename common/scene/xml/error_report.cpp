#include "common/scene/xml/error_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/scene/limits.h"

namespace ls::scene {

const std::size_t Report::kMax = kMaxDiagnostics;

std::uint32_t Report::add_file(SourceText file) {
  files_.push_back(std::move(file));
  return static_cast<std::uint32_t>(files_.size() - 1);
}

void Report::error(const Span& at, std::string text) {
  add(Diagnostic::Severity::error, at, std::move(text));
}

void Report::warning(const Span& at, std::string text) {
  add(strict_ ? Diagnostic::Severity::error : Diagnostic::Severity::warning, at, std::move(text));
}

void Report::add(Diagnostic::Severity severity, const Span& at, std::string text) {
  // Errors and warnings are counted separately, so that warnings never displace an error. take() applies the
  // common limit.
  std::size_t& count = severity == Diagnostic::Severity::error ? errors_ : warnings_;
  if (count++ >= kMax) return;
  Diagnostic d = files_[at.file].diagnose(severity, at.offset, at.length, std::move(text));
  if (std::find(found_.begin(), found_.end(), d) == found_.end()) found_.push_back(std::move(d));
}

std::string Report::refer_to(const Span& there, const Span& here) const {
  const SourceText& file = files_[there.file];
  const int line = file.line(there.offset);
  return there.file == here.file ? fmt::format("line {}", line)
                                 : fmt::format("{}, line {}", file.name(), line);
}

std::vector<Diagnostic> Report::take() {
  if (found_.size() > kMax) {
    std::stable_partition(found_.begin(), found_.end(),
                          [](const Diagnostic& d) { return d.severity == Diagnostic::Severity::error; });
    found_.resize(kMax);
  }
  return std::exchange(found_, {});
}

}  // namespace ls::scene
