// All valid tokens. They are in files of one folder, here called DATA: that of --secrets or else of --data.
// DATA/token (the administrator's) and DATA/join-token (the workers') contain their tokens in the clear. For
// all other tokens DATA/tokens contains only the SHA-256, one per line: `ROLE USER SHA256`, with USER `-` if
// the token has no user. Several coordinators may share the folder: before a coordinator checks a token, it
// rereads DATA/tokens if that file has changed.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/base/guarded.h"
#include "coordinator/http/auth/token_file.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

inline constexpr std::size_t kMaxTokens = 1000;
inline constexpr std::size_t kMaxUserName = 64;

// True for 1 to kMaxUserName characters a-z A-Z 0-9 . _ - @, beginning with a letter or digit.
bool plausible_user(std::string_view name);

struct TokenInfo {
  std::string id;  // the first 16 hex digits of its SHA-256
  Role role = Role::read;
  std::string user;
  // True if the token is in DATA/token or DATA/join-token. Such a token is revoked only by deleting the file
  // and restarting the coordinator.
  bool of_file = false;
};

class TokenRegistry {
 public:
  // Makes a registry without files. If `join_token` is empty, no token lets a worker join.
  explicit TokenRegistry(std::string admin_token, std::string join_token = {});
  // Reads the folder's files; creates `token` and `join-token` if they are missing. failed_precondition:
  // other users may write `tokens`, or may read or write one of the other two; or a line of `tokens` is
  // invalid, and the message has its number.
  static Result<std::unique_ptr<TokenRegistry>> open(const std::filesystem::path& folder);

  // Returns the caller with this token; nullopt: the token is wrong. The search takes equally long in both
  // cases.
  std::optional<Caller> find(std::string_view token) const;
  std::optional<Caller> by_id(std::string_view id) const;
  bool may_join(std::string_view token) const;

  struct Made {
    TokenInfo info;
    std::string token;  // the token itself; shown once, stored nowhere
  };
  // Makes a token and stores its SHA-256. invalid_argument: the user name is missing or invalid.
  // resource_exhausted: there are kMaxTokens already, or the disk is full.
  Result<Made> add(Role role, std::string user);
  // Makes the token with this id invalid. not_found: there is no such token. failed_precondition: it is the
  // token in DATA/token or DATA/join-token.
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
  // The tokens of the files, as last read.
  struct Tokens {
    void put(Role role, std::string user, const Digest& digest, bool of_file);
    // Rereads the file if it has changed or could not be read the last time. On an error (the file cannot be
    // read, or has an invalid line) `entries` stays as it is, and the error is logged once.
    Result<void> look_again();
    Result<void> read_all();
    Result<void> read_line(std::string_view line);
    Result<void> save();

    std::filesystem::path file;  // empty: the tokens are in memory only
    FileState seen;
    std::string trouble;  // the error of the last reading; empty: none
    std::vector<Entry> entries;
  };
  Guarded<Tokens>::Lock latest() const;

  std::string session_key_;
  mutable Guarded<Tokens> tokens_;  // mutable, since const functions reread the file
};

}  // namespace ls::http
