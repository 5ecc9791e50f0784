// Answers that take their time or much room: they keep no other waiting, and no memory.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <future>

#include "coordinator/http/api/process_figures.h"
#include "tests/unit/http/server_fixture.h"

namespace ls::http::testing {
namespace {

// What other machines take their time for: nothing that is answered here waits behind it.
TEST_F(ServerTest, QuestionsToOtherMachinesKeepNoQuickAnswerWaiting) {
  std::promise<void> answered;
  const auto answer = answered.get_future().share();
  std::atomic<int> asking{0};
  coordinator.store.before_look = coordinator.before_asking_others = [&] {
    ++asking;
    answer.wait();
  };
  Limits limits = quick_limits();
  limits.body_grace_seconds = 60;
  start(limits);
  const std::string digest = sha256("x").hex(), body = "{\"digests\":[\"" + digest + "\"]}";
  std::vector<std::unique_ptr<RawClient>> waiting;
  for (const std::string& request :
       {"POST /api/v1/blobs/missing HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n" + kAuth +
            "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body,
        "HEAD /api/v1/blobs/" + digest + " HTTP/1.1\r\nHost: x\r\n" + kAuth + "\r\n",
        "GET /api/v1/jobs/j-away HTTP/1.1\r\nHost: x\r\n" + kAuth + "\r\n"})
    for (int i = 0; i < 2; ++i) {
      waiting.push_back(std::make_unique<RawClient>(server->port()));
      waiting.back()->send(request);
    }

  EXPECT_TRUE(eventually([&] { return asking == 6; }));
  auto ready = std::async(std::launch::async, [&] { return ask("GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n"); });
  const bool quick = ready.wait_for(std::chrono::seconds(10)) == std::future_status::ready;
  answered.set_value();

  EXPECT_TRUE(quick);
  EXPECT_EQ(ready.get(), 200);
  server->stop();  // its threads look at what is here
  server.reset();
}

// Clients that ask for an image and do not read it.
std::vector<std::unique_ptr<RawClient>> slow_readers(int port, int count) {
  std::vector<std::unique_ptr<RawClient>> all;
  for (int i = 0; i < count; ++i) {
    all.push_back(std::make_unique<RawClient>(port));
    all.back()->send("GET /api/v1/jobs/j-1/image.exr HTTP/1.1\r\nHost: x\r\n" + kAuth + "\r\n");
    EXPECT_TRUE(all.back()->readable());
  }
  return all;
}

TEST_F(ServerTest, SlowReadersOfFinishedImagesTakeNoMemory) {
  constexpr std::uint64_t kImage = 50u << 20;
  coordinator.files = std::filesystem::path(::testing::TempDir()) / "finished";
  std::filesystem::create_directories(coordinator.files);
  std::ofstream(coordinator.files / "image.exr") << "a sparse image";
  std::filesystem::resize_file(coordinator.files / "image.exr", kImage);
  coordinator.exr_bytes = kImage;
  Limits limits = quick_limits();
  limits.body_grace_seconds = 60;
  limits.connections = 64;
  start(limits);
  ASSERT_TRUE(coordinator.submit({"s.xml", "<scene/>", {}, {}}));
  const std::uint64_t before = process_figures().resident_bytes;

  auto readers = slow_readers(server->port(), 20);

  EXPECT_LT(process_figures().resident_bytes, before + (200u << 20));
  const std::string whole = readers[7]->response();
  EXPECT_EQ(RawClient::status(whole), 200);
  EXPECT_EQ(whole.size() - whole.find("\r\n\r\n") - 4, kImage);
  EXPECT_NE(whole.find("a sparse image"), std::string::npos);
  std::filesystem::remove_all(coordinator.files);
}

TEST_F(ServerTest, AnswersInMemoryAreBoundedAndLaterOnesAreToldToComeAgain) {
  coordinator.exr_bytes = 100u << 20;
  Limits limits = quick_limits();
  limits.body_grace_seconds = 60;
  start(limits);
  ASSERT_TRUE(coordinator.submit({"s.xml", "<scene/>", {}, {}}));
  auto readers = slow_readers(server->port(), 2);

  EXPECT_EQ(ask("GET /api/v1/jobs/j-1/image.exr HTTP/1.1\r\nHost: x\r\n" + kAuth + "\r\n"), 503);
  EXPECT_EQ(ask(kGet), 200);
  readers.clear();
  EXPECT_TRUE(eventually([&] {
    return ask("GET /api/v1/jobs/j-1/image.exr HTTP/1.1\r\nHost: x\r\nConnection: close\r\n" + kAuth +
               "\r\n") == 200;
  }));
}

}  // namespace
}  // namespace ls::http::testing
