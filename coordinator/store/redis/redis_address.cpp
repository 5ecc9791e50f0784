#include <fmt/format.h>

#include "common/base/parse_number.h"
#include "common/base/safe_text.h"
#include "coordinator/store/redis/redis_link.h"

namespace ls::coordinator {
namespace {

// Returns the number if the whole text is a number from `lo` to `hi`.
std::optional<int> whole_number(std::string_view text, int lo, int hi) {
  const auto value = parse_number<int>(text);
  return value && *value >= lo && *value <= hi ? value : std::nullopt;
}

// HOST, HOST:PORT or [IPV6]:PORT.
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

}  // namespace ls::coordinator
