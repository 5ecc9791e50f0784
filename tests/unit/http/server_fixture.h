// A server on a real port, for tests of its loop.
#pragma once

#include <gtest/gtest.h>

#include <optional>

#include "coordinator/http/net/http_server.h"
#include "tests/unit/http/fixture.h"
#include "tests/unit/http/raw_client.h"

namespace ls::http::testing {

inline const std::string kAuth = std::string("Authorization: Bearer ") + kToken + "\r\n";
inline const std::string kGet = "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n";

inline Limits quick_limits() {
  Limits limits;
  limits.header_seconds = 0.5;
  limits.idle_seconds = 5;
  limits.body_grace_seconds = 1;
  limits.min_rate = 1e5;
  limits.heartbeat_seconds = 0.1;
  limits.linger_seconds = 0.2;
  limits.stop_seconds = 2;
  limits.connections = 16;
  limits.event_streams = 4;
  limits.blob_bytes = 4u << 20;
  return limits;
}

class ServerTest : public CoordinatorTest {
 protected:
  void start(Limits limits = quick_limits()) {
    auto listening = Server::listen("127.0.0.1:0");
    ASSERT_TRUE(listening) << listening.error().message;
    server = std::move(*listening);
    api.emplace(*coordinator, tokens, limits, StaticFiles(kPages));
    server->start(*api);
  }
  void TearDown() override {
    if (server) server->stop();
  }
  int ask(const std::string& text) {
    RawClient client(server->port());
    client.send(text);
    return RawClient::status(client.response());
  }
  static std::string put(std::string_view body, std::size_t announced) {
    return "PUT /api/v1/blobs/" + sha256(body).hex() + " HTTP/1.1\r\nHost: x\r\n" + kAuth +
           "Content-Length: " + std::to_string(announced) + "\r\n\r\n";
  }
  static std::string events(const std::string& more = "") {
    return "GET /api/v1/events HTTP/1.1\r\nHost: x\r\n" + kAuth + more + "\r\n";
  }

  TokenRegistry tokens{kToken};
  std::optional<Api> api;
  std::unique_ptr<Server> server;
};

}  // namespace ls::http::testing
