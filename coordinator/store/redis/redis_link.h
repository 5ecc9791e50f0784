// One connection to a Redis server (6 or later); the only user of hiredis. Not thread-safe.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error.h"

struct redisContext;

namespace ls::coordinator {

// redis://[USER:PASSWORD@]HOST[:PORT][/DB]; an IPv6 host is in brackets. TLS (rediss://) is rejected with a
// message that says so.
struct RedisAddress {
  std::string host = "127.0.0.1";
  int port = 6379;
  int db = 0;
  std::string user, password;
  std::string shown() const;  // without the password, for messages and logs
  bool operator==(const RedisAddress&) const = default;
};
Result<RedisAddress> parse_redis_url(std::string_view url);

// A status or text is in `text`; an error answered by Redis becomes a Result's error, never a reply.
struct RedisReply {
  bool nil = false;
  std::int64_t number = 0;
  std::string text;
  std::vector<RedisReply> items;
};

class RedisLink {
 public:
  struct Timeouts {
    Duration connect = std::chrono::seconds(1);
    Duration answer = std::chrono::seconds(2);
  };
  // Connects, authenticates, selects the database.
  static Result<std::unique_ptr<RedisLink>> connect(const RedisAddress& address, Timeouts timeouts);
  ~RedisLink();

  using Command = std::vector<std::string>;  // words of arbitrary bytes
  Result<RedisReply> run(const Command& command);
  // Sends all commands at once; answers in order. A command's error is in its answer; an error of the
  // connection fails the whole call, and it is unknown what Redis has carried out.
  Result<std::vector<Result<RedisReply>>> run_all(std::span<const Command> commands);

  bool broken() const { return broken_; }  // after a connection error: connect again

 private:
  struct Close {
    void operator()(redisContext* context) const;
  };
  RedisLink(redisContext* context, std::string shown);
  Result<Result<RedisReply>> next_reply();
  Error connection_error();

  std::unique_ptr<redisContext, Close> context_;
  std::string shown_;
  bool broken_ = false;
};

}  // namespace ls::coordinator
