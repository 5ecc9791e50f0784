// Sessions that were closed before they expired. They are kept in a file beside the tokens, so that they stay
// closed after a restart and at every coordinator that has the same folder of secrets.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/guarded.h"

namespace ls::http {

// Thread-safe. The file has a line `TOKEN-ID EXPIRY SHA256` for each session, with the time when it expires
// (in seconds since 1970) and the SHA-256 of its text; or `TOKEN-ID EXPIRY *`, which stands for all sessions
// of the token that do not expire later.
class ClosedSessions {
 public:
  // `folder` empty: the sessions are remembered in memory only.
  explicit ClosedSessions(const std::filesystem::path& folder);

  // Remembers a session until it expires. For each token at most kMaxClosedSessions are remembered: beyond
  // that, the one that expires first is forgotten, and all of the token's sessions that do not expire later
  // than it count as closed, so that no closed session becomes valid again. If the file cannot be written,
  // the session is closed for this process alone, and the reason is logged.
  void close(std::string_view token_id, std::int64_t expiry, std::string_view text, std::int64_t now);
  bool contains(std::string_view token_id, std::int64_t expiry, std::string_view text) const;

 private:
  struct OfToken {
    std::set<std::pair<std::int64_t, std::string>> sessions;  // expiry and SHA-256 of the text
    std::int64_t refused_until = 0;
  };
  struct State {
    void look_again();  // reads the file if it has changed
    void read_line(std::string_view line);
    void add(const std::string& token_id, std::int64_t expiry, const std::string& digest);
    void forget_expired(std::int64_t now);
    std::size_t count() const;
    Result<void> append(const std::string& line);
    Result<void> write_all();

    std::filesystem::path file;                    // empty: in memory only
    std::pair<std::uint64_t, std::uint64_t> seen;  // inode and size of the file when it was last read
    std::size_t lines = 0;                         // of the file
    std::map<std::string, OfToken, std::less<>> tokens;
  };
  mutable Guarded<State> state_;  // mutable, since contains() reads the file again
};

}  // namespace ls::http
