// The tokens that are known: DATA/token (admin) and DATA/join-token in the clear, all others by their SHA-256
// alone in DATA/tokens, one a line: `ROLE USER SHA256`, USER `-` where there is none. Several coordinators
// may have one folder (--secrets): what one of them writes the others read with the next token that they are
// shown.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "coordinator/http/caller.h"
#include "coordinator/http/token_file.h"

namespace ls::http {

inline constexpr std::size_t kMaxTokens = 1000;
inline constexpr std::size_t kMaxUserName = 64;

// 1 to kMaxUserName of a-z A-Z 0-9 . _ - @, beginning with a letter or digit.
bool plausible_user(std::string_view name);

struct TokenInfo {
  std::string id;  // the first 16 digits of its SHA-256
  Role role = Role::read;
  std::string user;
  bool of_file = false;  // DATA/token or DATA/join-token: not to be revoked but by deleting the file
};

class TokenBook {
 public:
  // In memory. An empty join token: no worker may join by it.
  explicit TokenBook(std::string admin_token, std::string join_token = {});
  // Reads the folder's files; makes `token` and `join-token` where they are missing. failed_precondition: a
  // file that others may write (or, of secrets, read), or a line that is no token: named with its number.
  static Result<std::unique_ptr<TokenBook>> open(const std::filesystem::path& folder);

  // Whose token this is. Takes as long for a wrong one as for a right one.
  std::optional<Caller> find(std::string_view token) const;
  std::optional<Caller> by_id(std::string_view id) const;
  bool may_join(std::string_view token) const;

  struct Made {
    TokenInfo info;
    std::string token;  // said once, kept nowhere
  };
  // invalid_argument: a user name is missing or cannot be one; resource_exhausted: kMaxTokens, or the disk.
  Result<Made> add(Role role, std::string user);
  // not_found; failed_precondition: it is one of the two files.
  Result<void> revoke(std::string_view id);
  std::vector<TokenInfo> list() const;

  // What sessions are signed with: changes with the admin token.
  const std::string& session_key() const { return session_key_; }

 private:
  struct Entry {
    TokenInfo info;
    Digest digest;
  };
  void put(Role role, std::string user, const Digest& digest, bool of_file) const;
  Result<void> read_line(std::string_view line) const;
  Result<void> read_all() const;
  void look_again_locked() const;  // has another coordinator written the file?
  Result<void> save_locked() const;

  std::string session_key_;
  std::filesystem::path file_;  // empty: in memory
  mutable std::mutex mutex_;
  // What the file says, as read last: looking again changes what is known here, not the book.
  mutable FileState seen_;
  mutable std::vector<Entry> entries_;
};

}  // namespace ls::http
