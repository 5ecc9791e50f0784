// Slow answers and large ones: neither delays the answers to other clients or takes much memory.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <future>

#include "coordinator/http/api/metrics.h"
#include "tests/unit/http/server_fixture.h"
#include "tests/unit/store/temp_folder.h"

namespace ls::http::testing {
namespace {

// Requests that wait for another machine do not delay requests that are answered from memory.
TEST_F(ServerTest, RequestsToOtherMachinesDoNotDelayQuickResponses) {
  std::promise<void> answered;
  const auto answer = answered.get_future().share();
  std::atomic<int> asking{0};
  blobs->before_look = records->before_asking_others = [&] {
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
  EXPECT_EQ(ask("GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n"), 200);
  answered.set_value();
  server->stop();  // stopped here, since its threads use the variables above
  server.reset();
}

// Connects `count` clients that send the request and do not read the answer.
std::vector<std::unique_ptr<RawClient>> slow_readers(int port, int count, const std::string& request) {
  std::vector<std::unique_ptr<RawClient>> all;
  for (int i = 0; i < count; ++i) {
    all.push_back(std::make_unique<RawClient>(port));
    all.back()->send(request);
    EXPECT_TRUE(all.back()->readable());
  }
  return all;
}

TEST_F(ServerTest, SlowReadersOfFinishedImagesTakeNoMemory) {
  constexpr std::uint64_t kImage = 50u << 20;
  const TempFolder data;
  coordinator = open({.data = data.path()});
  const JobId job = coordinator::submit(*coordinator);
  ASSERT_TRUE(FakeFarm(*coordinator, 1).finish(job));
  const auto image = data.path() / "jobs" / job.value / "image.exr";
  std::ofstream(image) << "a sparse image";
  std::filesystem::resize_file(image, kImage);
  Limits limits = quick_limits();
  limits.body_grace_seconds = 60;
  limits.connections = 64;
  start(limits);
  const std::uint64_t before = process_figures().resident_bytes;

  auto readers =
      slow_readers(server->port(), 20,
                   "GET /api/v1/jobs/" + job.value + "/image.exr HTTP/1.1\r\nHost: x\r\n" + kAuth + "\r\n");

  EXPECT_LT(process_figures().resident_bytes, before + (200u << 20));
  const std::string whole = readers[7]->response();
  EXPECT_EQ(RawClient::status(whole), 200);
  EXPECT_EQ(whole.size() - whole.find("\r\n\r\n") - 4, kImage);
  EXPECT_NE(whole.find("a sparse image"), std::string::npos);
  server->stop();  // before the folder is removed
}

TEST_F(ServerTest, ResponsesInMemoryAreBoundedAndFurtherRequestsGet503) {
  records->log_bytes = 100u << 20;
  Limits limits = quick_limits();
  limits.body_grace_seconds = 600;
  start(limits);
  const std::string get_log =
      "GET /api/v1/jobs/" + coordinator::submit(*coordinator).value + "/log HTTP/1.1\r\nHost: x\r\n" + kAuth;
  auto readers = slow_readers(server->port(), 2, get_log + "\r\n");

  RawClient client(server->port());
  client.send(get_log + "\r\n");
  const std::string refused = client.response();
  EXPECT_EQ(RawClient::status(refused), 503);
  EXPECT_NE(refused.find("Retry-After"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("Retry-After"), refused.rfind("Retry-After")) << refused;
  EXPECT_EQ(ask(kGet), 200);
  readers.clear();
  EXPECT_TRUE(eventually([&] { return ask(get_log + "Connection: close\r\n\r\n") == 200; }));
}

}  // namespace
}  // namespace ls::http::testing
