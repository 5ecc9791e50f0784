#include "coordinator/http/auth/token_registry.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/rand.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/check.h"
#include "core/base/log.h"
#include "core/base/secret.h"

namespace ls::http {
namespace {

constexpr std::size_t kMinToken = 16, kMaxToken = 1024;
constexpr std::size_t kMaxList = 1u << 20;

std::string why() { return std::strerror(errno); }

// Reads the file to its end, but at most `most` bytes.
Result<std::string> read_up_to(std::size_t most, const Descriptor& in, const std::filesystem::path& file) {
  std::string text(most, '\0');
  std::size_t size = 0;
  while (size < most) {
    const ssize_t n = ::read(in.fd, text.data() + size, most - size);
    if (n < 0) return fail(Errc::internal, fmt::format("cannot read '{}': {}", file.string(), why()));
    if (n == 0) break;
    size += static_cast<std::size_t>(n);
  }
  text.resize(size);
  return text;
}

Result<std::string> read_token(const Descriptor& in, const std::filesystem::path& file) {
  struct stat info {};
  if (::fstat(in.fd, &info) != 0)
    return fail(Errc::internal, fmt::format("cannot stat '{}': {}", file.string(), why()));
  if ((info.st_mode & 077) != 0)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' may be read by others: chmod 600 it, or delete it to get a new one",
                            file.string()));
  auto text = read_up_to(kMaxToken + 1, in, file);
  if (!text) return text;
  std::string& token = *text;
  while (!token.empty() && static_cast<unsigned char>(token.back()) <= ' ') token.pop_back();
  if (token.size() < kMinToken || token.size() > kMaxToken)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' holds no token of {} to {} characters: delete it to get a "
                            "new one",
                            file.string(), kMinToken, kMaxToken));
  return text;
}

Result<std::string> make_token(const std::filesystem::path& file) {
  auto token = random_token();
  if (!token) return token;
  if (auto written = write_private(file, *token + "\n"); !written) return tl::unexpected(written.error());
  return token;
}

// Reads a file of at most 1 MiB. Returns an empty text if there is no file. failed_precondition: users other
// than the owner may write the file (they may read it), or it is too large or cannot be opened.
Result<std::string> read_list(const std::filesystem::path& file) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (in.fd < 0 && errno == ENOENT) return std::string();
  struct stat info {};
  if (in.fd < 0 || ::fstat(in.fd, &info) != 0)
    return fail(Errc::failed_precondition, fmt::format("cannot open '{}': {}", file.string(), why()));
  if ((info.st_mode & 022) != 0)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' may be written by others: chmod go-w it", file.string()));
  auto text = read_up_to(kMaxList + 1, in, file);
  if (text && text->size() > kMaxList)
    return fail(Errc::failed_precondition,
                fmt::format("'{}' has more than {} bytes", file.string(), kMaxList));
  return text;
}

constexpr std::size_t kIdDigits = 16;
constexpr std::size_t kMaxLine = 256;

// Names of the roles, in the order of the enum Role
constexpr std::array<std::string_view, 4> kRoles = {"admin", "submit", "read", "join"};

