#include "coordinator/store/redis/redis_link.h"

#include <fmt/format.h>
#include <hiredis/hiredis.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <algorithm>
#include <cerrno>

#include "core/base/parse_number.h"
#include "core/base/safe_text.h"

namespace ls::coordinator {
namespace {

// A reply may contain arrays within arrays. The replies that this program needs are not nested deeper than
// this; deeper items are dropped.
constexpr int kMaxDepth = 4;
// At most this many commands are sent before their replies are read
constexpr std::size_t kBatch = 256;

timeval timeval_of(Duration d) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(d).count();
  return {static_cast<time_t>(us / 1'000'000), static_cast<suseconds_t>(us % 1'000'000)};
}

std::string text_of(const redisReply& reply) {
  return reply.str ? std::string(reply.str, reply.len) : std::string();
}

RedisReply copied(const redisReply& from, int depth) {
  RedisReply to;
  to.nil = from.type == REDIS_REPLY_NIL;
  to.number = from.integer;
  to.text = text_of(from);
  if (depth < kMaxDepth)
    for (std::size_t i = 0; i < from.elements; ++i) to.items.push_back(copied(*from.element[i], depth + 1));
  return to;
}

Error redis_error(const std::string& said, const std::string& shown) {
  if (said.starts_with("NOAUTH") || said.starts_with("WRONGPASS") || said.find("AUTH") != std::string::npos)
    return {Errc::invalid_argument,
            fmt::format("{} wants a user and password ({}); put them into --store", shown, said)};
  if (said.starts_with("OOM"))
    return {Errc::resource_exhausted,
            fmt::format("{} has no memory left ({}); raise its maxmemory", shown, said)};
  return {Errc::unavailable, fmt::format("{} answered: {}", shown, said)};
}

// Returns the number if the whole text is a number from `lo` to `hi`; otherwise nullopt.
std::optional<int> whole_number(std::string_view text, int lo, int hi) {
  const auto value = parse_number<int>(text);
  return value && *value >= lo && *value <= hi ? value : std::nullopt;
}

// Parses HOST, HOST:PORT, [IPV6] or [IPV6]:PORT into `address`. False: the text has none of these forms.
bool take_host(std::string_view text, RedisAddress& address) {
  std::string_view port;
  bool has_port = false;
  if (text.starts_with('[')) {
    const auto close = text.find(']');
    if (close == std::string_view::npos) return false;
    address.host = text.substr(1, close - 1);
    const auto rest = text.substr(close + 1);
    if (!rest.empty() && rest.front() != ':') return false;
    has_port = !rest.empty();
    if (has_port) port = rest.substr(1);
  } else {
    const auto colon = text.find(':');
    address.host = text.substr(0, colon);
    has_port = colon != std::string_view::npos;
    if (has_port) port = text.substr(colon + 1);
  }
  if (address.host.empty() || address.host.find('\0') != std::string::npos) return false;
  if (!has_port) return true;
  const auto number = whole_number(port, 1, 65535);
  if (number) address.port = *number;
  return number.has_value();
}

bool take_user(std::string_view text, RedisAddress& address) {
  const auto colon = text.find(':');
  if (colon == std::string_view::npos) return false;
  auto user = percent_decode(text.substr(0, colon)), password = percent_decode(text.substr(colon + 1));
  if (!user || !password || password->empty()) return false;
  address.user = std::move(*user);
  address.password = std::move(*password);
  return true;
}

}  // namespace

std::string RedisAddress::shown() const {
  const bool six = host.find(':') != std::string::npos;
  return fmt::format("redis://{}{}{}:{}/{}", six ? "[" : "", host, six ? "]" : "", port, db);
}

Result<RedisAddress> parse_redis_url(std::string_view url) {
  // The messages do not quote the URL, since it may contain a password.
  const auto bad = [](std::string_view what) {
    return fail(Errc::invalid_argument,
                fmt::format("--store: {}; write redis://[USER:PASSWORD@]HOST[:PORT][/DB]", what));
  };
  if (url.starts_with("rediss://"))
    return bad("rediss:// (TLS) is not supported: put Redis on a private network or behind a TLS tunnel");
  constexpr std::string_view kScheme = "redis://";
  if (!url.starts_with(kScheme)) return bad("this is no redis:// address");
  std::string_view rest = url.substr(kScheme.size());
  RedisAddress address;
  if (const auto slash = rest.rfind('/');
      slash != std::string_view::npos && rest.find('@', slash) == rest.npos) {
    const auto db = rest.substr(slash + 1);
    const auto number = db.empty() ? std::optional(0) : whole_number(db, 0, 1 << 20);
    if (!number) return bad("the database must be a number of at least 0");
    address.db = *number;
    rest = rest.substr(0, slash);
  }
  if (const auto at = rest.rfind('@'); at != std::string_view::npos) {
    if (!take_user(rest.substr(0, at), address)) return bad("the user and password cannot be read");
    rest = rest.substr(at + 1);
  }
  if (!take_host(rest, address)) return bad("the host or port cannot be read");
  return address;
}

