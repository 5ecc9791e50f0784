// All known tokens: DATA/token (admin) and DATA/join-token in the clear, all others only as SHA-256 in
// DATA/tokens, one per line: `ROLE USER SHA256`, with USER `-` if there is none. Several coordinators may
// share one folder (--secrets): each reads what another has written when it next checks a token.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "coordinator/http/auth/token_file.h"
#include "coordinator/http/message/caller.h"

namespace ls::http {

inline constexpr std::size_t kMaxTokens = 1000;
inline constexpr std::size_t kMaxUserName = 64;

// True for 1 to kMaxUserName characters a-z A-Z 0-9 . _ - @, beginning with a letter or digit.
bool plausible_user(std::string_view name);

struct TokenInfo {
  std::string id;  // the first 16 hex digits of its SHA-256
  Role role = Role::read;
  std::string user;
  bool of_file = false;  // DATA/token or DATA/join-token: revoked only by deleting the file
};

class TokenRegistry {
 public:
  // In memory. With an empty join token no worker can join by it.
  explicit TokenRegistry(std::string admin_token, std::string join_token = {});
  // Reads the folder's files; creates `token` and `join-token` if they are missing. failed_precondition: a
  // file that others may write (or, for secrets, read), or an invalid line, named with its number.
  static Result<std::unique_ptr<TokenRegistry>> open(const std::filesystem::path& folder);

  // The caller with this token, or nullopt. Takes equally long for wrong and right tokens.
  std::optional<Caller> find(std::string_view token) const;
  std::optional<Caller> by_id(std::string_view id) const;
  bool may_join(std::string_view token) const;

  struct Made {
    TokenInfo info;
    std::string token;  // shown once, stored nowhere
  };
  // invalid_argument: the user name is missing or invalid; resource_exhausted: kMaxTokens, or the disk is
  // full.
  Result<Made> add(Role role, std::string user);
  // not_found; failed_precondition: the token is one of the two files.
  Result<void> revoke(std::string_view id);
  std::vector<TokenInfo> list() const;

  // The key for signing sessions; changes with the admin token.
  const std::string& session_key() const { return session_key_; }

 private:
  struct Entry {
    TokenInfo info;
    Digest digest;
  };
  void put(Role role, std::string user, const Digest& digest, bool of_file) const;
  Result<void> read_line(std::string_view line) const;
  Result<void> read_all() const;
  void look_again_locked() const;  // rereads the file if another coordinator has written it
  Result<void> save_locked() const;

  std::string session_key_;
  std::filesystem::path file_;  // empty: in memory only
  mutable std::mutex mutex_;
  // Cached contents of the file; mutable, since rereading it does not change the registry logically.
  mutable FileState seen_;
  mutable std::vector<Entry> entries_;
};

}  // namespace ls::http
