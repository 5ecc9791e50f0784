#include "coordinator/http/auth/token_registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/secret.h"
#include "coordinator/http/auth/token_file.h"

namespace ls::http {
namespace {

constexpr std::size_t kIdDigits = 16;
constexpr std::size_t kMaxLine = 256;

constexpr struct {
  Role role;
  std::string_view name;
} kRoles[] = {{Role::admin, "admin"}, {Role::submit, "submit"}, {Role::read, "read"}, {Role::join, "join"}};

std::string_view next_word(std::string_view& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return text = {};
  const std::size_t end = std::min(text.find_first_of(" \t\r", begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

}  // namespace

std::string_view to_string(Role role) {
  for (const auto& row : kRoles)
    if (row.role == role) return row.name;
  return "?";
}

std::optional<Role> parse_role(std::string_view name) {
  for (const auto& row : kRoles)
    if (row.name == name) return row.role;
  return std::nullopt;
}

bool plausible_user(std::string_view name) {
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
  };
  if (name.empty() || name.size() > kMaxUserName || !letter(name.front())) return false;
  return std::all_of(name.begin(), name.end(),
                     [&](char c) { return letter(c) || c == '.' || c == '_' || c == '-' || c == '@'; });
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
