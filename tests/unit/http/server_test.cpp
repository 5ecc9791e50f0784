// The server loop on a real port, with clients that misbehave.
#include "coordinator/http/net/http_server.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <future>
#include <thread>

#include "tests/unit/http/server_fixture.h"

namespace ls::http::testing {
namespace {

TEST_F(ServerTest, ServesSuccessiveRequestsOnOneConnection) {
  start();
  RawClient client(server->port());

  for (int i = 0; i < 3; ++i) {
    client.send(kGet);
    const std::string response = client.response();
    EXPECT_EQ(RawClient::status(response), 200);
    EXPECT_TRUE(response.ends_with("\r\n\r\nok\n")) << response;
  }
  client.send(kGet + kGet);  // two requests sent at once
  EXPECT_EQ(RawClient::status(client.response()), 200);
  EXPECT_EQ(RawClient::status(client.response()), 200);
  client.send("GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_EQ(RawClient::status(client.read_all()), 200);
}

TEST_F(ServerTest, AnswersHeadWithoutABody) {
  start();
  RawClient client(server->port());

  client.send("HEAD / HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");

  const std::string response = client.read_all();
  EXPECT_NE(response.find("Content-Length: " + std::to_string(sizeof kPage - 1)), std::string::npos);
  EXPECT_TRUE(response.ends_with("\r\n\r\n"));
}

TEST_F(ServerTest, RefusesAPortThatIsTaken) {
  start();

  const auto second = Server::listen("127.0.0.1:" + std::to_string(server->port()));

  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::already_exists);
  EXPECT_NE(second.error().message.find("--http"), std::string::npos);
  for (const char* wrong : {"8080", ":8080", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000", "127.0.0.1:-1"})
    EXPECT_EQ(Server::listen(wrong).error().code, Errc::invalid_argument) << wrong;
}

TEST_F(ServerTest, AnswersMalformedRequests) {
  start();

  EXPECT_EQ(ask("\x16\x03\x01 hello\r\n\r\n"), 400);
  EXPECT_EQ(ask("GET /healthz HTTP/1.1\r\n\r\n"), 400);  // no Host
  EXPECT_EQ(ask("GET /healthz HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n"), 400);
  EXPECT_EQ(ask("GET /a%2fb HTTP/1.1\r\nHost: x\r\n\r\n"), 400);
  EXPECT_EQ(ask("BREW /healthz HTTP/1.1\r\nHost: x\r\n\r\n"), 501);
  EXPECT_EQ(ask("POST /api/v1/session HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nTransfer-Encoding: "
                "chunked\r\n\r\n"),
            400);
  EXPECT_EQ(ask("POST /api/v1/session HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\n"),
            400);
  EXPECT_EQ(ask("POST /api/v1/session HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n"), 400);
  EXPECT_EQ(ask("POST /api/v1/session HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: gzip, chunked\r\n\r\n"), 501);
  EXPECT_EQ(ask("GET /" + std::string(9000, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n"), 414);
  EXPECT_EQ(ask("GET / HTTP/1.1\r\nHost: x\r\nX: " + std::string(20'000, 'a') + "\r\n\r\n"), 431);
  EXPECT_EQ(ask("OPTIONS * HTTP/1.1\r\nHost: x\r\n\r\n"), 204);
  EXPECT_EQ(ask(kGet), 200);
}

TEST_F(ServerTest, CutsAHeaderThatDripsIn) {
  start();
  RawClient slow(server->port());
  ASSERT_TRUE(slow.send("GET /healthz HTTP/1.1\r\nHost: x\r\n"));

  EXPECT_EQ(ask(kGet), 200);  // others are served meanwhile
  EXPECT_EQ(RawClient::status(slow.read_all()), 408);
}

TEST_F(ServerTest, CutsATooSlowBodyAndKeepsNothingOfIt) {
  start();
  RawClient slow(server->port());
  ASSERT_TRUE(slow.send(put("never whole", 1'000'000) + "never"));
  EXPECT_TRUE(eventually([&] { return blobs->open_uploads == 1; }));

  EXPECT_EQ(ask(kGet), 200);
  EXPECT_EQ(RawClient::status(slow.read_all()), 408);
  EXPECT_TRUE(eventually([&] { return blobs->open_uploads == 0; }));
}

TEST_F(ServerTest, KeepsNothingOfABrokenUpload) {
  start();
  {
    RawClient client(server->port());
    ASSERT_TRUE(client.send(put("whole", 5) + "who"));
    EXPECT_TRUE(eventually([&] { return blobs->open_uploads == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return blobs->open_uploads == 0; }));
  EXPECT_FALSE(blobs->has(sha256("whole")));
}

TEST_F(ServerTest, StreamsABlobOfManyChunksIntoTheStore) {
  start();
  std::string body(3'000'000, 'x');
  for (std::size_t i = 0; i < body.size(); ++i) body[i] = static_cast<char>(i * 2654435761u >> 13);

  EXPECT_EQ(ask(put(body, body.size()) + body), 201);
  EXPECT_EQ(blobs->size(sha256(body)).value_or(0), body.size());
}

TEST_F(ServerTest, AcceptsChunkedBodiesWithinTheSameLimits) {
  start();
  const std::string head = "PUT /api/v1/blobs/" + sha256("grid").hex() + " HTTP/1.1\r\nHost: x\r\n" + kAuth +
                           "Transfer-Encoding: chunked\r\n\r\n";

  EXPECT_EQ(ask(head + "2\r\ngr\r\n2;a=b\r\nid\r\n0\r\n\r\n"), 201);
  EXPECT_TRUE(blobs->has(sha256("grid")));
  EXPECT_EQ(ask(head + "zz\r\ngr\r\n"), 400);

  const std::string session =
      "POST /api/v1/session HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
      "Transfer-Encoding: chunked\r\n\r\n";
  EXPECT_EQ(ask(session + "2000\r\n" + std::string(0x2000, ' ') + "\r\n0\r\n\r\n"), 413);
}

TEST_F(ServerTest, RefusesATooLongBodyBeforeItArrives) {
  start();

  EXPECT_EQ(ask(put("x", 5u << 20)), 413);
  EXPECT_EQ(blobs->open_uploads, 0);
}

TEST_F(ServerTest, StreamsABundleToTheDiskWithinItsBounds) {
  Limits limits = quick_limits();
  limits.bundle_bytes = 700'000;
  start(limits);
  const std::string head =
      "POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\n" + kAuth + "Content-Type: application/x-tar\r\n";
  const std::string zeros(512 * 1024, '\0');
  char size[16];
  std::snprintf(size, sizeof size, "%zx\r\n", zeros.size());
  const std::string chunk = size + zeros + "\r\n";

  // The archives are well-formed but empty.
  EXPECT_EQ(ask(head + "Content-Length: " + std::to_string(zeros.size()) + "\r\n\r\n" + zeros), 400);
  EXPECT_EQ(ask(head + "Transfer-Encoding: chunked\r\n\r\n" + chunk + "0\r\n\r\n"), 400);
  EXPECT_EQ(ask(head + "Transfer-Encoding: chunked\r\n\r\n" + chunk + chunk), 413);
  EXPECT_EQ(ask(head + "Content-Length: 700001\r\n\r\n"), 413);
  EXPECT_EQ(ask(head + "Content-Length: 0\r\n\r\n"), 400);
  EXPECT_TRUE(coordinator->jobs().empty());
}

TEST_F(ServerTest, AnswersARefusedUploadThatIsStillBeingSent) {
  start();
  const std::string body(500'000, 'x');

  // Without a token: rejected by the header alone, while most of the body is still being sent.
  EXPECT_EQ(ask("PUT /api/v1/blobs/" + sha256(body).hex() +
                " HTTP/1.1\r\nHost: x\r\nContent-Length: 500000\r\n\r\n" + body),
            401);
}

TEST_F(ServerTest, RequestsTheBodyOnlyWhenItIsNeeded) {
  start();
  RawClient client(server->port());
  std::string head = put("grid", 4);
  head.insert(head.size() - 2, "Expect: 100-continue\r\n");

  client.send(head);
  EXPECT_TRUE(client.read_until("100 Continue\r\n\r\n"));
  client.received.clear();
  client.send("grid");
  EXPECT_EQ(RawClient::status(client.response()), 201);

  EXPECT_EQ(ask(head), 204);  // the blob is stored already, so its body is not requested
}

TEST_F(ServerTest, ServesOthersWhileTheSlowWorkIsBusy) {
  start();
  std::promise<void> release;
  auto gate = release.get_future().share();
  const std::string body = "{\"scene\":\"" + blobs->add(kSceneText).hex() + "\"}";
  blobs->before_look = [gate] { gate.wait(); };
  std::vector<std::unique_ptr<RawClient>> waiting;
  for (int i = 0; i < 6; ++i) {  // more requests than slow threads
    waiting.push_back(std::make_unique<RawClient>(server->port()));
    waiting.back()->send("POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n" +
                         kAuth + "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  }

  EXPECT_EQ(ask("GET /api/v1/jobs HTTP/1.1\r\nHost: x\r\n" + kAuth + "\r\n"), 200);
  EXPECT_EQ(ask(kGet), 200);

  release.set_value();
  for (auto& client : waiting) EXPECT_EQ(RawClient::status(client->response()), 201);
}

TEST_F(ServerTest, BoundsTheNumberOfConnections) {
  start();
  std::vector<std::unique_ptr<RawClient>> open;
  for (int i = 0; i < 16; ++i) {
    open.push_back(std::make_unique<RawClient>(server->port()));
    open.back()->send(put("whole", 5) + "who");
  }
  ASSERT_TRUE(eventually([&] { return blobs->open_uploads == 16; }));  // all are in progress, none is idle

  RawClient more(server->port());
  EXPECT_EQ(RawClient::status(more.read_all()), 503);

  for (auto& client : open) EXPECT_EQ(RawClient::status(client->read_all()), 408);  // their time is up
  open.clear();
  EXPECT_TRUE(eventually([&] { return api->counters().connections == 0; }));
  EXPECT_EQ(ask(kGet), 200);
}

TEST_F(ServerTest, IdleConnectionsMakeRoom) {
  start();
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 16; ++i) idle.push_back(std::make_unique<RawClient>(server->port()));
  ASSERT_TRUE(eventually([&] { return api->counters().connections == 16; }));

  EXPECT_EQ(ask(kGet), 200);
}

TEST_F(ServerTest, StreamsEventsFromWhereTheReaderLeftOff) {
  start();
  const JobId job = coordinator::submit(*coordinator);  // event 1
  for (int i = 2; i <= 5; ++i) ASSERT_TRUE(set_priority(*coordinator, job, 10 + i));
  ASSERT_EQ(coordinator->last_event_id(), 5u);

  RawClient fresh(server->port());
  fresh.send(events());
  ASSERT_TRUE(fresh.read_until("id: 5\n\n"));
  RawClient back(server->port());
  back.send(events("Last-Event-ID: 3\r\n"));
  ASSERT_TRUE(back.read_until("\"priority\":15"));
  EXPECT_EQ(back.received.find("\"priority\":13"), std::string::npos);
  EXPECT_NE(back.received.find("id: 4\nevent: job\ndata: {"), std::string::npos);
  RawClient other_life(server->port());
  other_life.send(events("Last-Event-ID: 99\r\n"));
  EXPECT_TRUE(other_life.read_until("event: reset\n"));

  ASSERT_TRUE(set_priority(*coordinator, job, 16));
  EXPECT_TRUE(fresh.read_until("id: 6\nevent: job\ndata: {"));
  EXPECT_TRUE(fresh.read_until("\"priority\":16"));
  EXPECT_EQ(fresh.received.find("\"priority\":15"), std::string::npos);
  EXPECT_NE(fresh.received.find("Content-Type: text/event-stream"), std::string::npos);
  EXPECT_TRUE(fresh.read_until("\n:\n\n"));  // the heartbeat of a silent stream
}

TEST_F(ServerTest, ForgetsReadersThatLeave) {
  start();
  {
    RawClient reader(server->port());
    reader.send(events());
    ASSERT_TRUE(eventually([&] { return api->counters().event_streams == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return api->counters().event_streams == 0; }));
}

TEST_F(ServerTest, DisconnectsATooSlowReader) {
  Limits limits = quick_limits();
  limits.event_queue = 64;
  start(limits);
  RawClient lazy(server->port(), 4096);
  lazy.send(events());
  RawClient keen(server->port());
  keen.send(events());
  ASSERT_TRUE(keen.read_until("id: 0\n\n"));
  ASSERT_TRUE(eventually([&] { return api->counters().event_streams == 2; }));

  const JobId job = coordinator::submit(*coordinator);
  int sent = 1;
  EXPECT_TRUE(eventually([&] {  // `lazy` reads nothing: its socket fills, then its queue
    EXPECT_TRUE(set_priority(*coordinator, job, ++sent));
    EXPECT_TRUE(keen.read_until("id: " + std::to_string(sent) + "\n"));
    keen.received.clear();
    return api->counters().event_streams == 1;
  }));
  EXPECT_EQ(ask(kGet), 200);
}

TEST_F(ServerTest, BoundsTheNumberOfEventStreams) {
  start();
  std::vector<std::unique_ptr<RawClient>> readers;
  for (int i = 0; i < 4; ++i) {
    readers.push_back(std::make_unique<RawClient>(server->port()));
    readers.back()->send(events());
    ASSERT_TRUE(readers.back()->read_until("\n\n"));
  }

  EXPECT_EQ(ask(events()), 503);
  EXPECT_EQ(ask(kGet), 200);
}

TEST_F(ServerTest, StopsWithReadersIdlersAndHalfRequestsOpen) {
  start();
  RawClient reader(server->port()), idler(server->port()), half(server->port()), upload(server->port());
  reader.send(events());
  half.send("GET /");
  upload.send(put("whole", 5) + "who");
  ASSERT_TRUE(reader.read_until("\n\n"));
  ASSERT_TRUE(eventually([&] { return blobs->open_uploads == 1; }));

  server->stop();

  EXPECT_EQ(api->counters().event_streams, 0u);
  EXPECT_EQ(blobs->open_uploads, 0);
  reader.read_all();
  EXPECT_EQ(idler.read_all(), "");
}

}  // namespace
}  // namespace ls::http::testing