std::string_view next_word(std::string_view& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return text = {};
  const std::size_t end = std::min(text.find_first_of(" \t\r", begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

// True for 1 to kMaxUserName characters a-z A-Z 0-9 . _ - @, beginning with a letter or digit.
bool plausible_user(std::string_view name) {
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  if (name.empty() || name.size() > kMaxUserName || !letter(name.front())) return false;
  return std::all_of(name.begin(), name.end(),
                     [&](char c) { return letter(c) || c == '.' || c == '_' || c == '-' || c == '@'; });
}

}  // namespace

Result<std::string> read_or_make_token(const std::filesystem::path& file) {
  const Descriptor in{::open(file.c_str(), O_RDONLY | O_CLOEXEC)};
  if (in.fd >= 0) return read_token(in, file);
  if (errno != ENOENT)
    return fail(Errc::failed_precondition, fmt::format("cannot open '{}': {}", file.string(), why()));
  return make_token(file);
}

Result<std::string> random_token() {
  Digest random;
  if (RAND_bytes(random.bytes.data(), static_cast<int>(random.bytes.size())) != 1)
    return fail(Errc::internal, "the system's random numbers failed");
  return random.hex();
}

TokenRegistry::FileState TokenRegistry::file_state(const std::filesystem::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) return {};
  return {static_cast<std::uint64_t>(info.st_ino), static_cast<std::uint64_t>(info.st_size),
          std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec};
}

FolderLock::FolderLock(const std::filesystem::path& folder)
    : file_(folder.empty() ? -1
                           : ::open((folder / "secrets.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
  while (file_.fd >= 0 && ::flock(file_.fd, LOCK_EX) != 0 && errno == EINTR) continue;
}

std::string_view to_string(Role role) { return kRoles[static_cast<std::size_t>(role)]; }

std::optional<Role> parse_role(std::string_view name) {
  const auto found = std::find(kRoles.begin(), kRoles.end(), name);
  return found == kRoles.end() ? std::nullopt : std::optional(static_cast<Role>(found - kRoles.begin()));
}

TokenRegistry::TokenRegistry(std::string admin_token, std::string join_token)
    : session_key_("session " + admin_token) {
  CHECK(!admin_token.empty(), "an empty token would let everybody in");
  const auto tokens = tokens_.lock();
  tokens->put(Role::admin, {}, sha256(admin_token), true);
  if (!join_token.empty()) tokens->put(Role::join, {}, sha256(join_token), true);
}

Result<std::unique_ptr<TokenRegistry>> TokenRegistry::open(const std::filesystem::path& folder) {
  auto admin = read_or_make_token(folder / "token");
  if (!admin) return tl::unexpected(admin.error());
  auto join = read_or_make_token(folder / "join-token");
  if (!join) return tl::unexpected(join.error());
  if (*admin == *join)
    return fail(Errc::failed_precondition,
                fmt::format("'token' and 'join-token' in '{}' are the same: whoever has a worker's would be "
                            "admin; delete one to get a new one",
                            folder.string()));
  auto registry = std::make_unique<TokenRegistry>(*admin, *join);
  registry->folder_ = folder;
  const auto tokens = registry->tokens_.lock();
  tokens->file = folder / "tokens";
  if (auto read = tokens->read_all(); !read) return tl::unexpected(read.error());
  return registry;
}

Result<void> TokenRegistry::Tokens::read_all() {
  const FileState now = file_state(file);
  auto text = read_list(file);
  if (!text) return tl::unexpected(text.error());
  std::vector<Entry> before = entries;
  std::erase_if(entries, [](const Entry& e) { return !e.info.of_file; });
  int number = 0;
  for (std::string_view rest = *text; !rest.empty();) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    ++number;
    if (const auto done = read_line(rest.substr(0, end)); !done) {
      entries = std::move(before);
      return fail(Errc::failed_precondition,
                  fmt::format("{}:{}: {}", file.string(), number, done.error().message));
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  seen = now;
  return {};
}

Result<void> TokenRegistry::Tokens::look_again() {
  if (file.empty() || (trouble.empty() && file_state(file) == seen)) return {};
  auto read = read_all();
  const std::string before = std::exchange(trouble, read ? "" : read.error().message);
  if (!read && trouble != before) log_error("", trouble);
  return read;
}

Result<void> TokenRegistry::Tokens::read_line(std::string_view line) {
  if (line.size() > kMaxLine) return bad_argument("the line is too long to be a token's");
  std::string_view rest = line.substr(0, line.find('#'));
  const std::string_view role_name = next_word(rest);
  if (role_name.empty()) return {};
  const auto role = parse_role(role_name);
  if (!role) return bad_argument("a line begins with admin, submit, read or join");
  std::string_view user = next_word(rest);
  if (user == "-") user = {};
  if (!user.empty() && !plausible_user(user)) return bad_argument("the second word is no user name, nor '-'");
  if (user.empty() && *role == Role::submit) return bad_argument("a submit token needs a user name");
  const auto digest = Digest::parse(next_word(rest));
  if (!digest || !next_word(rest).empty())
    return bad_argument("the third and last word must be the SHA-256 of the token: 64 hexadecimal digits");
  if (entries.size() >= kMaxTokens) return bad_argument(fmt::format("more than {} tokens", kMaxTokens));
  for (const Entry& e : entries)
    if (e.info.id == digest->hex().substr(0, kIdDigits)) return bad_argument("this token is listed already");
  put(*role, std::string(user), *digest, false);
  return {};
}

void TokenRegistry::Tokens::put(Role role, std::string user, const Digest& digest, bool of_file) {
  entries.push_back({{digest.hex().substr(0, kIdDigits), role, std::move(user), of_file}, digest});
}

Guarded<TokenRegistry::Tokens>::Lock TokenRegistry::latest() const {
  auto tokens = tokens_.lock();
  (void)tokens->look_again();  // if the file is invalid, the tokens stay as they were
  return tokens;
}

std::optional<Caller> TokenRegistry::find(std::string_view token) const {
  const Digest digest = sha256(token);
  const auto tokens = latest();
  std::optional<Caller> found;
  // All entries are compared, so that the duration does not reveal which one matches.
  for (const Entry& e : tokens->entries)
    if (equal_secret(digest, e.digest)) found = {e.info.role, e.info.user, e.info.id};
  return found;
}

std::optional<Caller> TokenRegistry::by_id(std::string_view id) const {
  const auto tokens = latest();
  for (const Entry& e : tokens->entries)
    if (e.info.id == id) return Caller{e.info.role, e.info.user, e.info.id};
  return std::nullopt;
}

bool TokenRegistry::may_join(std::string_view token) const {
  const auto caller = find(token);
  return caller && caller->role == Role::join;
}

Result<TokenRegistry::Made> TokenRegistry::add(Role role, std::string user) {
  if (role == Role::submit && user.empty())
    return bad_argument("a submit token needs a user: its jobs are theirs");
  if (!user.empty() && !plausible_user(user))
    return bad_argument(fmt::format(
        "a user name has 1 to {} of a-z A-Z 0-9 . _ - @ and begins with a letter or digit", kMaxUserName));
  auto token = random_token();
  if (!token) return tl::unexpected(token.error());
  const auto tokens = tokens_.lock();
  const FolderLock others(tokens->file.parent_path());
  // save() overwrites the file, so changes by other coordinators must be read first.
  if (auto read = tokens->look_again(); !read) return tl::unexpected(read.error());
  if (tokens->entries.size() >= kMaxTokens)
    return fail(Errc::resource_exhausted, fmt::format("there are {} tokens already", tokens->entries.size()));
  tokens->put(role, std::move(user), sha256(*token), false);
  if (auto saved = tokens->save(); !saved) {
    tokens->entries.pop_back();
    return tl::unexpected(saved.error());
  }
  return Made{tokens->entries.back().info, std::move(*token)};
}

Result<void> TokenRegistry::revoke(std::string_view id) {
  const auto tokens = tokens_.lock();
  const FolderLock others(tokens->file.parent_path());
  // save() overwrites the file, so changes by other coordinators must be read first.
  if (auto read = tokens->look_again(); !read) return tl::unexpected(read.error());
  auto& entries = tokens->entries;
  const auto found =
      std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.info.id == id; });
  if (found == entries.end()) return fail(Errc::not_found, "there is no such token");
  if (found->info.of_file)
    return fail(Errc::failed_precondition,
                "this token is a file of the data folder: delete it there and restart the coordinator");
  const auto place = found - entries.begin();
  const Entry gone = *found;
  entries.erase(found);
  if (auto saved = tokens->save(); !saved) {
    entries.insert(entries.begin() + place, gone);
    return saved;
  }
  return {};
}

std::vector<TokenInfo> TokenRegistry::list() const {
  const auto tokens = latest();
  std::vector<TokenInfo> all;
  for (const Entry& e : tokens->entries) all.push_back(e.info);
  return all;
}

Result<void> TokenRegistry::Tokens::save() {
  if (file.empty()) return {};
  std::string text =
      "# ROLE USER SHA256-OF-THE-TOKEN; written by the coordinator (lightshaft token add | revoke)\n";
  for (const Entry& e : entries)
    if (!e.info.of_file)
      text += fmt::format("{} {} {}\n", to_string(e.info.role), e.info.user.empty() ? "-" : e.info.user,
                          e.digest.hex());
  auto written = write_private(file, text);
  seen = file_state(file);
  return written;
}

}  // namespace ls::http
