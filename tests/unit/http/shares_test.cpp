// No caller makes another one wait: on a real port, one client takes all it can get, and another one asks.
#include <atomic>
#include <future>

#include "coordinator/http/net/shares.h"
#include "tests/unit/http/server_fixture.h"

namespace ls::http::testing {
namespace {

std::string with_token(const std::string& request_line, const std::string& token,
                       const std::string& more = "") {
  return request_line + " HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer " + token + "\r\n" + more + "\r\n";
}

std::string post_scene(const std::string& token, std::size_t length) {
  return with_token("POST /api/v1/jobs", token,
                    "Content-Type: application/xml\r\nContent-Length: " + std::to_string(length) + "\r\n");
}

class SharesTest : public ServerTest {
 protected:
  std::string user(const std::string& name) {
    const auto made = tokens.add(Role::submit, name);
    EXPECT_TRUE(made);
    return made ? made->token : "";
  }
  using Clients = std::vector<std::unique_ptr<RawClient>>;
  RawClient& open(Clients& clients, const std::string& text) {
    clients.push_back(std::make_unique<RawClient>(server->port()));
    clients.back()->send(text);
    return *clients.back();
  }
  std::string login(const std::string& token) const {
    const std::string body = "{\"token\":\"" + token + "\"}";
    return "POST /api/v1/session HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: " +
           std::to_string(body.size()) + "\r\n\r\n" + body;
  }
  static Limits patient_limits() {
    Limits limits = quick_limits();
    limits.body_grace_seconds = 600;
    limits.header_seconds = 600;
    limits.linger_seconds = 60;
    limits.connections = 64;
    return limits;
  }
};

TEST_F(SharesTest, UnfinishedBodiesOfOneTokenDoNotBlockOthers) {
  Limits limits = patient_limits();
  limits.body_memory = 4u << 20;
  start(limits);
  const std::string mallory = user("mallory"), bob = user("bob");
  const JobId job = coordinator::submit(*coordinator);
  Clients held;
  const std::uint64_t before = api->counters().body_bytes;
  // One byte before the end of each; once half of the memory is used, those beyond the token's share are
  // refused.
  for (std::uint64_t i = 1; i <= 2; ++i) {
    open(held, post_scene(mallory, 1'000'000) + std::string(999'999, ' '));
    ASSERT_TRUE(eventually([&] { return api->counters().body_bytes - before >= i * 999'999; }));
  }
  for (int i = 2; i < 8; ++i)
    EXPECT_EQ(
        RawClient::status(open(held, post_scene(mallory, 1'000'000) + std::string(999'999, ' ')).response()),
        503)
        << i;

  EXPECT_EQ(ask(login(bob)), 204);
  EXPECT_EQ(ask(login(mallory)), 204);
  const std::string pause = R"({"state":"paused"})";
  EXPECT_EQ(ask(with_token("PATCH /api/v1/jobs/" + job.value, kToken,
                           "Content-Type: application/json\r\nContent-Length: " +
                               std::to_string(pause.size()) + "\r\n") +
                pause),
            200);
  std::string scene = kSceneText;
  scene.resize(900'000, ' ');
  EXPECT_EQ(ask(post_scene(bob, scene.size()) + scene), 201);
}

TEST_F(SharesTest, StalledBodyIsCutAfterABurst) {
  Limits limits = quick_limits();
  limits.min_rate = 1;  // by the mean rate alone the burst would allow a stall of eleven days
  start(limits);
  RawClient slow(server->port());
  slow.send(post_scene(kToken, 1'000'000) + std::string(999'999, ' '));

  EXPECT_EQ(RawClient::status(slow.read_all()), 408);
}

TEST_F(SharesTest, StalledReaderIsCutAfterABurst) {
  Limits limits = quick_limits();
  limits.min_rate = 1;
  records->log_bytes = 30u << 20;
  start(limits);
  const JobId job = coordinator::submit(*coordinator);
  RawClient slow(server->port(), 4096);
  slow.send(with_token("GET /api/v1/jobs/" + job.value + "/log", kToken));
  ASSERT_TRUE(slow.readable());

  EXPECT_TRUE(eventually([&] { return api->counters().connections == 0; }));
}

TEST_F(SharesTest, SlowRequestsOfOneTokenDoNotDelayOthers) {
  std::promise<void> release;
  auto gate = release.get_future().share();
  std::atomic<int> looking{0};
  start(patient_limits());
  const std::string mallory = user("mallory"), bob = user("bob");
  const std::string body = "{\"scene\":\"" + blobs->add(kSceneText).hex() + "\"}";
  blobs->before_look = [&] {
    ++looking;
    gate.wait();
  };
  Clients waiting;
  for (int i = 0; i < 30; ++i)
    open(waiting, with_token("POST /api/v1/jobs", mallory,
                             "Content-Type: application/json\r\nContent-Length: " +
                                 std::to_string(body.size()) + "\r\n") +
                      body);
  ASSERT_TRUE(eventually([&] { return looking > 0; }));

  EXPECT_EQ(ask(post_scene(bob, kSceneText.size()) + kSceneText), 201);

  EXPECT_LE(looking, static_cast<int>(api->limits().slow.each));
  release.set_value();
  for (auto& client : waiting) EXPECT_EQ(RawClient::status(client->response()), 201);
}

TEST_F(SharesTest, RequestOfADisconnectedClientIsNotComputed) {
  std::promise<void> release;
  auto gate = release.get_future().share();
  std::atomic<int> looking{0};
  Limits limits = patient_limits();
  limits.remote = {1, 1};
  start(limits);
  blobs->before_look = [&] {
    ++looking;
    gate.wait();
  };
  const std::string look = with_token("HEAD /api/v1/blobs/" + sha256("x").hex(), kToken);
  Clients clients;
  open(clients, look);
  ASSERT_TRUE(eventually([&] { return looking == 1; }));
  for (int i = 0; i < 5; ++i) open(clients, look);
  ASSERT_TRUE(eventually([&] { return api->counters().connections == 6; }));
  EXPECT_EQ(ask(kGet), 200);  // behind the others' headers, which have been read now

  for (std::size_t i = 1; i < clients.size(); ++i) clients[i]->close();
  release.set_value();

  EXPECT_EQ(RawClient::status(clients[0]->response()), 404);
  EXPECT_TRUE(eventually([&] { return api->counters().connections <= 1; }));
  EXPECT_EQ(looking, 1);
}

TEST_F(SharesTest, UnfinishedHeadersYieldToNewConnections) {
  Limits limits = patient_limits();
  limits.connections = 16;
  start(limits);
  Clients silent;
  for (int i = 0; i < 16; ++i) open(silent, "G");
  ASSERT_TRUE(eventually([&] { return api->counters().connections == 16; }));

  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(ask(kGet), 200) << i;
    open(silent, "G");
  }
}

TEST_F(SharesTest, UnfinishedLoginsYieldToNewConnections) {
  Limits limits = patient_limits();
  limits.connections = 16;
  start(limits);
  Clients silent;
  for (int i = 0; i < 16; ++i)
    open(silent,
         "POST /api/v1/session HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
         "Content-Length: 100\r\n\r\n{");
  ASSERT_TRUE(eventually([&] { return api->counters().connections == 16; }));

  EXPECT_EQ(ask(kGet), 200);
}

TEST_F(SharesTest, ConnectionsOfOneTokenLeaveRoomForOthers) {
  Limits limits = patient_limits();
  limits.connections = 16;
  limits.connections_each = 8;
  start(limits);
  const std::string mallory = user("mallory"), bob = user("bob");
  Clients held;
  for (int i = 0; i < 16; ++i) {
    const std::string body = "blob " + std::to_string(i);
    open(held,
         with_token("PUT /api/v1/blobs/" + sha256(body).hex(), mallory, "Content-Length: 100\r\n") + "b");
    if (i < 8) ASSERT_TRUE(eventually([&] { return blobs->open_uploads == i + 1; }));
  }

  for (std::size_t i = 8; i < 16; ++i) EXPECT_EQ(RawClient::status(held[i]->response()), 503);
  EXPECT_EQ(ask(with_token("GET /api/v1/jobs", bob)), 200);
}

TEST_F(SharesTest, SilentConnectionOfATokenMakesRoomForANewOne) {
  Limits limits = patient_limits();
  limits.connections_each = 2;
  limits.idle_seconds = 600;
  start(limits);
  const std::string user_token = user("mallory");
  const std::string look = with_token("GET /api/v1/jobs", user_token);
  Clients kept;
  for (int i = 0; i < 6; ++i) EXPECT_EQ(RawClient::status(open(kept, look).response()), 200) << i;

  EXPECT_TRUE(eventually([&] { return api->counters().connections == 2; }));
  kept.back()->send(look);
  EXPECT_EQ(RawClient::status(kept.back()->response()), 200);
}

TEST(Shares, CallerMayExceedItsShareWhileHalfIsFree) {
  constexpr std::uint64_t kMegabyte = 1u << 20;
  Shares shares(8 * kMegabyte);
  Shares::Held a, b, c, d, other;

  EXPECT_TRUE(a.take(shares, "mallory", 2 * kMegabyte));
  EXPECT_TRUE(b.take(shares, "mallory", 2 * kMegabyte));
  EXPECT_FALSE(c.take(shares, "mallory", kMegabyte));
  EXPECT_TRUE(other.take(shares, "bob", 2 * kMegabyte));
  b.give_back();
  EXPECT_FALSE(d.take(shares, "mallory", kMegabyte));
  other.give_back();
  EXPECT_TRUE(d.take(shares, "mallory", kMegabyte));
}

TEST_F(SharesTest, TokenMayHaveMoreEventStreamsWhileHalfAreFree) {
  Limits limits = patient_limits();
  limits.event_streams = 6;
  limits.event_streams_each = 1;
  start(limits);
  const std::string mallory = user("mallory");
  Clients readers;
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(open(readers, with_token("GET /api/v1/events", mallory)).read_until("\n\n"));

  EXPECT_EQ(ask(with_token("GET /api/v1/events", mallory)), 503);
}

TEST_F(SharesTest, EventStreamsOfOneTokenLeaveRoomForOthers) {
  Limits limits = patient_limits();
  limits.event_streams_each = 2;
  start(limits);
  const std::string mallory = user("mallory");
  Clients readers;
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(open(readers, with_token("GET /api/v1/events", mallory)).read_until("\n\n"));

  EXPECT_EQ(ask(with_token("GET /api/v1/events", mallory)), 503);
  RawClient admin(server->port());
  admin.send(events());
  EXPECT_TRUE(admin.read_until("HTTP/1.1 200"));
}

}  // namespace
}  // namespace ls::http::testing
