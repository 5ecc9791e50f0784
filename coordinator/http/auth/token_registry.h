// All valid tokens. They are in files of one folder, here called DATA: the folder of the option --secrets or,
// if that is not given, of --data. DATA/token (the administrator's) and DATA/join-token (the workers')
// contain their tokens in the clear. For all other tokens DATA/tokens contains only the SHA-256, one per
// line: `ROLE USER SHA256`, with USER `-` if the token has no user. Several coordinators may share the
// folder: before a coordinator checks a token, it rereads DATA/tokens if that file has changed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/http/message/message.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/guarded.h"
#include "core/base/spawn.h"

namespace ls::http {

// Returns the secret (a token, or the key that signs webhooks) in `file`; creates the file (mode 0600) with a
// new secret if it does not exist. Rejects a file that others may read, or with fewer than 16 characters. The
// caller must hold the data folder's lock, so that two coordinators that start at the same time do not both
// create the file.
Result<std::string> read_or_make_token(const std::filesystem::path& file);

// Returns 256 random bits in hexadecimal.
Result<std::string> random_token();

// Holds a lock on a folder while the object lives, so that other processes do not change the folder's secrets
// meanwhile. The constructor blocks until it has the lock. If the folder is read-only, so that no lock file
// can be created, no lock is needed or held. An empty path locks nothing.
class FolderLock {
 public:
  explicit FolderLock(const std::filesystem::path& folder);

 private:
  Descriptor file_;
};

inline constexpr std::size_t kMaxTokens = 1000;
inline constexpr std::size_t kMaxUserName = 64;

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

  // The folder of the files; empty: the tokens are in memory only
  const std::filesystem::path& folder() const { return folder_; }
  // Returns the key with which session cookies are signed. It is derived from the admin token, so that a new
  // admin token ends all sessions.
  const std::string& session_key() const { return session_key_; }

 private:
  struct Entry {
    TokenInfo info;
    Digest digest;
  };
  // Identifies a version of a file: if two states differ, the file was replaced or written in between. All
  // zero: there is no file.
  struct FileState {
    std::uint64_t inode = 0, size = 0;
    std::int64_t changed_ns = 0;
    bool operator==(const FileState&) const = default;
  };
  static FileState file_state(const std::filesystem::path& file);
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
    std::string trouble;  // the error message of the latest reading; empty: it succeeded
    std::vector<Entry> entries;
  };
  Guarded<Tokens>::Lock latest() const;

  std::string session_key_;
  std::filesystem::path folder_;
  mutable Guarded<Tokens> tokens_;  // mutable, since const functions reread the file
};

}  // namespace ls::http
