// One connection to a Redis server (6 or later); the only door to hiredis. From one thread at a time.
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

// redis://[USER:PASSWORD@]HOST[:PORT][/DB]; an IPv6 host stands in brackets. TLS (rediss://) is refused by
// name.
struct RedisAddress {
  std::string host = "127.0.0.1";
  int port = 6379;
  int db = 0;
  std::string user, password;
  std::string shown() const;  // without the password, for people and logs
  bool operator==(const RedisAddress&) const = default;
};
Result<RedisAddress> parse_redis_url(std::string_view url);

// Status and text are both `text`; an error that Redis answered is a Result's error, never a reply.
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

  using Command = std::vector<std::string>;  // words, each any bytes
  Result<RedisReply> run(const Command& command);
  // All in one go, answers in order. An error of one command is that answer's; an error of the connection is
  // the call's, and what Redis has carried out is then unknown.
  Result<std::vector<Result<RedisReply>>> run_all(std::span<const Command> commands);

  bool broken() const { return broken_; }  // after an error of the connection: connect again

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
