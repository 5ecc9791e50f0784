#include "coordinator/http/auth/closed_sessions.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>

#include "coordinator/http/auth/token_registry.h"
#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"
#include "core/base/digest.h"
#include "core/base/log.h"
#include "core/base/parse_number.h"
#include "core/base/secret.h"
#include "core/base/spawn.h"

namespace ls::http {
namespace {

// The file is written anew when it has this many lines more than twice what is remembered.
constexpr std::size_t kSlackLines = 1000;
constexpr std::string_view kAllUntil = "*";

std::pair<std::uint64_t, std::uint64_t> state_of(const std::filesystem::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) return {};
  return {static_cast<std::uint64_t>(info.st_ino), static_cast<std::uint64_t>(info.st_size)};
}

}  // namespace

ClosedSessions::ClosedSessions(const std::filesystem::path& folder) {
  const auto state = state_.lock();
  if (!folder.empty()) state->file = folder / "closed-sessions";
  state->look_again();
}

void ClosedSessions::close(std::string_view token_id, std::int64_t expiry, std::string_view text,
                           std::int64_t now) {
  const auto state = state_.lock();
  const FolderLock others(state->file.parent_path());
  state->look_again();
  state->forget_expired(now);
  const std::string id(token_id), digest = sha256(text).hex();
  state->add(id, expiry, digest);
  if (state->file.empty()) return;
  const bool crowded = state->lines > 2 * state->count() + kSlackLines;
  const auto written = crowded || state->tokens[id].refused_until > 0
                           ? state->write_all()
                           : state->append(fmt::format("{} {} {}\n", id, expiry, digest));
  if (!written)
    log_error("", "a closed session would be open again after a restart: " + written.error().message);
}

bool ClosedSessions::contains(std::string_view token_id, std::int64_t expiry, std::string_view text) const {
  const auto state = state_.lock();
  state->look_again();
  const auto found = state->tokens.find(token_id);
  return found != state->tokens.end() && (expiry <= found->second.refused_until ||
                                          found->second.sessions.contains({expiry, sha256(text).hex()}));
}

void ClosedSessions::State::look_again() {
  if (file.empty() || state_of(file) == seen) return;
  seen = state_of(file);
  lines = 0;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) read_line(line);
}

// Lines that are damaged, by a power loss or by hand, are left out.
void ClosedSessions::State::read_line(std::string_view line) {
  ++lines;
  const std::string id(take_part(line, ' '));
  const auto expiry = parse_number<std::int64_t>(take_part(line, ' '));
  if (id.empty() || !expiry) return;
  if (line == kAllUntil) {
    auto& until = tokens[id].refused_until;
    until = std::max(until, *expiry);
  } else if (Digest::parse(line)) {
    add(id, *expiry, std::string(line));
  }
}

void ClosedSessions::State::add(const std::string& token_id, std::int64_t expiry, const std::string& digest) {
  OfToken& token = tokens[token_id];
  token.sessions.emplace(expiry, digest);
  if (token.sessions.size() <= kMaxClosedSessions) return;
  token.refused_until = std::max(token.refused_until, token.sessions.begin()->first);
  token.sessions.erase(token.sessions.begin());
}

void ClosedSessions::State::forget_expired(std::int64_t now) {
  for (auto token = tokens.begin(); token != tokens.end();) {
    auto& [sessions, refused_until] = token->second;
    sessions.erase(sessions.begin(), sessions.lower_bound({now + 1, ""}));
    if (refused_until <= now) refused_until = 0;
    token = sessions.empty() && refused_until == 0 ? tokens.erase(token) : std::next(token);
  }
}

std::size_t ClosedSessions::State::count() const {
  std::size_t sum = 0;
  for (const auto& [id, token] : tokens) sum += token.sessions.size() + 1;
  return sum;
}

Result<void> ClosedSessions::State::append(const std::string& line) {
  const Descriptor out{::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600)};
  if (out.fd < 0 || ::write(out.fd, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    return fail(Errc::unavailable, fmt::format("cannot write '{}': {}", file.string(), std::strerror(errno)));
  ++lines;
  seen = state_of(file);
  return {};
}

Result<void> ClosedSessions::State::write_all() {
  std::string text;
  for (const auto& [id, token] : tokens) {
    if (token.refused_until > 0) text += fmt::format("{} {} {}\n", id, token.refused_until, kAllUntil);
    for (const auto& [expiry, digest] : token.sessions) text += fmt::format("{} {} {}\n", id, expiry, digest);
  }
  auto written = write_private(file, text);
  lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  seen = state_of(file);
  return written;
}

}  // namespace ls::http
