#include <gtest/gtest.h>

#include "coordinator/http/message/message.h"
#include "coordinator/http/net/event_queue.h"

namespace ls::http {
namespace {

using coordinator::StreamEvent;

constexpr EventQueue::Bounds kRoomy{100, 10'000};

TEST(EventQueue, WritesEventsAsServerSentEvents) {
  EXPECT_EQ(format_event({7, "job", "{\"a\":1}", "j-1"}), "id: 7\nevent: job\ndata: {\"a\":1}\n\n");
  EXPECT_EQ(format_event({7, "job", "a\nb\r\nc\rd", ""}),
            "id: 7\nevent: job\ndata: a\ndata: b\ndata: c\ndata: d\n\n");
}

TEST(EventQueue, WakesOncePerBatch) {
  int wakes = 0;
  EventQueue queue(kRoomy, "", 0, [&] { ++wakes; });

  queue.push({1, "job", "a", "j-1"});
  queue.push({2, "job", "b", "j-1"});
  EXPECT_EQ(wakes, 1);
  EXPECT_EQ(queue.take(), "id: 1\nevent: job\ndata: a\n\nid: 2\nevent: job\ndata: b\n\n");
  EXPECT_EQ(queue.take(), "");
  queue.push({3, "job", "c", "j-1"});
  EXPECT_EQ(wakes, 2);

  queue.close();
  queue.push({4, "job", "d", "j-1"});
  EXPECT_EQ(wakes, 2);
}

TEST(EventQueue, PassesEventsOfOneJobAndGeneralOnes) {
  EventQueue queue(kRoomy, "j-1", 0, [] {});

  queue.push({1, "job", "mine", "j-1"});
  queue.push({2, "job", "other", "j-2"});
  queue.push({3, "worker", "all", ""});

  const std::string text = queue.take();
  EXPECT_NE(text.find("mine"), std::string::npos);
  EXPECT_EQ(text.find("other"), std::string::npos);
  EXPECT_NE(text.find("all"), std::string::npos);
}

TEST(EventQueue, ReportsMissedEvents) {
  EventQueue gap(kRoomy, "", 4, [] {});
  gap.push({9, "job", "x", ""});
  EXPECT_EQ(gap.take().substr(0, 62),
            "event: reset\ndata: {\"missed_from\":5,\"missed_to\":8}\n\nid: 9\neven");

  EventQueue none(kRoomy, "", 4, [] {});
  none.push({5, "job", "x", ""});
  EXPECT_EQ(none.take().find("reset"), std::string::npos);

  // Later gaps in the ids are no loss: no event is missed while the reader is subscribed.
  none.push({50, "job", "x", ""});
  EXPECT_EQ(none.take().find("reset"), std::string::npos);
}

TEST(EventQueue, ClosesForATooSlowReader) {
  EventQueue few({2, 10'000}, "", 0, [] {});
  for (std::uint64_t id = 1; id <= 3; ++id) few.push({id, "job", "x", ""});
  EXPECT_TRUE(few.overflowed());
  const std::string text = few.take();  // only whole events; the reader reconnects with id 2
  EXPECT_NE(text.find("id: 2\n"), std::string::npos);
  EXPECT_EQ(text.find("id: 3\n"), std::string::npos);
  few.push({4, "job", "x", ""});
  EXPECT_EQ(few.take(), "");

  EventQueue large({100, 50}, "", 0, [] {});
  large.push({1, "job", std::string(60, 'x'), ""});
  EXPECT_TRUE(large.overflowed());
}

TEST(HeadText, CarriesLengthAndTheHeadersThatProtectBrowsers) {
  const std::string head = head_text(json_response(200, "{}"), {.keep_alive = true}, 784111777);

  EXPECT_TRUE(head.starts_with("HTTP/1.1 200 OK\r\nDate: Sun, 06 Nov 1994 08:49:37 GMT\r\n")) << head;
  for (const char* line :
       {"Content-Type: application/json\r\n", "Content-Length: 2\r\n", "Cache-Control: no-store\r\n",
        "X-Content-Type-Options: nosniff\r\n", "Connection: keep-alive\r\n",
        "Content-Security-Policy: default-src 'none'; frame-ancestors 'none'\r\n"})
    EXPECT_NE(head.find(line), std::string::npos) << line;
  EXPECT_TRUE(head.ends_with("\r\n\r\n"));
}

TEST(HeadText, HasNoLengthWithoutABody) {
  Response empty;
  empty.status = 204;
  EXPECT_EQ(head_text(empty, {}, 0).find("Content-Length"), std::string::npos);
  EXPECT_EQ(head_text(json_response(200, "{}"), {.streamed = true}, 0).find("Content-Length"),
            std::string::npos);
  EXPECT_NE(head_text(json_response(200, "{}"), {.method = Method::head}, 0).find("Content-Length: 2"),
            std::string::npos);
}

}  // namespace
}  // namespace ls::http