void RedisLink::Close::operator()(redisContext* context) const { redisFree(context); }

RedisLink::RedisLink(redisContext* context, std::string shown)
    : context_(context), shown_(std::move(shown)) {}
RedisLink::~RedisLink() = default;

Error RedisLink::connection_error() {
  broken_ = true;
  return {Errc::unavailable, fmt::format("no answer from {}: {}", shown_,
                                         context_ && context_->err ? context_->errstr : "no memory")};
}

Result<std::unique_ptr<RedisLink>> RedisLink::connect(const RedisAddress& address, Timeouts timeouts) {
  redisContext* raw =
      redisConnectWithTimeout(address.host.c_str(), address.port, timeval_of(timeouts.connect));
  std::unique_ptr<RedisLink> link(new RedisLink(raw, address.shown()));
  if (raw == nullptr || raw->err != 0) return tl::unexpected(link->connection_error());
  if (redisSetTimeout(raw, timeval_of(timeouts.answer)) != REDIS_OK)
    return tl::unexpected(link->connection_error());
  (void)redisEnableKeepAlive(raw);
  std::vector<Command> hello;
  if (!address.password.empty())
    hello.push_back(address.user.empty() ? Command{"AUTH", address.password}
                                         : Command{"AUTH", address.user, address.password});
  hello.push_back({"SELECT", std::to_string(address.db)});
  for (const Command& command : hello)
    if (const auto done = link->run(command); !done) return tl::unexpected(done.error());
  return link;
}

bool RedisLink::closed_by_server() const {
  char next = 0;
  const ssize_t got = recv(context_->fd, &next, 1, MSG_PEEK | MSG_DONTWAIT);
  return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
}

Result<bool> RedisLink::renew(std::unique_ptr<RedisLink>& link, const RedisAddress& address,
                              Timeouts timeouts) {
  if (link && !link->broken_ && !link->closed_by_server()) return false;
  link.reset();
  auto fresh = connect(address, timeouts);
  if (!fresh) return tl::unexpected(fresh.error());
  link = std::move(*fresh);
  return true;
}

Result<Result<RedisReply>> RedisLink::next_reply() {
  void* raw = nullptr;
  if (redisGetReply(context_.get(), &raw) != REDIS_OK || raw == nullptr)
    return tl::unexpected(connection_error());
  const std::unique_ptr<redisReply, decltype([](redisReply* r) { freeReplyObject(r); })> reply(
      static_cast<redisReply*>(raw));
  if (reply->type == REDIS_REPLY_ERROR)
    return Result<RedisReply>(tl::unexpected(redis_error(text_of(*reply), shown_)));
  return Result<RedisReply>(copied(*reply, 0));
}

Result<std::vector<Result<RedisReply>>> RedisLink::run_all(std::span<const Command> commands) {
  if (broken_) return tl::unexpected(connection_error());
  std::vector<Result<RedisReply>> replies;
  while (replies.size() < commands.size()) {
    const auto later = commands.subspan(replies.size());
    const auto batch = later.first(std::min(kBatch, later.size()));
    for (const Command& command : batch) {
      std::vector<const char*> words;
      std::vector<std::size_t> lengths;
      for (const std::string& word : command) {
        words.push_back(word.data());
        lengths.push_back(word.size());
      }
      if (redisAppendCommandArgv(context_.get(), static_cast<int>(words.size()), words.data(),
                                 lengths.data()) != REDIS_OK)
        return tl::unexpected(connection_error());
    }
    for (std::size_t i = 0; i < batch.size(); ++i) {
      auto reply = next_reply();
      if (!reply) return tl::unexpected(reply.error());
      replies.push_back(std::move(*reply));
    }
  }
  return replies;
}

Result<RedisReply> RedisLink::run(const Command& command) {
  auto replies = run_all({&command, 1});
  if (!replies) return tl::unexpected(replies.error());
  return std::move(replies->front());
}

}  // namespace ls::coordinator
