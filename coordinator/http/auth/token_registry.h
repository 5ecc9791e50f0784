// All known tokens. The files DATA/token (the administrator's) and DATA/join-token (the workers') hold their
// tokens in the clear. Of all other tokens DATA/tokens holds only the SHA-256, one per line: `ROLE USER
// SHA256`, with USER `-` if there is none. Several coordinators may share one folder (--secrets): each
// rereads the file, if another one has changed it, before it checks a token.
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
  // The token is in DATA/token or DATA/join-token and is revoked only by deleting that file.
  bool of_file = false;
};

class TokenRegistry {
 public:
  // Makes a registry without files. If `join_token` is empty, no token lets a worker join.
  explicit TokenRegistry(std::string admin_token, std::string join_token = {});
  // Reads the folder's files; creates `token` and `join-token` if they are missing. failed_precondition: a
  // file that others may write (or, for secrets, read), or an invalid line, named with its number.
  static Result<std::unique_ptr<TokenRegistry>> open(const std::filesystem::path& folder);

  // Returns the caller with this token, or nullopt for a wrong token. Takes equally long for both.
  std::optional<Caller> find(std::string_view token) const;
  std::optional<Caller> by_id(std::string_view id) const;
  bool may_join(std::string_view token) const;

  struct Made {
    TokenInfo info;
    std::string token;  // shown once, stored nowhere
  };
  // Makes a token and stores its SHA-256. invalid_argument: the user name is missing or invalid.
  // resource_exhausted: there are kMaxTokens already, or the disk is full.
  Result<Made> add(Role role, std::string user);
  // Makes the token with this id invalid. not_found: there is none. failed_precondition: the token is that of
  // DATA/token or DATA/join-token.
  Result<void> revoke(std::string_view id);
  std::vector<TokenInfo> list() const;

  // Returns the key with which session cookies are signed. It is derived from the admin token, so that a new
  // admin token ends all sessions.
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
