// One connection to a Redis server (version 6 or later). Only this code uses the library hiredis. Not
// thread-safe.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/clock.h"
#include "core/base/error.h"

struct redisContext;

namespace ls::coordinator {

// An address redis://[USER:PASSWORD@]HOST[:PORT][/DB]; an IPv6 host is in brackets. TLS addresses (rediss://)
// are rejected by parse_redis_url() with an explanation.
struct RedisAddress {
  std::string host = "127.0.0.1";
  int port = 6379;
  int db = 0;
  std::string user, password;
  std::string shown() const;  // the address without the password, for messages and logs
  bool operator==(const RedisAddress&) const = default;
};
Result<RedisAddress> parse_redis_url(std::string_view url);

// A reply of Redis. A status or a text is in `text`, an integer in `number`, an array in `items`. An error
// reply becomes the error of a Result, so it is never a RedisReply.
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
  // Replaces `link` by a new connection if `link` is null or broken, or the server has closed it, as when
  // Redis was restarted. Returns true if it was replaced.
  static Result<bool> renew(std::unique_ptr<RedisLink>& link, const RedisAddress& address, Timeouts timeouts);
  ~RedisLink();

  using Command = std::vector<std::string>;  // the command's name and its arguments, which may have any bytes
  Result<RedisReply> run(const Command& command);
  // Sends all commands, in batches without waiting in between, and returns their replies in the same order.
  // An error reply to one command becomes the error of that command's Result. An error of the connection
  // fails the whole call; it is then unknown which commands Redis has carried out.
  Result<std::vector<Result<RedisReply>>> run_all(std::span<const Command> commands);

 private:
  struct Close {
    void operator()(redisContext* context) const;
  };
  RedisLink(redisContext* context, std::string shown);
  bool closed_by_server() const;
  Result<Result<RedisReply>> next_reply();
  Error connection_error();

  std::unique_ptr<redisContext, Close> context_;
  std::string shown_;
  bool broken_ = false;
};

}  // namespace ls::coordinator
